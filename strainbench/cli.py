"""The command line: list, run, report, compare, converge, duel, export, ledger, render, polar."""

from __future__ import annotations

import shlex
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, TextIO

import psutil
import typer
from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    SpinnerColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Table

from strainbench import __version__
from strainbench.cell import Cell
from strainbench.discovery import Entry, list_scenarios, list_solvers
from strainbench.export import check_format, write_problem
from strainbench.frame import record, record_all, recorded, recorder
from strainbench.machine import describe_machine, fixed_threads
from strainbench.plan import never_warm, plan, plan_one, plan_scene
from strainbench.problem import Problem
from strainbench.records import RecordsError
from strainbench.reference import REFERENCE_SOLVER
from strainbench.runner import Observer, Runner, Settings, Summary
from strainbench.scenario import SceneWarning

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    help="Benchmark strain-limiting solvers for cloth: same scenes, one referee.",
)
console = Console()
DEFAULT_RESULTS = Path("results/local/run")
DEFAULT_LEDGER = Path("results/local/ledger")
DEFAULT_PICTURES = Path("results/local/pictures")
DEFAULT_CONVERGENCE = Path("results/local/convergence")
DEFAULT_DUEL = Path("results/local/duel")
DEFAULT_STEPS = 10
INTERRUPTED = 130  # exit status after Ctrl-C
errors = Console(stderr=True, soft_wrap=True, highlight=False)


@app.command("list")
def list_(
    what: Annotated[str, typer.Argument(help="solvers, scenarios, or nothing for both")] = "",
) -> None:
    """List solvers and scenarios: method, paper, availability."""
    tables = {"solvers": list_solvers, "scenarios": list_scenarios}
    if what and what not in tables:
        raise ValueError(f"list {what}: valid are solvers, scenarios")
    for name, entries in tables.items():
        if what in ("", name):
            console.print(_entries(name, entries()))


def _entries(title: str, entries: Sequence[Entry]) -> Table:
    table = Table(title=title, title_justify="left", title_style="bold")
    for column in ("name", "method" if title == "solvers" else "scene", "paper", "available"):
        table.add_column(column, overflow="fold", no_wrap=column == "name")
    for e in entries:
        table.add_row(e.name, e.method, e.paper, e.unavailable or "yes")
    return table


@app.command()
def run(
    scenarios: Annotated[list[str], typer.Argument(help="scenario names, or paths of .py files")],
    solver: Annotated[
        list[str] | None,
        typer.Option(help="name, comma-separated names, path of a .py file, or all (default)"),
    ] = None,
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", help="KEY=V1,V2 of the scenario, or SOLVER.KEY=V1,V2"),
    ] = None,
    steps: Annotated[
        int | None, typer.Option(help=f"time steps a cell; {DEFAULT_STEPS} if not given")
    ] = None,
    duration: Annotated[
        float | None, typer.Option(help="seconds of the scene's time a cell, instead of --steps")
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
        float | None, typer.Option(help="seconds a cell, physics and solver; none by default")
    ] = None,
    memory_limit: Annotated[
        float | None, typer.Option(help="MB a cell; by default 3/4 of the machine's, shared")
    ] = None,
    jobs: Annotated[
        int, typer.Option(help="cells at a time; with more than one, times are disturbed")
    ] = 1,
    threads: Annotated[int, typer.Option(help="threads a solver")] = 1,
    scheduler: Annotated[
        str | None, typer.Option(help="address of a dask scheduler whose workers run the cells")
    ] = None,
    results: Annotated[Path, typer.Option(help="folder of the results")] = DEFAULT_RESULTS,
    rerun: Annotated[bool, typer.Option("--rerun", help="run finished cells again")] = False,
) -> None:
    """Run every combination of scenarios, settings and solvers; resumes by itself."""
    for name, value in (("--jobs", jobs), ("--threads", threads)):
        if value < 1:
            raise ValueError(f"{name} {value}: a whole number above 0 is valid")
    if memory_limit is not None and not memory_limit > 0:
        raise ValueError(f"--memory-limit {memory_limit}: a number of MB above 0 is valid")
    if steps is not None and duration is not None:
        raise ValueError(f"--steps {steps} and --duration {duration:g}: one of them is valid")
    cells = plan(
        scenarios,
        solver or ["all"],
        set_ or [],
        mode,
        DEFAULT_STEPS if steps is None else steps,
        _numbers(tolerance),
        time_limit,
        duration,
        start.split(","),
    )
    if "cold" not in start and (cold := never_warm(solver or ["all"])):
        left_out = f"left out, as they cannot start warm: {', '.join(cold)}"
        console.print(left_out, highlight=False, markup=False, soft_wrap=True)
    memory = memory_limit or 0.75 * psutil.virtual_memory().total / 1024**2 / jobs
    settings = Settings(results, jobs, threads, memory, rerun)
    with Display() as display:
        if scheduler:
            from strainbench.cluster import run_on_cluster  # dask only where it is asked for

            run_on_cluster(scheduler, cells, settings, display)
            return
        summary = Runner(settings, display).run(cells)
    _print_summary(summary, len(cells), results)


