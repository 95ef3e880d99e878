"""Options that several verbs share, each declared once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from strainbench.options import number, path, whole

OneScenario = Annotated[str, typer.Argument(help="a scenario's name, or the path of a .py file")]
AllSolvers = Annotated[
    list[str] | None,
    typer.Option(
        "--solver", help="name, comma-separated names, path of a .py file, or all (default)"
    ),
]
Values = Annotated[
    list[str] | None,
    typer.Option("--set", help="KEY=VALUE of the scenario or SOLVER.KEY=VALUE"),
]
SolversValues = Annotated[
    list[str] | None,
    typer.Option("--set", help="KEY=VALUE of the scenario, or SOLVER.KEY=V1,V2"),
]
TableFile = Annotated[
    Path | None,
    typer.Option(
        "-o",
        "--output",
        parser=path("-o", "a .csv or .md file"),
        metavar="FILE",
        help="a .csv or .md file to write too",
    ),
]
Folder = Annotated[
    Path,
    typer.Option(
        "--results", parser=path("--results"), metavar="DIR", help="folder of the results"
    ),
]
Tolerance = Annotated[
    float,
    typer.Option(
        "--tolerance", parser=number("--tolerance"), metavar="X", help="aimed at by every solver"
    ),
]
Steps = Annotated[
    int, typer.Option("--steps", parser=whole("--steps"), metavar="N", help="time steps")
]
FrameNumber = Annotated[
    int,
    typer.Option(
        "--frame",
        parser=whole("--frame"),
        metavar="K",
        help="which projection, the first being 1",
    ),
]
