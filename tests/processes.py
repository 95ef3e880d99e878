"""What a test has started, by a token in the environment that all of it inherits."""

from __future__ import annotations

import time
from uuid import uuid4

import psutil

TOKEN = "STRAINBENCH_TEST"


def mark_what_starts(monkeypatch):
    """Let all processes from here on bear a token, which is returned."""
    token = uuid4().hex
    monkeypatch.setenv(TOKEN, token)
    return token


def left_running(token, seconds=0.0):
    """The command lines of what bears the token and has not gone after so many seconds."""
    patience = time.monotonic() + seconds
    while True:
        found = [
            p.info["cmdline"]
            for p in psutil.process_iter(["cmdline", "environ"])
            if (p.info["environ"] or {}).get(TOKEN) == token
        ]
        if not found or time.monotonic() > patience:
            return found
        time.sleep(0.05)
