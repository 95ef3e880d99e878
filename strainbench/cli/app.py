"""The command line: list, run, report, compare, converge, duel, export, ledger, render, polar."""

from __future__ import annotations

import os
import shlex
import signal
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from io import TextIOWrapper
from pathlib import Path
from typing import Annotated, TextIO

import psutil
import typer
from rich import box
from rich.console import Console

from strainbench import __version__
from strainbench.bench.cell import Cell
from strainbench.bench.machine import describe_machine, fixed_threads
from strainbench.bench.plan import never_warm, plan, plan_one, plan_scene
from strainbench.bench.recording import record, record_all, recorded, recorder
from strainbench.bench.records import DiskError, open_folder
from strainbench.bench.runner import Runner, Settings
from strainbench.cli.display import Display, console, errors, print_summary, progress, say
from strainbench.cli.listing import tables
from strainbench.cli.options import (
    AllSolvers,
    Folder,
    FrameNumber,
    OneScenario,
    SolversValues,
    Steps,
    TableFile,
    Tolerance,
    Values,
)
from strainbench.document.writers import terminal as on_terminal
from strainbench.escape import plain, terminal
from strainbench.files import disk_errors
from strainbench.options import WrongWordError, number, path, shown, whole
from strainbench.plugins import told
from strainbench.problem.export import check_format, write_problem
from strainbench.problem.problem import Problem
from strainbench.referee.reference import REFERENCE_SOLVER
from strainbench.scenario.registry import list_scenarios
from strainbench.scenario.scenario import SceneWarning

app = typer.Typer(
    add_completion=False,
    pretty_exceptions_enable=False,
    help="Benchmark strain-limiting solvers for cloth: same scenes, one referee.",
)
DEFAULT_RESULTS = Path("results/local/run")
DEFAULT_LEDGER = Path("results/local/ledger")
DEFAULT_PICTURES = Path("results/local/pictures")
DEFAULT_CONVERGENCE = Path("results/local/convergence")
DEFAULT_DUEL = Path("results/local/duel")
INTERRUPTED = 130  # exit status after Ctrl-C
TERMINATED = 128 + signal.SIGTERM  # and after a polite kill
DEBUG = "STRAINBENCH_DEBUG"
MOST_THREADS = 1024
VERBS = (
    *("list", "run", "report", "compare", "converge"),
    *("duel", "export", "ledger", "render", "polar"),
)


class TerminatedError(BaseException):
    """SIGTERM: the end of everything, as Ctrl-C is."""


class InterruptedRunError(Exception):
    """Ctrl-C or SIGTERM, and what is kept."""

    def __init__(self, cause: BaseException, kept: str) -> None:
        super().__init__(kept)
        self.status = TERMINATED if isinstance(cause, TerminatedError) else INTERRUPTED


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


@app.command("list")
def list_(
    what: Annotated[
        str | None,
        typer.Argument(help="solvers, scenarios, nothing for both; or one of them, for its fields"),
    ] = None,
) -> None:
    """List solvers and scenarios: method, paper, availability; or the fields of one."""
    for table in tables(what):
        console.print(on_terminal(table, box.SIMPLE_HEAD))


