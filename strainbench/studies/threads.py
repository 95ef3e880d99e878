"""One thread, as for the cells that a benchmark plays in processes of their own."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from threadpoolctl import threadpool_limits

from strainbench.bench.machine import fixed_threads


@contextmanager
def one_thread() -> Iterator[None]:
    """In BLAS and OpenMP, of libraries that are loaded, that will be, and in processes started."""
    with fixed_threads(1), threadpool_limits(1):
        yield
