"""Which rows of a results folder are shown: those of the code as it is now; what is said of others.

Rows are about the same thing if scene, solver, settings and the files that they come from are the
same. Of these the newest one is shown whose sources give what they give now, see
`strainbench.report.history`; where there is none, the newest, which is then said to be older. The
others stay in runs.csv.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path

from strainbench.bench.cell import content_of
from strainbench.bench.machine import installed
from strainbench.bench.records import Row, latest_runs, read_machines
from strainbench.report.history import ENDED, alike
from strainbench.report.provenance import suite_files
from strainbench.sources import ROOT, SUITE, closure, plugin_files, suite_digest

NOT_INSTALLED = "not installed"
PLUGINS = ("scenario", "solver")
SAME = (
    *("scenario", "resolution", "limit", "scenario_parameters", "solver_parameters"),
    *("mode", "steps_asked", "tolerance"),
)
UNKNOWN = "by another version of strainbench"


def shown_runs(folder: Path) -> list[Row]:
    """The rows to show, with what is older about them in `older`, and names that tell them apart.

    Raises
    ------
    RecordsError
        If the records are damaged.
    """
    machines, now = read_machines(folder), cache(content_of)  # once for all rows that ask alike
    changes = {name: changed_packages(facts) for name, facts in machines.items()}
    kept: dict[tuple[str, ...], Row] = {}
    for row in latest_runs(folder).values():
        row = row | {"older": _older_source(row, folder, now)}
        before = kept.get(_subject(row))
        if before is None or before["older"] or not row["older"]:
            kept[_subject(row)] = row
    for row in kept.values():
        name = row["machine"]
        row["older"] = row["older"] or _older_suite(row) or changes.get(name, "")
        threads = machines.get(name, {}).get("threads_per_solver", 1)
        row["threads"] = row["threads"] or str(threads)
        row["repeats"] = row["repeats"] or "1"
    rows = list(kept.values())
    for name in ("solver", "scenario"):
        _tell_apart(rows, name)
    return rows


def _subject(row: Row) -> tuple[str, ...]:
    """What a row is about, whatever its source was."""
    method = row["solver"].partition("[")[0]  # what follows are settings
    files = (_outside(row[f"{name}_source"]) for name in PLUGINS)
    return (method, *files, row["threads"] or "1", *(row[name] for name in SAME))


def _outside(source: str) -> str:
    """The path of a plug-in from outside, nothing for one of ours."""
    return source if os.path.isabs(source) else ""


def _older_suite(row: Row) -> str:
    """Whether the suite that a row was measured with may give other numbers now."""
    if row["suite"] == suite_digest():  # history need not be asked
        return ""
    known = alike(suite_files(), watched=row["failure"] in ENDED)
    return "" if row["suite"] in known else UNKNOWN


def _older_source(row: Row, folder: Path, now: Callable[[str, tuple[str, ...]], str]) -> str:
    """How the sources differ from those that a row was measured with.

    Parameters
    ----------
    folder : of the rows; a plug-in from another machine is looked for there, by its name
    now : the digest of a source and of the files that words name, as they are
    """
    if not row["content"]:
        return UNKNOWN
    for name, content in zip(PLUGINS, row["content"].split(" "), strict=True):
        source = row[f"{name}_source"]
        if not source:  # of a solver that is unavailable
            continue
        places = [source, *[str(folder.resolve() / Path(source).name)] * bool(_outside(source))]
        here = next((place for place in places if (ROOT / place).exists()), None)
        if here is None:
            return f"with {source}, which is gone"
        settings = json.loads(row[f"{name}_parameters"] or "{}").values()
        if now(here, tuple(v for v in settings if isinstance(v, str))) == content:
            continue
        own = tuple(closure(*plugin_files(here), suite=False))
        if _outside(source) or content not in alike(own, watched=False):
            return f"with {source} before its latest edit"
    return ""


def changed_packages(facts: Mapping[str, object]) -> str:
    """How a machine's packages differ from those installed; ours is known by its sources.

    What is installed in one of the two places alone makes nothing older.
    """
    packages = facts.get("packages")
    if not isinstance(packages, Mapping):
        return ""
    now = installed(packages)
    both = [n for n in packages if n != SUITE.name and NOT_INSTALLED not in (packages[n], now[n])]
    changed = [f"{n} {packages[n]} (now {now[n]})" for n in both if packages[n] != now[n]]
    return "with " + ", ".join(changed) if changed else ""


def _tell_apart(rows: Sequence[Row], name: str) -> None:
    """Add the file to names that plug-ins of several files share."""
    sources: dict[str, set[str]] = {}
    for row in rows:
        sources.setdefault(row[name], set()).add(_outside(row[f"{name}_source"]))
    for row in rows:
        shared = sources[row[name]]
        if len(shared) > 1:
            row[name] = f"{row[name]} ({_short(_outside(row[f'{name}_source']), shared)})"


def _short(source: str, others: Iterable[str]) -> str:
    """The end of a path from where it differs from the others'."""
    folders = [os.path.dirname(other) for other in others if other]
    common = os.path.commonpath(folders) if source and folders else ""
    return os.path.relpath(source, common) if common else source or "file unknown"
