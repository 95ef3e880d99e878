"""The sentence at the top: who reaches the optimum first, by how much."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import pandas as pd

from strainbench.document import Strong
from strainbench.report.measures import COUNT, FEASIBLE, OPTIMAL, VIOLATED, digits, duration, length
from strainbench.report.page.races import Race, races
from strainbench.report.page.words import capital, count, listed

MOST = 3  # cases that have a clause each
EVERY = "on every step"
Sentence = list[str]
"""Pieces; names of methods are `Strong`."""


def headline(runs: pd.DataFrame) -> Sentence:
    """From rows with `scene` and what `measured` adds."""
    found = races(runs)
    if not found:
        return ["No method was run, but for implicit Euler alone."]
    solvers = list(dict.fromkeys(name for race in found for name in race.rows["solver"]))
    if len(solvers) == 1:
        return [Strong(solvers[0]), _alone(found)]
    solved = [race for race in found if len(race.ranked)]
    if not solved:
        return _nobody(runs, found)
    unsolved = [race.place for race in found if not len(race.ranked)]
    if len(found) > MOST:
        return _counted(solved, len(unsolved))
    rest = [[f"no method does at {listed(unsolved)}"]] if unsolved else []
    leaders = {(*race.first, "", race.next[0]) for race in solved}
    if len(leaders) == 1 and len(solved[0].ranked) > 1:
        return _joined([_same(solved), *rest])
    return _joined([*map(_clause, solved), *rest])


def _same(solved: Sequence[Race]) -> Sentence:
    """The same method first, and the same next, everywhere; or the same that are level."""
    first, (follower, _) = solved[0].first, solved[0].next
    if len(first) > 1:
        times = [f"{listed(_times(race))} a projection at {race.place}" for race in solved]
        return [Strong(listed(first)), f" are level: {', '.join(times)}"]
    times = [f"{_times(race)[0]} at {race.place}" for race in solved]
    times[0] = times[0].replace(" at ", " a projection at ", 1)
    ratios = listed([digits(race.next[1]) for race in solved])
    after = f"{ratios} times sooner than {follower}, the next"
    return [Strong(first[0]), f" reaches the optimum first: {listed(times)}, {after}"]


def _times(race: Race) -> list[str]:
    """Of those that are first, in their order."""
    return [duration(time) for time in race.ranked["time"][: len(race.first)]]


def _clause(race: Race) -> Sentence:
    """What happened on one case among others."""
    first, (follower, ratio) = race.first, race.next
    name, time = Strong(listed(first)), listed(_times(race))
    if len(first) > 1:
        return [f"at {race.place} ", name, f" are level, {time} a projection"]
    if not follower:
        return [f"at {race.place} ", name, f" alone reaches the optimum, {time} a projection"]
    after = f"{digits(ratio)} times sooner than {follower}"
    return [f"at {race.place} ", name, f" reaches the optimum first, {time} a projection, {after}"]


def _counted(solved: Sequence[Race], unsolved: int) -> Sentence:
    """Of many cases, in how many each is first."""
    total = len(solved) + unsolved
    alone = [race for race in solved if len(race.first) == 1]
    wins = Counter(race.first[0] for race in alone).most_common()
    clauses: list[Sentence] = [[Strong(name), f" in {count(times)}"] for name, times in wins[1:]]
    if wins:
        name, most = wins[0]
        ratios = [r.next[1] for r in alone if r.first == [name] and r.next[0]]
        span = dict.fromkeys((digits(min(ratios)), digits(max(ratios)))) if ratios else {}
        after = f", {' to '.join(span)} times sooner than the next" if span else ""
        part = f"all {count(total)}" if most == total else f"{count(most)} of {count(total)}"
        begins = f" reaches the optimum first in {part} cases{after}"
        clauses = [[Strong(name), begins], *clauses]
    if level := len(solved) - len(alone):
        clauses.append([f"in {count(level)} the first are level"])
    if unsolved:
        clauses.append([f"in {count(unsolved)} no method reaches it {EVERY}"])
    return _joined(clauses)


def _joined(clauses: Sequence[Sentence]) -> Sentence:
    """One sentence of them."""
    first, *rest = [piece for clause in clauses for piece in ("; ", *clause)][1:]
    return [first if isinstance(first, Strong) else capital(first), *rest, "."]


def _nobody(runs: pd.DataFrame, found: Sequence[Race]) -> Sentence:
    """No case was solved to the optimum in every step, or nothing had to be."""
    if (runs["ending"] == OPTIMAL).any():
        return ["No limit was reached: no projection had anything to do."]
    near = [(race.nearest, race.place) for race in found if race.nearest is not None]
    if not near:
        return [f"No method keeps the limits {EVERY}."]
    row, place = min(near, key=lambda pair: float(pair[0]["distance_max"]))
    distance = f", {length(1000 * row['distance_max'])} from it at {place}."
    return [f"No method reaches the optimum {EVERY}; nearest is ", Strong(row["solver"]), distance]


SAID = {
    OPTIMAL: f"reaches the optimum {EVERY}",
    FEASIBLE: "keeps the limits, short of the optimum",
    VIOLATED: "violates the limits",
}


def _alone(found: Sequence[Race]) -> str:
    """What the only method did."""
    said: dict[str, list[str]] = {}
    for race in found:
        row = race.rows.iloc[0]
        known = row["ending"] in COUNT and row["time"] == row["time"]
        time = f"{duration(row['time'])} a projection at " if known else "at "
        what = SAID.get(row["ending"], f"gives no answer to the end ({row['why']})")
        said.setdefault(what, []).append(f"{time}{race.place}")
    where = {what: _where(places, len(found)) for what, places in said.items()}
    return f" {'; '.join(f'{what}: {places}' for what, places in where.items())}."


def _where(places: Sequence[str], total: int) -> str:
    """The places themselves, or how many they are."""
    if total <= MOST:
        return listed(places)
    return f"in all {total} cases" if len(places) == total else f"in {len(places)} of {total} cases"
