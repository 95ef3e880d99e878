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
from typing import Any

from numba import config, njit

from strainbench.sources import closure, digest


def compiled(function: Callable[..., Any] | None = None, *, error_model: str = "python") -> Any:
    """Compile `function` by numba on its first call, and keep the machine code on disk.

    Parameters
    ----------
    error_model : "python" raises ZeroDivisionError, "numpy" gives inf or NaN.
    """
    if function is None:
        return lambda f: compiled(f, error_model=error_model)
    before = config.CACHE_DIR
    config.CACHE_DIR = str(cache_folder(Path(inspect.getfile(function)), before))
    try:
        return njit(cache=True, error_model=error_model)(function)
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
