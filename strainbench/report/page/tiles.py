"""Four tiles below the headline: what was found besides who is first, and what was not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

from strainbench.report.failures import PASSED
from strainbench.report.measures import FEASIBLE, OPTIMAL, duration, length
from strainbench.report.page.races import Race, races
from strainbench.report.page.words import capital, count, listed

BUSY = 0.5  # other work a core: from here on times say little
PLACES = 3


@dataclass(frozen=True)
class Tile:
    """A head, what is said, and the section that it leads to."""

    head: str
    text: str
    section: str


def tiles(runs: pd.DataFrame, steps: pd.DataFrame, failed: pd.DataFrame) -> list[Tile]:
    """Those that there is anything to say in.

    Parameters
    ----------
    runs : with `scene` and what `measured` adds
    steps : with numbers as numbers
    failed : as `strainbench.report.failures.failures` has it
    """
    found = races(runs)
    texts = {
        ("Exact and fast", "table"): exact(found),
        ("Admissible is not optimal", "speed"): admissible(found),
        ("What breaks", "failures"): breaks(failed),
        ("What this cannot say", "protocol"): unsaid(runs, steps),
    }
    return [Tile(head, text, section) for (head, section), text in texts.items() if text]


def exact(found: Sequence[Race]) -> str:
    """How many reach the optimum on every step on each case, who on the last."""
    if not found:
        return ""
    if len(found) > PLACES:
        return _often(found)
    solved = [(list(race.ranked["solver"]), race) for race in found]
    shares = [
        f"{count(len(names))} of {len(race.rows)} methods at {race.place}" for names, race in solved
    ]
    names, last = solved[-1]
    limit = last.rows["time_limit"].max()
    within = f", within {duration(limit)} a cell" if limit == limit else ""
    at = f" At {last.place}: {listed(names)}." if names else ""
    return f"The optimum on every step: {listed(shares)}{within}.{at}"


def _often(found: Sequence[Race]) -> str:
    """Who reaches it on most of many cases."""
    rows = pd.concat([race.rows for race in found])
    solved = (rows["ending"] == OPTIMAL).groupby(rows["solver"], sort=False).sum()
    most, total = int(solved.max()), count(len(found))
    if not most:
        return f"None of {len(solved)} methods reaches the optimum on any of {total} cases."
    names = [str(name) for name in solved.index[solved == most]]
    often = f"all {total} cases" if most == len(found) else f"{count(most)} of {total} cases"
    return f"The optimum on every step of {often}: {listed(names)}."


def admissible(found: Sequence[Race]) -> str:
    """Who keeps the limits and stops short of the projection, and how far."""
    kept = [(race, race.rows[race.rows["ending"] == FEASIBLE]) for race in found]
    kept = [(race, rows) for race, rows in kept if rows["distance_max"].notna().any()]
    if not kept:
        return ""
    race, rows = max(kept, key=lambda pair: len(pair[1]))
    far = 1000 * rows["distance_max"]
    names = list(rows.sort_values("distance_max")["solver"].unique())
    span = " to ".join(dict.fromkeys((length(far.min()), length(far.max()))))
    verb = "keeps the limits but stops" if len(names) == 1 else "keep the limits but stop"
    return (
        f"{capital(count(len(names)))} {verb} {span} from the projection at {race.place}: "
        f"{listed(names)}."
    )


def breaks(failed: pd.DataFrame) -> str:
    """Who passes all hard cases, and the case that breaks most."""
    if failed.empty:
        return ""
    passed = failed.assign(passed=failed["sign"] == PASSED)
    always = passed.groupby("method", sort=False)["passed"].all()
    names, cases = list(always.index[always]), failed["case"].nunique()
    verb = "passes" if len(names) == 1 else "pass"
    who = f": {listed(names)}" if names else ""
    worst = passed[failed["sign"] == "✗"].groupby("case", sort=False).size()
    most = (
        f" Most break on {worst.idxmax()}: {count(int(worst.max()))} of them." if len(worst) else ""
    )
    return (
        f"{capital(count(len(names)))} of {len(always)} {verb} all {count(cases)} hard cases{who}."
        f"{most}"
    )


def unsaid(runs: pd.DataFrame, steps: pd.DataFrame) -> str:
    """What was not run, or is not known well."""
    meshes = list(dict.fromkeys(runs["mesh"]))
    limits = [name for name in dict.fromkeys(runs["bound"]) if name]
    said = []
    if len(meshes) <= PLACES:
        said.append(f"Measured at {listed(meshes)} alone; other sizes are not known.")
    if len(limits) == 1:
        said.append(f"Only the limit of {limits[0]} was run.")
    repeats = _largest(runs, "repeats")
    if repeats <= 1:
        said.append("Each projection was timed once: bars are over frames, not over repeats.")
    if (load := _largest(runs, "load")) > BUSY:
        said.append(f"Other work on the machine: up to {load:.1f} a core.")
    if "contact" in " ".join(runs["needs"].fillna("")) and not (steps["contact_energy"] > 0).any():
        said.append("Contact was never reached.")
    return " ".join(said)


def _largest(runs: pd.DataFrame, column: str) -> float:
    """0 where it was not recorded."""
    if column not in runs or not runs[column].notna().any():
        return 0.0
    return float(pd.to_numeric(runs[column]).max())