@app.command()
def run(
    scenarios: Annotated[list[str], typer.Argument(help="scenario names, or paths of .py files")],
    solver: AllSolvers = None,
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", help="KEY=V1,V2 of the scenario, or SOLVER.KEY=V1,V2"),
    ] = None,
    steps: Annotated[
        int | None,
        typer.Option(
            parser=whole("--steps"),
            metavar="N",
            help="time steps a cell; if not given, what the scene takes",
        ),
    ] = None,
    duration: Annotated[
        float | None,
        typer.Option(
            parser=number("--duration", " of seconds"),
            metavar="SECONDS",
            help="of the scene's time a cell, instead of --steps",
        ),
    ] = None,
    mode: Annotated[str, typer.Option(help="simulate (closed loop) or replay (same frames)")] = (
        "simulate"
    ),
    start: Annotated[
        str,
        typer.Option(help="cold, warm (from the frame before, where a solver can) or cold,warm"),
    ] = "cold",
    tolerance: Annotated[str, typer.Option(help="aimed at by every solver; 1e-3,1e-6 for two")] = (
        "1e-6"
    ),
    time_limit: Annotated[
        float | None,
        typer.Option(
            parser=number("--time-limit", " of seconds"),
            metavar="SECONDS",
            help="a cell, physics and solver; none by default",
        ),
    ] = None,
    memory_limit: Annotated[
        float | None,
        typer.Option(
            parser=number("--memory-limit", " of MB"),
            metavar="MB",
            help="a cell; by default 3/4 of the machine's, shared",
        ),
    ] = None,
    jobs: Annotated[
        int,
        typer.Option(
            parser=whole("--jobs"),
            metavar="N",
            help="cells at a time; with more than one, times are disturbed",
        ),
    ] = 1,
    threads: Annotated[
        int,
        typer.Option(parser=whole("--threads", MOST_THREADS), metavar="N", help="threads a solver"),
    ] = 1,
    scheduler: Annotated[
        str | None, typer.Option(help="address of a dask scheduler whose workers run the cells")
    ] = None,
    results: Folder = DEFAULT_RESULTS,
    rerun: Annotated[bool, typer.Option("--rerun", help="run finished cells again")] = False,
) -> None:
    """Run every combination of scenarios, settings and solvers; resumes by itself."""
    if scheduler is not None and not scheduler.strip():
        raise ValueError("--scheduler '': an address such as tcp://host:8786 is valid")
    if steps is not None and duration is not None:
        raise ValueError(f"--steps {steps} and --duration {duration:g}: one of them is valid")
    cells = plan(
        scenarios,
        solver or ["all"],
        set_ or [],
        mode,
        steps,
        _numbers(tolerance),
        time_limit,
        duration,
        start.split(","),
        threads,
    )
    if "cold" not in start and (cold := never_warm(solver or ["all"])):
        say(f"left out, as they cannot start warm: {', '.join(cold)}")
    jobs = min(jobs, len(cells))
    memory = memory_limit or 0.75 * psutil.virtual_memory().total / 1024**2 / jobs
    settings = Settings(results, jobs, memory, rerun)
    display = Display()
    try:
        with display:
            if scheduler is not None:
                from strainbench.bench.cluster import (
                    run_on_cluster,  # dask only where it is asked for
                )

                run_on_cluster(scheduler, cells, settings, display)
                return
            summary = Runner(settings, display).run(cells)
    except (KeyboardInterrupt, TerminatedError) as end:
        raise InterruptedRunError(end, display.kept(len(cells))) from None
    print_summary(summary, len(cells), results)


def _numbers(text: str) -> list[float]:
    try:
        return [float(word) for word in text.split(",")]
    except ValueError:
        raise ValueError(
            f"--tolerance {shown(text)}: a number, or several with commas, is valid"
        ) from None


@app.command()
def report(
    results: Folder = DEFAULT_RESULTS,
) -> None:
    """Write tables (CSV, Markdown, LaTeX), charts and an HTML page from results."""
    from strainbench.report import write_report  # pandas and matplotlib only where needed

    with disk_errors(results):
        paths = write_report(results)
    for written in paths:
        say(f"wrote {written}")


@app.command()
def compare(
    first: Annotated[Path, typer.Argument(parser=path("A"), help="folder of results, A")],
    second: Annotated[Path, typer.Argument(parser=path("B"), help="folder of results, B")],
    output: TableFile = None,
) -> None:
    """Compare two folders of results, cell by cell: ratios of times, changes in outcome."""
    from strainbench.report import compare as comparing  # pandas only where needed
    from strainbench.report.output import write_output

    found = comparing.compare(first, second)
    if output is not None:
        write_output(output, found.document(), found.cells())
    for line in found.head():
        say(line)
    for table in found.tables():
        console.print(on_terminal(table))
    for line in [*found.foot(), *([f"wrote {output}"] if output else [])]:
        say(line)


