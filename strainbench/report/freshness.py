"""Which folders of results are older than the code that they measure, and how to have them anew.

`python -m strainbench.report.freshness results` prints them. Rows know the sources that
they were measured with, and so do studies that keep a digest of them. Of others the checkout's
history tells how many edits of what they measure came after them. Edits that change no number count
in none, see `strainbench.report.history`.
"""

from __future__ import annotations

import csv
import re
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from strainbench.bench.records import MACHINES, RUNS, RecordsError, read_machines
from strainbench.report.claims.written import CLAIMS
from strainbench.report.history import ENDED, git, texts_before
from strainbench.report.provenance import ONLY_TELLS, made_with_this_code, study_files
from strainbench.report.versions import changed_packages, shown_runs
from strainbench.sources import PACKAGES, SUITE, TELLING

FRESH = "as the code is now"
RULE = """\
In a checkout with its history edits of comments, docstrings and layout do not
count; nor do those of what ends cells from outside, but in folders with a cell
that it ended for other than time."""
NO_COMMAND = "none is known"
OURS = r"(?:strainbench|make|python -m strainbench\S*|python -m pytest) [^`\n]*"
STUDIES = {"converge": "convergence", "map": "stability"} | {
    name: name for name in ("duel", "ledger", "sensitivity", "step")
}
"""Of verbs, the folder of strainbench/studies that they call."""
LOCAL = "local"
"""Folder of what is not committed."""


class Standing(NamedTuple):
    """A folder of results: what it holds, in what it is older than the code, what measures it."""

    folder: str
    measured: str
    older: list[str]
    commands: list[str]

    def __str__(self) -> str:
        told = f"{self.folder} ({self.measured}): {'; '.join(self.older) or FRESH}"
        return "\n".join([told, *(f"    {command}" for command in self.commands)])


def freshness(root: Path) -> list[Standing]:
    """Of each folder of results below `root`.

    Raises
    ------
    RecordsError
        If there are none, or records are damaged.
    """
    known = commands(root / "README.md") | claimed()
    found = []
    for folder in folders(root):
        name = folder.relative_to(root).as_posix()
        told = list(dict.fromkeys(own_commands(folder))) or known.get(name, [NO_COMMAND])
        found.append(Standing(name, _what(folder), age(folder, told), told))
    if not found:
        raise RecordsError(f"{root} has no folder of results")
    return found


def folders(root: Path) -> list[Path]:
    """Those with tables of numbers, by name."""
    holding = {path.parent for form in ("*.csv", "*.md") for path in root.rglob(form)}
    return sorted(f for f in holding - {root} if f.relative_to(root).parts[0] != LOCAL)


def _what(folder: Path) -> str:
    return f"{len(shown_runs(folder))} cells" if (folder / RUNS).exists() else "a study"


def age(folder: Path, commands: Sequence[str] = ()) -> list[str]:
    """In what ways a folder is older than the code; nothing if in none.

    Parameters
    ----------
    commands : that measure it: of the studies those count that they call
    """
    if (folder / RUNS).exists():
        rows = shown_runs(folder)
        counts = Counter(row["older"] for row in rows if row["older"])
        return [f"{count} of {len(rows)} cells {how}" for how, count in counts.items()]
    machines = read_machines(folder) if (folder / MACHINES).exists() else {}
    changes = dict.fromkeys(filter(None, map(changed_packages, machines.values())))
    files = [path.name for path in folder.glob("*.csv")]
    watched = _has_ended_cells(folder)
    fresh = made_with_this_code(machines, files, watched)
    return [*([] if fresh else _edits(folder, commands, watched)), *changes]


def _has_ended_cells(folder: Path) -> bool:
    """Whether a table of a study tells of cells that were ended from outside."""
    return any(
        row.get("failure") in ENDED
        for path in folder.glob("*.csv")
        for row in csv.DictReader(path.read_text(encoding="utf-8").splitlines())
    )


def _edits(folder: Path, commands: Sequence[str], watched: bool) -> list[str]:
    """How many edits of what a study measures are newer than its oldest numbers; of none, if they
    changed no number."""
    numbers = sorted(folder.glob("*.csv")) or sorted(folder.glob("*.md"))
    since = {path: git(folder, "log", "-1", "--format=%h %cs", "--", path.name) for path in numbers}
    shallow = git(folder, "rev-parse", "--is-shallow-repository") == "true"
    if shallow or not all(since.values()):
        return ["not known: its numbers stand in no history"]
    studies = {path.stem for path in (SUITE / "studies").iterdir()}
    called = _called(commands) or studies
    measured = {file for study in called for file in study_files(study)}
    others = (*sorted(studies - called), *(f"*/{file}" for file in ONLY_TELLS))
    left_out = [room for room in TELLING if room != "studies"]
    left_out += [f"studies/{name}*" for name in others]
    rooms = [f":(top,exclude){PACKAGES[0]}/{room}" for room in left_out]
    newer = {}
    for path, told in since.items():
        base = told.split()[0]
        sources = (*(f":(top){name}" for name in PACKAGES), *rooms)
        count = int(git(folder, "rev-list", "--count", f"{base}..HEAD", "--", *sources))
        went = git(folder, "diff", "--name-only", "--diff-filter=D", base, "--", *sources)
        same = not went and texts_before(base, measured, watched) is not None
        newer[path] = 0 if same else count
    oldest = max(newer, key=lambda path: newer[path])
    when = since[oldest].split()[1]
    return [f"{newer[oldest]} edits since {oldest.name} of {when}"] if newer[oldest] else []


def _called(commands: Sequence[str]) -> set[str]:
    """The studies that commands call."""
    words = [
        re.match(r"strainbench (\w+)|python -m strainbench\.studies\.(\w+)", c) for c in commands
    ]
    return {STUDIES.get(m[1], "") if m[1] else m[2] for m in words if m} - {""}


def commands(readme: Path) -> dict[str, list[str]]:
    """Of each folder that a table's first column links to or names, the commands beside it."""
    found: dict[str, list[str]] = {}
    if not readme.exists():
        return found
    for line in readme.read_text(encoding="utf-8").splitlines():
        linked, _, beside = line.removeprefix("|").partition("|")
        told = re.findall(rf"`({OURS})`", beside)
        for name, target in re.findall(r"\[([^]]+)\]\(([^)]+)\)", linked) if told else ():
            folder = name if target.startswith("#") else Path(target).parent.as_posix()
            found.setdefault(folder, []).extend(told)
    return found


def claimed() -> dict[str, list[str]]:
    """The commands of claims that write into a folder of results."""
    found: dict[str, list[str]] = {}
    for command in dict.fromkeys(c for claim in CLAIMS.values() for c in claim.commands):
        if target := re.search(r"(?:--results|-o) results/(claims/[\w-]+)", command):
            found.setdefault(target[1], []).append(command)
    return found


def own_commands(folder: Path) -> Iterator[str]:
    """What a folder's tables say that they were made by."""
    for path in sorted(folder.glob("*.md")):
        text = path.read_text(encoding="utf-8")
        if told := re.search(rf"^(?:Made by |`)({OURS})", text, re.MULTILINE):
            yield told[1]


def main(words: list[str]) -> None:
    """Print each folder, with commands that can be copied, and how many are older."""
    try:
        found = freshness(Path(words[0] if words else "results"))
    except (RecordsError, OSError) as error:
        raise SystemExit(f"strainbench.report.freshness: {error}") from None
    print("\n\n".join(map(str, found)))
    print(f"\n{sum(bool(s.older) for s in found)} of {len(found)} folders are older than the code.")
    print(RULE)


if __name__ == "__main__":
    main(sys.argv[1:])