def _numbers(text: str) -> list[float]:
    try:
        return [float(word) for word in text.split(",")]
    except ValueError:
        raise ValueError(
            f"--tolerance {text}: a number, or several with commas, is valid"
        ) from None


@app.command()
def report(
    results: Annotated[Path, typer.Option(help="folder of the results")] = DEFAULT_RESULTS,
) -> None:
    """Write tables (CSV, Markdown, LaTeX), charts and an HTML page from results."""
    from strainbench.report import write_report  # pandas and matplotlib only where needed

    for path in write_report(results):
        console.print(f"wrote {path}", highlight=False)


@app.command()
def compare(
    first: Annotated[Path, typer.Argument(help="folder of results, A")],
    second: Annotated[Path, typer.Argument(help="folder of results, B")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="a .csv or .md file to write too")
    ] = None,
) -> None:
    """Compare two folders of results, cell by cell: ratios of times, changes in outcome."""
    from strainbench.report import compare as comparing  # pandas only where needed

    found = comparing.compare(first, second)
    if output is not None:
        comparing.write_comparison(found, output)
    for line in found.head():
        console.print(line, highlight=False, markup=False, soft_wrap=True)
    for table in found.tables():
        console.print(table)
    for line in [*found.foot(), *([f"wrote {output}"] if output else [])]:
        console.print(line, highlight=False, markup=False, soft_wrap=True)


@app.command()
def render(
    scenario: Annotated[str, typer.Argument(help="a scenario's name, or the path of a .py file")],
    solver: Annotated[str, typer.Option(help="name, or path of a .py file")] = "clarabel",
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", help="KEY=VALUE of the scenario or SOLVER.KEY=VALUE"),
    ] = None,
    steps: Annotated[int, typer.Option(help="time steps")] = 30,
    every: Annotated[int, typer.Option(help="keep each K-th step")] = 1,
    format_: Annotated[
        str, typer.Option("--format", help="of png, gif, mp4, obj, ply, vtu, with commas")
    ] = "png,gif",
    camera: Annotated[str, typer.Option(help="azimuth,elevation of the view, degrees")] = "30,32",
    scale: Annotated[
        str | None, typer.Option(help="strain at the colour scale's end, such as 5%; else fitted")
    ] = None,
    tolerance: Annotated[float, typer.Option(help="aimed at by the solver")] = 1e-6,
    output: Annotated[Path, typer.Option("-o", "--output", help="folder")] = DEFAULT_PICTURES,
) -> None:
    """Play a scene with one solver; write pictures, animations and mesh series."""
    from strainbench import render as pictures  # matplotlib and meshio only where needed

    top = None if scale is None else pictures.parse_scale(scale)
    view = pictures.parse_camera(camera)
    with _bar() as bar:
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
        console.print(line, highlight=False, markup=False, soft_wrap=True)


