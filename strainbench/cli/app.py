"""The command line: its verbs, and how it ends.

What a verb works with is imported when it is asked for: help comes at once.
"""

from __future__ import annotations

import os
import signal
import sys
import warnings
from collections.abc import Callable
from io import TextIOWrapper
from typing import Annotated, TextIO

import typer

from strainbench import __version__
from strainbench.cli.advice import recommend
from strainbench.cli.claims import audit_claims
from strainbench.cli.display import console, errors, say
from strainbench.cli.explain import explain_cell
from strainbench.cli.instances import export_frames, make_test_set
from strainbench.cli.interrupt import (
    INTERRUPTED,
    TERMINATED,
    InterruptedRunError,
    TerminatedError,
    terminate,
)
from strainbench.cli.kit import check_solvers, profile_solver
from strainbench.cli.overview import Verbs
from strainbench.cli.pictures import draw_polar, render_scene
from strainbench.cli.report import compare_results, report_results
from strainbench.cli.run import run_cells
from strainbench.cli.sensitivity import measure_sensitivity
from strainbench.cli.stability import draw_map
from strainbench.cli.studies import compare_steps, follow_solvers, keep_ledger, let_duel
from strainbench.escape import terminal
from strainbench.options import WrongWordError
from strainbench.progress import SceneWarning

app = typer.Typer(
    cls=Verbs,
    add_completion=False,
    pretty_exceptions_enable=False,
    help="Benchmark strain-limiting solvers for cloth: same scenes, one referee.",
)
DEBUG = "STRAINBENCH_DEBUG"


@app.callback(invoke_without_command=True)
def strainbench(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="show the version and exit")] = False,
) -> None:
    """Benchmark strain-limiting solvers for cloth: same scenes, one referee."""
    if version:
        say(f"strainbench {__version__}")
        raise typer.Exit
    if context.invoked_subcommand is None:
        console.print(terminal(context.get_help()))
        raise WrongWordError(f"a command is missing; valid are {', '.join(VERBS)}")


def show_list(
    what: Annotated[
        str | None,
        typer.Argument(help="solvers, scenarios, nothing for both; or one of them, for its fields"),
    ] = None,
) -> None:
    """List solvers and scenarios: method, paper, availability; or the fields of one."""
    from rich import box

    from strainbench.cli.listing import tables
    from strainbench.document.writers import terminal as on_terminal

    for table in tables(what):
        console.print(on_terminal(table, box.SIMPLE_HEAD))


VERBS: dict[str, Callable[..., None]] = {
    "list": show_list,
    "run": run_cells,
    "report": report_results,
    "compare": compare_results,
    "recommend": recommend,
    "converge": follow_solvers,
    "duel": let_duel,
    "profile": profile_solver,
    "check": check_solvers,
    "export": export_frames,
    "testset": make_test_set,
    "ledger": keep_ledger,
    "step": compare_steps,
    "map": draw_map,
    "explain": explain_cell,
    "sensitivity": measure_sensitivity,
    "render": render_scene,
    "polar": draw_polar,
    "claims": audit_claims,
}
for _name, _verb in VERBS.items():
    app.command(_name)(_verb)


def main() -> None:
    """Run the command line; exit 2 for a wrong word, 1 for our own fault or the disk's.

    130 and 143 after Ctrl-C and SIGTERM. Each is one line; with STRAINBENCH_DEBUG set, a fault of
    ours shows where it is.
    """
    signal.signal(signal.SIGTERM, terminate)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):  # what a locale lacks is shown as a question mark
            stream.reconfigure(errors="replace")
    status, line = _run()
    if line:
        say(f"strainbench: {line}", errors)
    sys.exit(status)


def _run() -> tuple[int, str]:
    """The exit status, and what there is to say of it."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("always", SceneWarning)
            warnings.showwarning = _show_warning
            status = app(standalone_mode=False) or 0
    except TerminatedError:
        return TERMINATED, "interrupted"
    except Exception as error:
        if found := _expected(error):
            return found
        if os.environ.get(DEBUG):
            raise
        from strainbench.plugins import told

        return 1, f"a fault of its own, {told(error)}; {DEBUG}=1 shows where"
    # typer has turned KeyboardInterrupt into a status
    return status, "interrupted" if status == INTERRUPTED else ""


def _expected(error: Exception) -> tuple[int, str] | None:
    """The exit status and the line of what is no fault of ours; None of one that is."""
    from strainbench.files import DiskError

    match error:
        case typer.TyperException():
            message = getattr(error, "format_message", error.__str__)()
            return 2, f"{message} (strainbench --help lists what is valid)"
        case InterruptedRunError():
            return error.status, f"interrupted{error}"
        case DiskError():
            return 1, str(error)
        case ValueError() | WrongWordError():
            return 2, str(error)
        case OSError():
            return 1, f"{error.filename or 'a file'}: {error.strerror or error}"
    return None


def _show_warning(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,  # noqa: ARG001
    line: str | None = None,
) -> None:
    """What a scene says is one line; all else as Python has it."""
    if issubclass(category, SceneWarning):
        say(f"strainbench: note: {message}", errors)
    else:
        text = warnings.formatwarning(message, category, filename, lineno, line)
        errors.print(text, markup=False)
