"""numba, with a cache on disk that notices every source that a function depends on.

numba's own cache looks at the file of a function alone: one that calls a compiled function of
another file, or uses its constants, would keep the old machine code when that file changes. Here
the cache's folder is named by a digest of the file and of all that it imports.

numba itself, a second of imports, is loaded by the first call of a compiled function: what is
listed or helped with is not computed.
"""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable
from functools import cache, cached_property, update_wrapper
from pathlib import Path
from typing import Any, Generic, ParamSpec, TypeVar, overload

from strainbench.sources import closure, digest

P = ParamSpec("P")
R = TypeVar("R")
Kernel = Callable[P, R]


@overload
def compiled(function: Kernel[P, R]) -> Kernel[P, R]: ...


@overload
def compiled(
    *, error_model: str = ..., contract: bool = ...
) -> Callable[[Kernel[P, R]], Kernel[P, R]]: ...


def compiled(
    function: Kernel[P, R] | None = None, *, error_model: str = "python", contract: bool = False
) -> Kernel[P, R] | Callable[[Kernel[P, R]], Kernel[P, R]]:
    """Compile `function` by numba on its first call, and keep the machine code on disk.

    Parameters
    ----------
    error_model : "python" raises ZeroDivisionError, "numpy" gives inf or NaN.
    contract : whether a product and a sum may be one instruction that rounds once, as C compilers
        have it; nothing else is reordered, and NaN stays NaN.
    """
    options: dict[str, object] = {
        "error_model": error_model,
        "fastmath": {"contract"} if contract else False,
    }
    if function is None:
        return lambda f: Compiled(f, options)
    return Compiled(function, options)


class Compiled(Generic[P, R]):
    """A function that numba compiles once it is called, by Python or from another of its kind."""

    def __init__(self, function: Kernel[P, R], options: dict[str, object]) -> None:
        update_wrapper(self, function)
        self._options = options

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> R:
        """Call the machine code."""
        result: R = self.dispatcher(*args, **kwargs)
        return result

    def __getattr__(self, name: str) -> Any:
        """What numba tells of the function, `stats` or `signatures`."""
        if name.startswith("__"):
            raise AttributeError(name)
        return getattr(self.dispatcher, name)

    @property
    def _numba_type_(self) -> Any:
        """What another compiled function takes this one for."""
        return self.dispatcher._numba_type_

    @cached_property
    def dispatcher(self) -> Any:
        """numba's own object."""
        from numba import config, njit

        function = self.__wrapped__
        before = config.CACHE_DIR
        config.CACHE_DIR = str(cache_folder(Path(inspect.getfile(function)), before))
        try:
            return njit(cache=True, **self._options)(function)
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