@app.command()
def polar(
    scenario: Annotated[str, typer.Argument(help="a scenario's name, or the path of a .py file")],
    solver: Annotated[
        str, typer.Option(help="name, comma-separated names, or a path")
    ] = "clarabel",
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", help="KEY=VALUE of the scenario or SOLVER.KEY=VALUE"),
    ] = None,
    steps: Annotated[int, typer.Option(help="time steps; the last one is drawn")] = 30,
    tolerance: Annotated[float, typer.Option(help="aimed at by every solver")] = 1e-6,
    output: Annotated[Path, typer.Option("-o", "--output", help="an .svg, .png or .pdf file")] = (
        DEFAULT_PICTURES / "polar.svg"
    ),
) -> None:
    """Draw the limits over the material angle, and the strains a scene ends with."""
    from strainbench.render.polar import polar as draw  # matplotlib only where needed

    with _bar() as bar:
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
        console.print(line, highlight=False, markup=False, soft_wrap=True)


@app.command()
def export(
    scenario: Annotated[str, typer.Argument(help="a scenario's name, or the path of a .py file")],
    frame: Annotated[int, typer.Option(help="which projection, the first being 1")],
    output: Annotated[Path, typer.Option("-o", "--output", help="the file to write")],
    format_: Annotated[
        str, typer.Option("--format", help="cbf or npz; by default what the file's name ends in")
    ] = "",
    solver: Annotated[
        str, typer.Option(help="answers the projections before; name, or path of a .py file")
    ] = REFERENCE_SOLVER,
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", help="KEY=VALUE of the scenario or SOLVER.KEY=VALUE"),
    ] = None,
    tolerance: Annotated[float, typer.Option(help="aimed at by the solver")] = 1e-6,
) -> None:
    """Write one projection of a scene as a conic instance (CBF) or as arrays (npz)."""
    kind = check_format(format_ or output.suffix.removeprefix("."))
    cell = plan_one(scenario, solver, set_ or [], max(frame, 1), tolerance)
    problem = _record(cell, frame)
    before = f"those before by {cell.solver.label}"
    about = f"{cell.scenario.label}, projection {frame}, {before}; strainbench {__version__}"
    write_problem(problem, output, kind, about)
    console.print(
        f"wrote {output}: {3 * len(problem.free)} variables, {problem.constraints} constraints",
        highlight=False,
        markup=False,
        soft_wrap=True,
    )


@app.command("converge")
def converge_(
    scenario: Annotated[str, typer.Argument(help="a scenario's name, or the path of a .py file")],
    frame: Annotated[int, typer.Option(help="which projection, the first being 1")],
    solver: Annotated[
        list[str] | None,
        typer.Option(help="name, comma-separated names, path of a .py file, or all (default)"),
    ] = None,
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", help="KEY=VALUE of the scenario, or SOLVER.KEY=V1,V2"),
    ] = None,
    tolerance: Annotated[float, typer.Option(help="the tightest that solvers aim at")] = 1e-8,
    time_limit: Annotated[float, typer.Option(help="seconds a solver, all its runs")] = 60.0,
    results: Annotated[Path, typer.Option(help="folder of the results")] = DEFAULT_CONVERGENCE,
) -> None:
    """Follow solvers on one projection of a scene: violation, gap and distance against time."""
    from strainbench.converge import converge  # pebble and the referee only where needed
    from strainbench.report.convergence import write_convergence

    cells = plan_scene(scenario, solver or ["all"], set_ or [], 1, tolerance, time_limit)
    problem = _record(recorder(cells[0]), frame)
    memory = 0.75 * psutil.virtual_memory().total / 1024**2
    with _bar() as bar:
        ended = converge(cells, problem, frame, results, memory)
        for cell, ending in bar.track(ended, len(cells), description="solvers"):
            bar.console.print(f"{cell.solver.label}: {ending}", highlight=False, markup=False)
    for path in write_convergence(results):
        console.print(f"wrote {path}", highlight=False)


def _record(cell: Cell, frame: int) -> Problem:
    """A projection of a scene, with a progress bar on the way there."""
    with _playing(cell, frame) as progress:
        return record(cell, frame, progress)


