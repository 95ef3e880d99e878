"""Tables and charts from a results folder."""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from strainbench.report.runs import load_runs
    from strainbench.report.written import write_report

__all__ = ["load_runs", "write_report"]
_HOMES = {"load_runs": "runs", "write_report": "written"}


def __getattr__(name: str) -> object:
    """Import what is offered when it is asked for: `strainbench recommend` asks for no chart."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    return globals()[name]
