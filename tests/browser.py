"""A headless Chromium, told what to do by its DevTools protocol over a pair of pipes."""

from __future__ import annotations

import base64
import json
import os
import shutil
import subprocess
import time
from pathlib import Path

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome")
SETTLED = "document.readyState === 'complete'"
PATIENCE = 60.0  # seconds until something is taken for hung


def chromium() -> str:
    """The browser, or a skip with its reason."""
    found = next(filter(None, map(shutil.which, NAMES)), None)
    if found is None:
        pytest.skip(f"none of {', '.join(NAMES)} is installed")
    return found


class Browser:
    """One process; `open` gives a page of it."""

    def __init__(self, profile: Path):
        ours, theirs = os.pipe(), os.pipe()
        options = [
            *("--headless=new", "--no-sandbox", "--disable-gpu", "--remote-debugging-pipe"),
            *("--no-first-run", "--disable-background-networking", f"--user-data-dir={profile}"),
        ]
        script = f'exec "$0" "$@" 3<&{ours[0]} 4>&{theirs[1]}'
        self.process = subprocess.Popen(
            ["bash", "-c", script, chromium(), *options],
            pass_fds=(ours[0], theirs[1]),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(ours[0])
        os.close(theirs[1])
        self.inlet, self.outlet = ours[1], theirs[0]
        self.rest, self.number, self.events = b"", 0, []

    def close(self) -> None:
        """End the process."""
        self.call("Browser.close")
        self.process.wait(PATIENCE)
        os.close(self.inlet)
        os.close(self.outlet)

    def call(self, method: str, session: str = "", **params: object) -> dict:
        """What a method answers; events that come meanwhile are kept."""
        self.number += 1
        message = {"id": self.number, "method": method, "params": params}
        message |= {"sessionId": session} if session else {}
        os.write(self.inlet, json.dumps(message).encode() + b"\0")
        while (answer := self._next()).get("id") != self.number:
            self.events.append(answer)
        assert "error" not in answer, answer
        return answer["result"]

    def _next(self) -> dict:
        while b"\0" not in self.rest:
            self.rest += os.read(self.outlet, 1 << 20) or self._gone()
        message, self.rest = self.rest.split(b"\0", 1)
        return json.loads(message)

    def _gone(self) -> bytes:
        raise RuntimeError(f"the browser ended with status {self.process.wait(PATIENCE)}")

    def open(self, path: Path, width: int = 1280, height: int = 900, hash_: str = "") -> Page:
        """A page of a file, once it is loaded and its charts are drawn."""
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        page = Page(self, target, session)
        for domain in ("Page", "Runtime", "Network", "Log"):
            page.call(f"{domain}.enable")
        phone = {"mobile": width < 700, "deviceScaleFactor": 1}
        page.call("Emulation.setDeviceMetricsOverride", width=width, height=height, **phone)
        page.call("Page.navigate", url=path.resolve().as_uri() + hash_)
        page.until(f"location.href !== 'about:blank' && {SETTLED}")
        return page


class Page:
    """A page in a browser."""

    def __init__(self, browser: Browser, target: str, session: str):
        self.browser, self.target, self.session = browser, target, session

    def call(self, method: str, **params: object) -> dict:
        """A method of this page."""
        return self.browser.call(method, self.session, **params)

    def run(self, script: str) -> object:
        """What an expression comes to; promises are waited for."""
        answer = self.call(
            "Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True
        )
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def until(self, condition: str) -> None:
        """Wait for it to be true."""
        end = time.monotonic() + PATIENCE
        while not self.run(condition):
            assert time.monotonic() < end, f"never: {condition}"
            time.sleep(0.05)

    def faults(self) -> list[str]:
        """What the console said in anger, and exceptions."""
        self.run("1")  # events come before this answer
        return [json.dumps(e["params"])[:500] for e in self._events() if _is_fault(e)]

    def requests(self) -> list[str]:
        """Addresses that it asked for, itself and data apart."""
        asked = [e for e in self._events() if e["method"] == "Network.requestWillBeSent"]
        urls = [e["params"]["request"]["url"] for e in asked]
        return [url for url in urls[1:] if not url.startswith(("data:", "blob:"))]

    def _events(self) -> list[dict]:
        return [e for e in self.browser.events if e.get("sessionId") == self.session]

    def picture(self, path: Path) -> None:
        """The whole page as PNG."""
        shot = self.call("Page.captureScreenshot", captureBeyondViewport=True)
        path.write_bytes(base64.b64decode(shot["data"]))

    def close(self) -> None:
        """Be gone."""
        self.browser.call("Target.closeTarget", targetId=self.target)


def _is_fault(event: dict) -> bool:
    """An exception, or what the console or the browser calls an error; a warning is none."""
    params = event["params"]
    match event["method"]:
        case "Runtime.exceptionThrown":
            return True
        case "Runtime.consoleAPICalled":
            return params["type"] in ("error", "assert")
        case "Log.entryAdded":
            return params["entry"]["level"] == "error"
    return False