@contextmanager
def _playing(cell: Cell, frame: int) -> Iterator[Callable[[int], None]]:
    """What shows how many projections a scene has asked for, on its way to `frame`."""
    with _bar() as bar:
        task = bar.add_task(f"playing {cell.title}", total=max(frame - 1, 1))
        yield lambda asked: bar.update(task, completed=asked - 1)


@app.command("duel")
def duel_(
    scenario: Annotated[str, typer.Argument(help="a scenario's name, or the path of a .py file")],
    frame: Annotated[
        str, typer.Option(help="projections, the first being 1: 5,10 apart, 14-29 in sequence")
    ],
    solver: Annotated[
        list[str], typer.Option(help="name, comma-separated names, path of a .py file")
    ],
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", help="KEY=VALUE of the scenario, or SOLVER.KEY=V1,V2"),
    ] = None,
    repeats: Annotated[int, typer.Option(help="turns of each solver on each frame")] = 5,
    tolerance: Annotated[float, typer.Option(help="aimed at by every solver")] = 1e-6,
    time_limit: Annotated[float, typer.Option(help="seconds a projection")] = 60.0,
    units: Annotated[
        bool,
        typer.Option("--units", help="beside factorisation + solve, and a step of implicit Euler"),
    ] = False,
    results: Annotated[Path, typer.Option(help="folder that keeps the frames")] = DEFAULT_DUEL,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="a .csv or .md file to write too")
    ] = None,
) -> None:
    """Let solvers take turns on the same projections: ratios of times in one run."""
    from strainbench.duel import duel, parse_frames
    from strainbench.report.duel import Outcome, check_ending, write_outcome

    sequences = parse_frames(frame)
    last = max(numbers[-1] for numbers in sequences)
    if repeats < 1:
        raise ValueError(f"--repeats {repeats}: a whole number above 0 is valid")
    if output is not None:
        check_ending(output)
    cells = plan_scene(scenario, solver, set_ or [], 1, tolerance, time_limit)
    solvers = [cell.solver.solver() for cell in cells if not cell.solver.unavailable]
    for cell in cells:
        if cell.solver.unavailable:
            raise ValueError(cell.solver.unavailable)
    machine, about = describe_machine(threads=1)
    fed = recorder(cells[0])
    with fixed_threads(1), _playing(fed, last) as progress:
        if units:  # whose steps are to be timed now
            recording = record_all(fed, last, progress)
        else:
            recording = recorded(fed, last, results / "frames", progress)
    turns = repeats * sum(map(len, sequences)) * len(solvers)
    with _bar() as bar:
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
    title = f"{cells[0].scenario.label}, projections {frame}, tolerance {tolerance:g}"
    outcome = Outcome(title, shlex.join(["strainbench", *sys.argv[1:]]), {machine: about}, entries)
    Console(width=max(console.width, 200)).print(outcome.table())  # its columns are many
    if output is not None:
        write_outcome(outcome, output)
        console.print(f"wrote {output}", highlight=False, markup=False, soft_wrap=True)


@app.command()
def ledger(
    scenarios: Annotated[
        list[str] | None, typer.Argument(help="scenario names, or paths; by default all of ours")
    ] = None,
    solver: Annotated[str, typer.Option(help="name, or path of a .py file")] = "clarabel",
    set_: Annotated[
        list[str] | None, typer.Option("--set", help="KEY=VALUE of the scenarios")
    ] = None,
    steps: Annotated[int, typer.Option(help="time steps")] = 60,
    tolerance: Annotated[float, typer.Option(help="aimed at by the solver")] = 1e-6,
    results: Annotated[Path, typer.Option(help="folder of the table")] = DEFAULT_LEDGER,
) -> None:
    """Write what each scene models, and what each part of its physics changes in the answer."""
    from strainbench import ledger as accounts  # pandas only where it is needed

    names = scenarios or [entry.name for entry in list_scenarios()]
    cells = plan(names, [solver], set_ or [], "simulate", steps, [tolerance], None)
    with _bar() as bar:
        paths = accounts.write_ledger(
            cells,
            results,
            lambda items, what, total: bar.track(items, total, description=what),
        )
    for path in paths:
        console.print(f"wrote {path}", highlight=False, soft_wrap=True)


