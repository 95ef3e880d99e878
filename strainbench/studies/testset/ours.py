"""The test set of the suite: which projections, by name."""

from __future__ import annotations

import csv
from importlib.resources import files

from strainbench.bench.cell import Cell
from strainbench.bench.plan import plan_one
from strainbench.referee.reference import REFERENCE_SOLVER
from strainbench.studies.testset.collection import Wanted

SMALL = 6000  # variables, of `--small`
TITLE = "A test set of projections onto strain limits"


def our_set(small: bool) -> list[Wanted]:
    """All instances of `ours.csv`, or those of up to SMALL variables."""
    text = (files(__package__) / "ours.csv").read_text(encoding="utf-8")
    return [
        Wanted(line["name"], _cell(line), int(line["frame"]))
        for line in csv.DictReader(text.splitlines())
        if not small or int(line["variables"]) <= SMALL
    ]


def _cell(line: dict[str, str]) -> Cell:
    words = line["settings"].split()
    return plan_one(line["scene"], REFERENCE_SOLVER, words, int(line["frame"]), 1e-6)