@app.command()
def render(
    scenario: OneScenario,
    solver: Annotated[str, typer.Option(help="name, or path of a .py file")] = "clarabel",
    set_: Values = None,
    steps: Steps = 30,
    every: Annotated[
        int, typer.Option(parser=whole("--every"), metavar="K", help="keep each K-th step")
    ] = 1,
    format_: Annotated[
        str, typer.Option("--format", help="of png, gif, mp4, obj, ply, vtu, with commas")
    ] = "png,gif",
    camera: Annotated[str, typer.Option(help="azimuth,elevation of the view, degrees")] = "30,32",
    scale: Annotated[
        str | None, typer.Option(help="strain at the colour scale's end, such as 5%; else fitted")
    ] = None,
    tolerance: Tolerance = 1e-6,
    output: Annotated[
        Path,
        typer.Option("-o", "--output", parser=path("-o"), metavar="DIR", help="folder"),
    ] = DEFAULT_PICTURES,
) -> None:
    """Play a scene with one solver; write pictures, animations and mesh series."""
    from strainbench import render as pictures  # matplotlib and meshio only where needed

    top = None if scale is None else pictures.parse_scale(scale)
    view = pictures.parse_camera(camera)
    with progress() as bar:
        lines = pictures.render(
            scenario,
            solver,
            set_ or [],
            steps,
            every,
            format_,
            output,
            view,
            top,
            tolerance,
            lambda items, what, total: bar.track(items, total, description=what),
        )
    for line in lines:
        say(line)


@app.command()
def polar(
    scenario: OneScenario,
    solver: Annotated[
        str, typer.Option(help="name, comma-separated names, or a path")
    ] = "clarabel",
    set_: Values = None,
    steps: Annotated[
        int,
        typer.Option(
            parser=whole("--steps"), metavar="N", help="time steps; the last one is drawn"
        ),
    ] = 30,
    tolerance: Tolerance = 1e-6,
    output: Annotated[
        Path,
        typer.Option(
            "-o",
            "--output",
            parser=path("-o", "an .svg, .png or .pdf file"),
            metavar="FILE",
            help="an .svg, .png or .pdf file",
        ),
    ] = DEFAULT_PICTURES / "polar.svg",
) -> None:
    """Draw the limits over the material angle, and the strains a scene ends with."""
    from strainbench.render.polar import polar as draw  # matplotlib only where needed

    with progress() as bar:
        lines = draw(
            scenario,
            solver,
            set_ or [],
            steps,
            output,
            tolerance,
            lambda items, what, total: bar.track(items, total, description=what),
        )
    for line in lines:
        say(line)


@app.command()
def export(
    scenario: OneScenario,
    frame: FrameNumber,
    output: Annotated[
        Path,
        typer.Option(
            "-o",
            "--output",
            parser=path("-o", "a file"),
            metavar="FILE",
            help="the file to write",
        ),
    ],
    format_: Annotated[
        str | None,
        typer.Option("--format", help="cbf or npz; by default what the file's name ends in"),
    ] = None,
    solver: Annotated[
        str, typer.Option(help="answers the projections before; name, or path of a .py file")
    ] = REFERENCE_SOLVER,
    set_: Values = None,
    tolerance: Tolerance = 1e-6,
) -> None:
    """Write one projection of a scene as a conic instance (CBF) or as arrays (npz)."""
    if output.is_dir():
        raise ValueError(
            f"-o {output} is a folder: a file is valid, such as {output / 'frame.cbf'}"
        )
    kind = check_format(output.suffix.removeprefix(".") if format_ is None else format_)
    cell = plan_one(scenario, solver, set_ or [], frame, tolerance)
    open_folder(output.parent, "-o")
    problem = _record(cell, frame)
    before = f"those before by {cell.solver.label}"
    about = f"{cell.scenario.label}, projection {frame}, {before}; strainbench {__version__}"
    write_problem(problem, output, kind, about)
    size = f"{3 * len(problem.free)} variables, {problem.constraints} constraints"
    say(f"wrote {output}: {size}")


