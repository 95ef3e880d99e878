"""Where the seconds of a minimisation go."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from time import perf_counter


class Timed:
    """What counts the seconds of its parts.

    Attributes
    ----------
    seconds : by part [s]
    """

    def __init__(self) -> None:
        self.seconds = dict.fromkeys(("assembly", "factorisation", "line_search"), 0.0)

    @contextmanager
    def timed(self, part: str) -> Iterator[None]:
        """Count the time within."""
        begin = perf_counter()
        try:
            yield
        finally:
            self.seconds[part] += perf_counter() - begin
