"""Ctrl-C and SIGTERM, and what they leave."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager

INTERRUPTED = 130  # exit status after Ctrl-C
TERMINATED = 128 + signal.SIGTERM  # and after a polite kill


class TerminatedError(BaseException):
    """SIGTERM: the end of everything, as Ctrl-C is."""


class InterruptedRunError(Exception):
    """Ctrl-C or SIGTERM, and what is kept."""

    def __init__(self, cause: BaseException, kept: str) -> None:
        super().__init__(kept)
        self.status = TERMINATED if isinstance(cause, TerminatedError) else INTERRUPTED


def terminate(*_: object) -> None:
    """End like Ctrl-C; a second one ends it at once."""
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    raise TerminatedError


@contextmanager
def keeping(kept: Callable[[], str]) -> Iterator[None]:
    """Work of which an interrupt leaves what `kept` says."""
    try:
        yield
    except (KeyboardInterrupt, TerminatedError) as end:
        raise InterruptedRunError(end, kept()) from None
