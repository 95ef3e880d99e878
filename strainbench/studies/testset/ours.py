"""The test set of the suite: which projections, by name."""

from __future__ import annotations

import csv
from importlib.resources import files

from strainbench.bench.plan import plan_one
from strainbench.studies.testset.collection import Wanted

SMALL = 6000  # variables, of `--small`
TITLE = "A test set of projections onto strain limits"


def our_set(small: bool) -> list[Wanted]:
    """All instances of `ours.csv`, or those of up to SMALL variables."""
    text = (files(__package__) / "ours.csv").read_text(encoding="utf-8")
    wanted = []
    for line in csv.DictReader(text.splitlines()):
        words = line["settings"].split()
        cell = plan_one(line["scene"], "newton-ipm", words, int(line["frame"]), 1e-6)
        if not small or 3 * len(cell.scenario.scenario().problem().free) <= SMALL:
            wanted.append(Wanted(line["name"], cell, int(line["frame"])))
    return wanted
