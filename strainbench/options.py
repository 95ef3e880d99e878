"""Numbers and paths of the command line: read, or one line that says what is valid."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

MOST = 10_000_000  # of anything that is counted


class WrongWordError(Exception):
    """A word of the command line that means nothing; the message is one line."""


def whole(option: str, most: int = MOST) -> Callable[[str | int], int]:
    """A reader of whole numbers from 1 to `most`."""

    def read(text: str | int) -> int:
        try:
            value = int(text)
        except ValueError:
            value = 0
        if not 0 < value <= most:
            upto = f" up to {most}" if value > most else ""
            raise WrongWordError(f"{option} {shown(text)}: a whole number above 0{upto} is valid")
        return value

    return read


def number(option: str, of: str = "") -> Callable[[str | float], float]:
    """A reader of finite numbers above 0, `of` some unit."""

    def read(text: str | float) -> float:
        try:
            value = float(text)
        except ValueError:
            value = 0.0
        if not 0 < value < float("inf"):
            raise WrongWordError(f"{option} {shown(text)}: a number{of} above 0 is valid")
        return value

    return read


def path(option: str, what: str = "a folder") -> Callable[[str | Path], Path]:
    """A reader of paths, which are not empty."""

    def read(text: str | Path) -> Path:
        if not str(text).strip() or "\0" in str(text):
            raise WrongWordError(f"{option} {shown(text)}: the path of {what} is valid")
        return Path(text)

    return read


def shown(text: object) -> str:
    """A word as it was given, in quotes where nothing would be seen of it."""
    return str(text) if str(text).strip() else repr(str(text))
