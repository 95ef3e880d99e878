"""Named parts of a solver's work, timed while somebody asks: `strainbench profile`.

    from strainbench import section

    with section("factorise"):
        ...

While nobody asks, a section is one look at a variable. Sections may lie within others: what is
counted of each are its own seconds, without those of the sections within it, so that they add up.
They are of the thread that solves, around compiled code and not in it.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from time import perf_counter
from types import TracebackType

_OFF: AbstractContextManager[None] = nullcontext()


@dataclass
class Part:
    """What a section took: its own seconds, and how often it was entered."""

    seconds: float = 0.0
    calls: int = 0


class Sections:
    """The sections that were entered while this listened, in the order of their first time."""

    def __init__(self) -> None:
        self.parts: dict[str, Part] = {}
        self.within: list[float] = []  # seconds inside each open section that belong to others


class _Section:
    """One that is timed."""

    def __init__(self, sections: Sections, name: str) -> None:
        self._sections = sections
        self._part = sections.parts.setdefault(name, Part())

    def __enter__(self) -> None:
        self._sections.within.append(0.0)
        self._begin = perf_counter()

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        at: TracebackType | None,
    ) -> None:
        whole, within = perf_counter() - self._begin, self._sections.within
        self._part.seconds += whole - within.pop()
        self._part.calls += 1
        if within:
            within[-1] += whole


_listener: Sections | None = None


def section(name: str) -> AbstractContextManager[None]:
    """A part of a solver's work that has a name; see the module."""
    return _OFF if _listener is None else _Section(_listener, name)


@contextmanager
def listening() -> Iterator[Sections]:
    """Time all sections that are entered meanwhile."""
    global _listener
    before, _listener = _listener, Sections()
    try:
        yield _listener
    finally:
        _listener = before