def _bar() -> Progress:
    """A progress bar with what is done and the time it takes."""
    return Progress(
        SpinnerColumn(),
        TextColumn("{task.description}", markup=False),
        BarColumn(bar_width=24),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("gone,"),
        TimeRemainingColumn(),
        TextColumn("left"),
        console=console,
    )


class Display(Observer):
    """A progress bar over all steps, with what is running, and a line for each ended cell."""

    def __init__(self) -> None:
        self.progress = Progress(
            SpinnerColumn(),
            TextColumn("{task.description}"),
            BarColumn(bar_width=24),
            MofNCompleteColumn(),
            TextColumn("steps,"),
            TimeElapsedColumn(),
            TextColumn("gone,"),
            TimeRemainingColumn(),
            TextColumn("left"),
            console=console,
        )
        self.running: dict[str, int] = {}
        self.done = 0

    def __enter__(self) -> Display:
        self.progress.start()
        self.task = self.progress.add_task("starting", total=None)
        return self

    def __exit__(self, *_: object) -> None:
        self.progress.stop()

    def planned(self, cells: Sequence[Cell], skipped: int) -> None:
        """See the base class."""
        if skipped:
            console.print(f"{skipped} cells finished before; --rerun runs them again")
        self.progress.update(self.task, total=sum(c.steps for c in cells))

    def started(self, cell: Cell) -> None:
        """See the base class."""
        self.running[cell.title] = 0
        self._show()

    def stepped(self, cell: Cell, steps: int) -> None:
        """See the base class."""
        self.running[cell.title] = steps
        self._show()

    def ended(self, cell: Cell, row: dict[str, object]) -> None:
        """See the base class."""
        self.running.pop(cell.title, None)
        self.done += cell.steps
        seconds = row.get("solve_seconds_mean", "")
        time = f"{float(str(seconds)):.4f} s a solve" if seconds != "" else "no solve"
        reason = f": {row['reason']}" if row["reason"] else ""
        console.print(f"{cell.title}: {time}, {row['outcome']}{reason}", highlight=False)
        self._show()

    def _show(self) -> None:
        completed = self.done + sum(self.running.values())
        what = " | ".join(self.running) or "the referee"
        self.progress.update(self.task, completed=completed, description=what)


def _print_summary(summary: Summary, planned: int, results: Path) -> None:
    if not summary.cells:
        console.print(f"nothing to run: all {planned} cells have finished; results in {results}")
        return
    console.print(
        f"{summary.cells} cells in {summary.wall:.1f} s: solvers and physics {summary.play:.1f} s, "
        f"processes' start {summary.start:.1f} s, suite overhead {100 * summary.overhead:.1f}% "
        f"of the wall time; the referee worked {summary.judging:.1f} s while processes started",
        highlight=False,
    )
    console.print(f"results in {results}", highlight=False)


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
        errors.print(f"strainbench: note: {message}", markup=False)
    else:
        text = warnings.formatwarning(message, category, filename, lineno, line)
        errors.print(text, markup=False)


def main() -> None:
    """Run the command line; exit 2 with one line for a wrong word, 130 when interrupted."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("always", SceneWarning)
            warnings.showwarning = _show_warning
            status = app(standalone_mode=False)
    except typer.TyperException as error:
        message = getattr(error, "format_message", error.__str__)()
        errors.print(f"strainbench: {message} (strainbench --help lists what is valid)")
        sys.exit(2)
    except (ValueError, RecordsError) as error:
        errors.print(f"strainbench: {error}", markup=False)
        sys.exit(2)
    if status == INTERRUPTED:  # typer has turned KeyboardInterrupt into it
        errors.print("strainbench: interrupted; every finished cell is kept, run again to resume")
    sys.exit(status or 0)