@app.command("converge")
def converge_(
    scenario: OneScenario,
    frame: FrameNumber,
    solver: AllSolvers = None,
    set_: SolversValues = None,
    tolerance: Annotated[
        float,
        typer.Option(
            parser=number("--tolerance"), metavar="X", help="the tightest that solvers aim at"
        ),
    ] = 1e-8,
    time_limit: Annotated[
        float,
        typer.Option(
            parser=number("--time-limit", " of seconds"),
            metavar="SECONDS",
            help="a solver, all its runs",
        ),
    ] = 60.0,
    results: Folder = DEFAULT_CONVERGENCE,
) -> None:
    """Follow solvers on one projection of a scene: violation, gap and distance against time."""
    from strainbench.studies.convergence.measure import (  # the referee only where needed
        CANDIDATE,
        converge,
    )
    from strainbench.studies.convergence.report import write_convergence

    cells = plan_scene(scenario, solver or ["all"], set_ or [], 1, tolerance, time_limit)
    if all(cell.solver.label == CANDIDATE for cell in cells):
        there = "the candidate itself is there in any case"
        raise ValueError(f"--solver {CANDIDATE}: {there}; the names of other solvers are valid")
    problem = _record(recorder(cells[0]), frame)
    memory = 0.75 * psutil.virtual_memory().total / 1024**2
    kept = 0
    try:
        with progress() as bar:
            ended = converge(cells, problem, frame, results, memory)
            for cell, ending in bar.track(ended, len(cells), description="solvers"):
                say(f"{cell.solver.label}: {ending}", bar.console)
                kept += 1
    except (KeyboardInterrupt, TerminatedError) as end:
        rows = f"; the rows of {kept} of {len(cells)} solvers are kept" if kept else ""
        raise InterruptedRunError(end, rows) from None
    for written in write_convergence(results):
        say(f"wrote {written}")


def _record(cell: Cell, frame: int) -> Problem:
    """A projection of a scene, with a progress bar on the way there."""
    with _playing(cell, frame) as asked:
        return record(cell, frame, asked)


@contextmanager
def _playing(cell: Cell, frame: int) -> Iterator[Callable[[int], None]]:
    """What shows how many projections a scene has asked for, on its way to `frame`."""
    with progress() as bar:
        task = bar.add_task(plain(f"playing {cell.title}"), total=max(frame - 1, 1))
        yield lambda asked: bar.update(task, completed=asked - 1)


