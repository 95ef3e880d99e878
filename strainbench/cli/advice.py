"""The verb that answers from records: recommend."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from strainbench.cli.display import console, say
from strainbench.cli.options import (
    LOCAL,
    Accuracy,
    AllSolvers,
    Budget,
    Folders,
    ManyValues,
    Measure,
    OneScenario,
    Per,
    TableFile,
)
from strainbench.cli.run import run_here

if TYPE_CHECKING:
    from strainbench.report.advice import Advice
    from strainbench.report.missing import Missing
    from strainbench.report.question import Question

NOTHING = 3
"""The exit status where nothing measured meets both."""


def recommend(
    scenario: OneScenario,
    to: Accuracy,
    within: Budget,
    set_: ManyValues = None,
    solver: AllSolvers = None,
    per: Per = "projection",
    results: Folders = None,
    measure: Measure = False,
    output: TableFile = None,
) -> None:
    """Say which methods reach an accuracy within a time; exit status 3 where none does."""
    from strainbench.report.question import Question

    question = Question.read(to, within, per)
    if output is not None:
        from strainbench.report.output import check_ending

        check_ending(output)
    found = _advise(question, scenario, set_, solver, results)
    if measure and any(advice.missing for advice in found):
        for advice in found:
            if advice.missing:
                _measure(advice.missing)
        found = _advise(question, scenario, set_, solver, results)
    for advice in found:
        _show(advice)
    if output is not None:
        _write(output, found)
    if not all(advice.found for advice in found):
        raise typer.Exit(NOTHING)


def _advise(
    question: Question,
    scenario: str,
    set_: list[str] | None,
    solver: list[str] | None,
    results: list[Path] | None,
) -> list[Advice]:
    """An answer for each scene that the words give."""
    from strainbench.bench.plan import plan_scenarios, split_names
    from strainbench.bench.settings import parse_settings
    from strainbench.report.advice import advise
    from strainbench.report.candidate import Records

    chosen = parse_settings(set_ or [])
    scenes = plan_scenarios([scenario], chosen)
    for owner in chosen.keys() - {"", *(scene.name for scene in scenes)}:
        raise ValueError(f"--set {owner}.…: settings of {scenes[0].name} alone are valid")
    names = split_names(solver) if solver and "all" not in solver else None
    records = Records.of(results or [LOCAL / "run"])
    return [advise(question, scenario, scene, chosen, records, names) for scene in scenes]


def _measure(missing: Missing) -> None:
    """Run what its command would."""
    from strainbench.bench.machine import memory_share
    from strainbench.bench.plan import plan
    from strainbench.bench.runner import Settings

    m = missing
    cells = plan(
        [m.scenario],
        m.solvers,
        m.settings,
        m.mode,
        m.steps,
        [m.tolerance],
        m.time_limit,
        threads=m.threads,
        repeats=m.repeats,
    )
    run_here(cells, Settings(Path(m.folder), 1, memory_share()))


def _show(advice: Advice) -> None:
    from strainbench.document.writers import terminal
    from strainbench.report.advice import ABOUT

    for line in advice.head():
        say(line)
    if advice.candidates:
        console.print(terminal(advice.table()))
        say(" ".join(ABOUT.split()))
    for line in advice.foot():
        say(line)


def _write(output: Path, found: list[Advice]) -> None:
    """All answers in one file."""
    from strainbench.document import Document
    from strainbench.report.output import write_output

    lines = [line for advice in found for line in advice.cells().lines]
    cells = replace(found[0].cells(), lines=lines)
    write_output(output, Document("What was measured says", [a.document() for a in found]), cells)
    say(f"wrote {output}")
