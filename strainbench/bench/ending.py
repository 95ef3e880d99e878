"""How cells end before their last step, in words, and the thresholds of those that do not."""

from __future__ import annotations

from enum import StrEnum

VIOLATION, GAP = 1e-6, 1e-4
"""The thresholds of every outcome in a results folder; printed with each table."""


class Ending(StrEnum):
    """A kind of end; its value is how the reason in a row begins, so that old rows are read alike.

    What no member stands for is an exception, and its reason begins with that one's name.
    """

    UNAVAILABLE = "unavailable"  # what the solver needs is not installed
    UNSUPPORTED = "unsupported"  # the solver refuses the problem
    UNRECORDED = "the frames to replay could not be recorded"
    TIME_LIMIT = "time limit"
    MEMORY_LIMIT = "memory limit"
    HUNG = "hung"  # before its clock started
    CRASHED = "crashed"  # its process ended, by a signal or by itself
    SILENT = "the process ended without a word"
    DAMAGED = "the journal is damaged"
    TAMPERED = "the clock was tampered with"
    UNJUDGED = "the referee failed"
    LOST = "the worker failed"  # of a dask scheduler

    @classmethod
    def of(cls, reason: str) -> Ending | None:
        """The end that a reason tells of."""
        return next((ending for ending in cls if reason.startswith(ending)), None)

    @property
    def passing(self) -> bool:
        """Whether the cell is worth another try as it is."""
        return self in (Ending.UNAVAILABLE, Ending.LOST)
