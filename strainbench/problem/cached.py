"""What the frames of one mesh share."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any, TypeVar

Value = TypeVar("Value")


def of_mesh(compute: Callable[[Any], Value]) -> cached_property[Value]:
    """A cached property that the frames of one mesh share, whichever of them is asked first."""

    def shared(problem: Any) -> Value:
        values: dict[str, Value] = problem._mesh
        if compute.__name__ not in values:
            values[compute.__name__] = compute(problem)
        return values[compute.__name__]

    shared.__doc__ = compute.__doc__
    return cached_property(shared)
