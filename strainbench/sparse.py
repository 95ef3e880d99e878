"""`scipy.sparse`, imported when something of it is first asked for.

It takes as long to load as all else that a list of the solvers needs.
"""

from importlib import import_module
from typing import Any


def __getattr__(name: str) -> Any:
    return getattr(import_module("scipy.sparse"), name)
