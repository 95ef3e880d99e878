"""The verbs for whoever writes a solver: check, profile."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING

import typer

from strainbench.cli.display import console, playing, progress, say, tracking
from strainbench.cli.options import (
    CheckedSolver,
    FrameNumber,
    OneScenario,
    OneSolver,
    Optimal,
    ProjectionSeconds,
    Repeats,
    Tolerance,
    Values,
)

if TYPE_CHECKING:
    from strainbench.bench.cell import PluginRef
    from strainbench.studies.contract import Promise

MARKS = {"kept": "\u2713", "broken": "\u2717", "not checked": "-"}
WORDS = {"kept": "ok", "broken": "BROKEN", "not checked": "-"}
"""Where a terminal has ASCII alone."""


def check_solvers(solver: CheckedSolver, optimal: Optimal = False) -> None:
    """Hold a solver to the contract that all of ours keep; exit status 1 if something is broken."""
    from strainbench.bench.plan import plan_solvers
    from strainbench.studies.contract import CLAUSES

    refs = plan_solvers([solver], {}, ("cold",))
    for ref in refs:
        if ref.unavailable:
            raise ValueError(ref.unavailable)
    with progress("clauses,") as bar:
        task = bar.add_task("checking", total=len(refs) * len(CLAUSES))
        broken = sum(_checked(ref, optimal, lambda: bar.advance(task)) for ref in refs)
    if broken:
        raise typer.Exit(1)


def _promise(ref: PluginRef, optimal: bool) -> Promise:
    """What a solver is held to: ours to what we know of them."""
    from dataclasses import replace

    from strainbench.studies.contract import EACH, OPTIMAL, Promise, promise_of

    promise = Promise() if ref.path else promise_of(ref.solver())
    return replace(OPTIMAL if optimal else promise, time_limit=EACH)


def _checked(ref: PluginRef, optimal: bool, advance: Callable[[], None]) -> int:
    """Show what became of each clause, and of all; how many are broken."""
    from strainbench.studies.contract import Verdict, check

    begin, promise = time.monotonic(), _promise(ref, optimal)
    marks = MARKS if console.encoding.lower().startswith("utf") else WORDS
    counts = dict.fromkeys(Verdict, 0)
    say(f"{ref.label}, held to: {promise.aim}")
    for found in check(ref.solver(), promise, ref.path or ""):
        say(f"{marks[found.verdict]} {found.clause}: {found.words}")
        counts[found.verdict] += 1
        advance()
    total = ", ".join(f"{count} {verdict}" for verdict, count in counts.items())
    say(f"{ref.label}: {total}; {time.monotonic() - begin:.1f} s")
    return counts[Verdict.BROKEN]


def profile_solver(
    scenario: OneScenario,
    frame: FrameNumber,
    solver: OneSolver,
    set_: Values = None,
    repeats: Repeats = 5,
    tolerance: Tolerance = 1e-6,
    time_limit: ProjectionSeconds = 60.0,
) -> None:
    """Where a solver's time goes on one projection: its named sections, in factorisations."""
    from strainbench.bench.plan import plan_one
    from strainbench.bench.recording import record_all, recorder
    from strainbench.document.writers import terminal
    from strainbench.studies.profile import profile

    cell = plan_one(scenario, solver, set_ or [], frame, tolerance)
    fed = recorder(cell)
    with playing(fed, frame) as asked:
        recording = record_all(fed, frame, asked)
    with tracking() as track:
        found = profile(
            cell.solver.solver(), recording, frame, repeats, tolerance, time_limit, track
        )
    title = f"{cell.solver.label}: {cell.scenario.label}, projection {frame}"
    console.print(terminal(found.table(f"{title}, tolerance {tolerance:g}")))