@app.command("duel")
def duel_(
    scenario: OneScenario,
    frame: Annotated[
        str, typer.Option(help="projections, the first being 1: 5,10 apart, 14-29 in sequence")
    ],
    solver: Annotated[
        list[str], typer.Option(help="name, comma-separated names, path of a .py file")
    ],
    set_: SolversValues = None,
    repeats: Annotated[
        int,
        typer.Option(
            parser=whole("--repeats"), metavar="N", help="turns of each solver on each frame"
        ),
    ] = 5,
    tolerance: Tolerance = 1e-6,
    time_limit: Annotated[
        float,
        typer.Option(
            parser=number("--time-limit", " of seconds"), metavar="SECONDS", help="a projection"
        ),
    ] = 60.0,
    units: Annotated[
        bool,
        typer.Option("--units", help="beside factorisation + solve, and a step of implicit Euler"),
    ] = False,
    results: Annotated[
        Path,
        typer.Option(parser=path("--results"), metavar="DIR", help="folder that keeps the frames"),
    ] = DEFAULT_DUEL,
    output: TableFile = None,
) -> None:
    """Let solvers take turns on the same projections: ratios of times in one run."""
    from strainbench.report.output import check_ending, write_output
    from strainbench.studies.duel.measure import duel, parse_frames
    from strainbench.studies.duel.report import Outcome

    sequences = parse_frames(frame)
    last = max(numbers[-1] for numbers in sequences)
    if output is not None:
        check_ending(output)
    cells = plan_scene(scenario, solver, set_ or [], 1, tolerance, time_limit)
    solvers = [cell.solver.solver() for cell in cells if not cell.solver.unavailable]
    for cell in cells:
        if cell.solver.unavailable:
            raise ValueError(cell.solver.unavailable)
    machine, about = describe_machine(threads=1)
    fed = recorder(cells[0])
    with fixed_threads(1), _playing(fed, last) as asked:
        if units:  # whose steps are to be timed now
            recording = record_all(fed, last, asked)
        else:
            recording = recorded(fed, last, results / "frames", asked)
    turns = repeats * sum(map(len, sequences)) * len(solvers)
    with progress() as bar:
        task = bar.add_task("projections", total=turns)
        entries = duel(
            solvers,
            recording,
            sequences,
            repeats,
            tolerance,
            time_limit,
            units,
            lambda: bar.advance(task),
        )
    for entry, cell in zip(entries, cells, strict=False):  # units of time may follow
        entry.label = cell.solver.label
    title = f"{cells[0].scenario.label}, projections {frame}, tolerance {tolerance:g}"
    outcome = Outcome(title, shlex.join(["strainbench", *sys.argv[1:]]), {machine: about}, entries)
    Console(width=max(console.width, 200)).print(
        on_terminal(outcome.table())
    )  # its columns are many
    if output is not None:
        write_output(output, outcome.document(), outcome.cells())
        say(f"wrote {output}")


@app.command()
def ledger(
    scenarios: Annotated[
        list[str] | None, typer.Argument(help="scenario names, or paths; by default all of ours")
    ] = None,
    solver: Annotated[str, typer.Option(help="name, or path of a .py file")] = "clarabel",
    set_: Annotated[
        list[str] | None, typer.Option("--set", help="KEY=VALUE of the scenarios")
    ] = None,
    steps: Steps = 60,
    tolerance: Tolerance = 1e-6,
    results: Folder = DEFAULT_LEDGER,
) -> None:
    """Write what each scene models, and what each part of its physics changes in the answer."""
    from strainbench.studies import ledger as accounts  # pandas only where it is needed

    names = scenarios or [entry.name for entry in list_scenarios()]
    cells = plan(names, [solver], set_ or [], "simulate", steps, [tolerance], None)
    with progress() as bar:
        written = accounts.write_ledger(
            cells,
            results,
            lambda items, what, total: bar.track(items, total, description=what),
        )
    for file in written:
        say(f"wrote {file}")


def _terminate(*_: object) -> None:
    """End like Ctrl-C; a second one ends it at once."""
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    raise TerminatedError


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


def main() -> None:
    """Run the command line; exit 2 for a wrong word, 1 for our own fault or the disk's.

    130 and 143 after Ctrl-C and SIGTERM. Each is one line; with STRAINBENCH_DEBUG set, a fault of
    ours shows where it is.
    """
    signal.signal(signal.SIGTERM, _terminate)
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
    except typer.TyperException as error:
        message = getattr(error, "format_message", error.__str__)()
        return 2, f"{message} (strainbench --help lists what is valid)"
    except InterruptedRunError as interrupt:
        return interrupt.status, f"interrupted{interrupt}"
    except TerminatedError:
        return TERMINATED, "interrupted"
    except DiskError as error:
        return 1, str(error)
    except (ValueError, WrongWordError) as error:
        return 2, str(error)
    except OSError as error:
        return 1, f"{error.filename or 'a file'}: {error.strerror or error}"
    except Exception as error:
        if os.environ.get(DEBUG):
            raise
        return 1, f"a fault of its own, {told(error)}; {DEBUG}=1 shows where"
    # typer has turned KeyboardInterrupt into a status
    return status, "interrupted" if status == INTERRUPTED else ""
