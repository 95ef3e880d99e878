"""A bar beside what a study that is its own program goes through."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from rich.console import Console
from rich.progress import track


def watched(items: Iterable[Any], what: str, total: int) -> Iterable[Any]:
    """The items, with a bar on the error stream of a terminal; see `strainbench.progress.Track`."""
    console = Console(stderr=True)
    return track(
        items, what, total, console=console, transient=True, disable=not console.is_terminal
    )
