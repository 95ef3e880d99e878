"""The options of the verbs, each declared once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from strainbench.options import MOST, number, path, whole

DEFAULT_SOLVER = "clarabel"
RECORDER = "newton-ipm"  # the referee's, whose modules take long to import; a test compares
MOST_THREADS = 1024
LOCAL = Path("results/local")


def _whole(name: str, about: str, most: int = MOST, metavar: str = "N") -> Any:
    return typer.Option(name, parser=whole(name, most), metavar=metavar, help=about)


def _number(name: str, about: str, of: str = "", metavar: str = "X") -> Any:
    return typer.Option(name, parser=number(name, of), metavar=metavar, help=about)


def _seconds(name: str, about: str) -> Any:
    return _number(name, about, " of seconds", "SECONDS")


def _folder(about: str) -> Any:
    return typer.Option("--results", parser=path("--results"), metavar="DIR", help=about)


def _output(about: str, what: str = "a folder", metavar: str = "FILE") -> Any:
    return typer.Option("-o", "--output", parser=path("-o", what), metavar=metavar, help=about)


# scenes
Scenarios = Annotated[list[str], typer.Argument(help="scenario names, or paths of .py files")]
AnyScenarios = Annotated[
    list[str] | None, typer.Argument(help="scenario names, or paths; by default all of ours")
]
OneScenario = Annotated[str, typer.Argument(help="a scenario's name, or the path of a .py file")]
Steps = Annotated[int, _whole("--steps", "time steps")]
StepsOrAll = Annotated[
    int | None, _whole("--steps", "time steps a cell; if not given, what the scene takes")
]
MapSteps = Annotated[
    int | None,
    _whole("--steps", "time steps a cell; if not given, 40, or 2 s of the scene if that is longer"),
]
StepsToLast = Annotated[int, _whole("--steps", "time steps; the last one is drawn")]
Every = Annotated[int, _whole("--every", "keep each K-th step", metavar="K")]
SomeSteps = Annotated[
    int | None, _whole("--every", "of several projections each K-th, into a folder", metavar="K")
]
Duration = Annotated[
    float | None, _seconds("--duration", "of the scene's time a cell, instead of --steps")
]
ComparedSeconds = Annotated[float, _seconds("--duration", "of the scene's time a cell")]
FrameNumber = Annotated[int, _whole("--frame", "which projection, the first being 1", metavar="K")]
FrameNumbers = Annotated[
    str,
    typer.Option("--frame", help="projections, the first being 1: 5,10 apart, 14-29 in sequence"),
]

# solvers
AllSolvers = Annotated[
    list[str] | None,
    typer.Option(
        "--solver", help="name, comma-separated names, path of a .py file, or all (default)"
    ),
]
Solvers = Annotated[
    list[str],
    typer.Option("--solver", help="name, comma-separated names, path of a .py file"),
]
SomeSolvers = Annotated[
    str, typer.Option("--solver", help="name, comma-separated names, or a path")
]
OneSolver = Annotated[str, typer.Option("--solver", help="name, or path of a .py file")]
CheckedSolver = Annotated[
    str, typer.Argument(metavar="SOLVER", help="name, comma-separated names, path of a .py file")
]
Optimal = Annotated[
    bool, typer.Option("--optimal", help="it promises the projection itself, not limits alone")
]
SolverBefore = Annotated[
    str,
    typer.Option("--solver", help="answers the projections before; name, or path of a .py file"),
]
Tolerance = Annotated[float, _number("--tolerance", "aimed at by every solver")]
TightestTolerance = Annotated[float, _number("--tolerance", "the tightest that solvers aim at")]
Tolerances = Annotated[
    str, typer.Option("--tolerance", help="aimed at by every solver; 1e-3,1e-6 for two")
]
Start = Annotated[
    str,
    typer.Option(
        "--start", help="cold, warm (from the frame before, where a solver can) or cold,warm"
    ),
]

# settings of both
ManyValues = Annotated[
    list[str] | None,
    typer.Option("--set", help="KEY=V1,V2 of the scenario, or SOLVER.KEY=V1,V2"),
]
Values = Annotated[
    list[str] | None,
    typer.Option("--set", help="KEY=VALUE of the scenario or SOLVER.KEY=VALUE"),
]
ScenariosValues = Annotated[
    list[str] | None, typer.Option("--set", help="KEY=VALUE of the scenarios")
]
SolversValues = Annotated[
    list[str] | None,
    typer.Option("--set", help="KEY=VALUE of the scenario, or SOLVER.KEY=V1,V2"),
]

Enough = Annotated[
    bool,
    typer.Option("--enough", help="of one scene: directions, mesh and step that are enough"),
]

# how to run
Mode = Annotated[str, typer.Option("--mode", help="simulate (closed loop) or replay (same frames)")]
Frames = Annotated[
    str | None,
    typer.Option("--frames", metavar="A-B", help="with --mode replay, the steps that are fed"),
]
CellSeconds = Annotated[
    float | None, _seconds("--time-limit", "a cell, physics and solver; none by default")
]
SolverSeconds = Annotated[float, _seconds("--time-limit", "a solver, all its runs")]
ProjectionSeconds = Annotated[float, _seconds("--time-limit", "a projection")]
Memory = Annotated[
    float | None,
    _number("--memory-limit", "a cell; by default 3/4 of the machine's, shared", " of MB", "MB"),
]
Jobs = Annotated[int, _whole("--jobs", "cells at a time; with more than one, times are disturbed")]
Threads = Annotated[int, _whole("--threads", "threads a solver", MOST_THREADS)]
Repeats = Annotated[int, _whole("--repeats", "turns of each solver on each frame")]
Timings = Annotated[
    int, _whole("--repeats", "times that each projection is timed; the first answer counts", 1000)
]
Units = Annotated[
    bool,
    typer.Option("--units", help="beside factorisation + solve, and a step of implicit Euler"),
]
Checkout = Annotated[
    Path | None,
    typer.Option(
        "--against",
        parser=path("--against"),
        metavar="DIR",
        help="another checkout of strainbench, such as a git worktree: race its solvers too",
    ),
]
Scheduler = Annotated[
    str | None,
    typer.Option("--scheduler", help="address of a dask scheduler whose workers run the cells"),
]
Processes = Annotated[
    str,
    typer.Option(
        "--processes",
        help="fork (cells, where the system can, from one that has loaded what they need) or spawn",
    ),
]
Debug = Annotated[
    bool,
    typer.Option("--debug", help="stop at the first cell that fails; show where, and its prints"),
]
Rerun = Annotated[bool, typer.Option("--rerun", help="run finished cells again")]

# what is reported
Paper = Annotated[
    bool,
    typer.Option("--paper", help="only what an article takes, into paper/: tables, figures as PDF"),
]
Methods = Annotated[
    str | None, typer.Option("--methods", help="of the paper's tables, a,b; all by default")
]
Columns = Annotated[
    str | None,
    typer.Option(
        "--columns", help="of the paper's tables, of seconds,mean,violation,gap,mm [seconds,mm]"
    ),
]

# what is asked of records
Accuracy = Annotated[
    str, typer.Option("--to", help="accuracy wanted, such as 0.1mm, 1e-4gap or 1e-6violation")
]
Budget = Annotated[str, typer.Option("--within", help="time there is, such as 20ms")]
Per = Annotated[str, typer.Option("--per", help="what the time is for: projection or step")]
Folders = Annotated[
    list[Path] | None,
    typer.Option(
        "--results",
        parser=path("--results"),
        metavar="DIR",
        help="folder of results; more than one where repeated",
    ),
]
Measure = Annotated[bool, typer.Option("--measure", help="measure first what is not there yet")]

AuditFolder = Annotated[Path, _folder("folder with the folders of results")]
MeasureClaims = Annotated[
    bool, typer.Option("--measure", help="first run what has no rows there yet; hours, resumes")
]

FailOn = Annotated[
    list[str] | None,
    typer.Option(
        "--fail-on",
        metavar="WHAT",
        help="exit with status 1 on: outcome (worse), ratio>1.1 (B slower, its interval too)",
    ),
]

# where it goes, and how it looks
Folder = Annotated[Path, _folder("folder of the results")]
FramesFolder = Annotated[Path, _folder("folder that keeps the frames")]
TableFile = Annotated[Path | None, _output("a .csv or .md file to write too", "a .csv or .md file")]
PicturesFolder = Annotated[Path, _output("folder", metavar="DIR")]
ChartFile = Annotated[Path, _output("an .svg, .png or .pdf file", "an .svg, .png or .pdf file")]
ProblemPlace = Annotated[
    Path, _output("the file to write; of several projections, the folder", "a file or folder")
]
TestSetFolder = Annotated[
    Path, typer.Argument(parser=path("DIR"), metavar="DIR", help="folder of the instances")
]
Small = Annotated[
    bool, typer.Option("--small", help="those of up to 6,000 variables alone; minutes")
]
Scaled = Annotated[
    bool,
    typer.Option("--scaled", help="CBF in units that solvers' defaults cope with; it says which"),
]
SomeFrames = Annotated[
    str,
    typer.Option("--frame", help="projection, the first being 1; 5,10 or 1-30 for several"),
]
ProblemFormat = Annotated[
    str | None,
    typer.Option("--format", help="cbf or npz; by default what the file's name ends in, or both"),
]
PictureFormats = Annotated[
    str, typer.Option("--format", help="of png, gif, mp4, obj, ply, vtu, with commas")
]
View = Annotated[str, typer.Option("--camera", help="azimuth,elevation of the view, degrees")]
Scale = Annotated[
    str | None,
    typer.Option("--scale", help="strain at the colour scale's end, such as 5%; else fitted"),
]
