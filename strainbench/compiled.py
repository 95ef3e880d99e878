"""numba, with a cache on disk that notices every source that a function depends on.

numba's own cache looks at the file of a function alone: one that calls a compiled function of
another file, or uses its constants, would keep the old machine code when that file changes. Here
the cache's folder is named by a digest of the file and of all that it imports.
"""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import ParamSpec, TypeVar, cast, overload

from numba import config, njit

from strainbench.sources import closure, digest

P = ParamSpec("P")
R = TypeVar("R")
Kernel = Callable[P, R]


@overload
def compiled(function: Kernel[P, R]) -> Kernel[P, R]: ...


@overload
def compiled(*, error_model: str) -> Callable[[Kernel[P, R]], Kernel[P, R]]: ...


def compiled(
    function: Kernel[P, R] | None = None, *, error_model: str = "python"
) -> Kernel[P, R] | Callable[[Kernel[P, R]], Kernel[P, R]]:
    """Compile `function` by numba on its first call, and keep the machine code on disk.

    Parameters
    ----------
    error_model : "python" raises ZeroDivisionError, "numpy" gives inf or NaN.
    """
    if function is None:
        return lambda f: _compiled(f, error_model)
    return _compiled(function, error_model)


def _compiled(function: Kernel[P, R], error_model: str) -> Kernel[P, R]:
    before = config.CACHE_DIR
    config.CACHE_DIR = str(cache_folder(Path(inspect.getfile(function)), before))
    try:
        return cast(Kernel[P, R], njit(cache=True, error_model=error_model)(function))
    finally:
        config.CACHE_DIR = before


@cache
def cache_folder(file: Path, given: str = "") -> Path:
    """Where the machine code of a module's functions lies.

    Parameters
    ----------
    given : NUMBA_CACHE_DIR, or "" for the file's `__pycache__`, or the user's cache where that
        cannot be written to
    """
    beside = file.parent
    own = beside if os.access(beside, os.W_OK) else Path.home() / ".cache" / "strainbench"
    return (Path(given) if given else own / "__pycache__") / f"numba-{digest(closure(file))}"
