"""What the suite tells while it works; a display may listen to it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Protocol

Track = Callable[[Iterable[Any], str, int], Iterable[Any]]
"""(items, what they are, how many) to the same items, with a progress bar beside them."""


def untracked(items: Iterable[Any], what: str, total: int) -> Iterable[Any]:  # noqa: ARG001
    """The items, with nothing shown."""
    return items


class SceneWarning(UserWarning):
    """What a scene says of itself when it is planned; see `Scenario.notes`."""


class Work(Protocol):
    """What is run, such as a cell."""

    @property
    def title(self) -> str:
        """What to call it."""

    @property
    def steps(self) -> int:
        """Of how many it has."""


class Observer:
    """Who hears how a run goes on; this one does nothing about it."""

    def planned(self, cells: Sequence[Work], skipped: int) -> None:
        """These cells will run, and so many had finished before."""

    def started(self, cell: Work) -> None:
        """A cell's process was started."""

    def stepped(self, cell: Work, steps: int) -> None:
        """A running cell has done so many steps."""

    def ended(self, cell: Work, row: Mapping[str, object]) -> None:
        """A cell's row was written."""

    def failed(self, cell: Work, reason: str, printed: str) -> None:
        """A cell whose row was written ended before its time; what its process printed."""

    def waiting(self, what: str) -> None:
        """Nothing goes on until this comes."""
