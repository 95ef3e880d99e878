"""What the numbers of a study were made with: the machine, and the sources as they were.

Rows of cells know their sources each; a study keeps one digest beside its machine's facts, so that
numbers that come out the same again are known to be of the code as it is.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path

from strainbench.bench.records import MACHINES, read_machines, remember_machine
from strainbench.report.history import alike
from strainbench.sources import PACKAGES, ROOT, SUITE, TELLING, digest

CODE = "code"
ONLY_TELLS = ("chart.py", "report.py")
"""Files of studies that no number depends on."""


def remember_study(
    folder: Path, study: str, machine: str, facts: Mapping[str, object], file: str = ""
) -> None:
    """Note a machine's facts in the folder of a study, with the digest of what it measured.

    Parameters
    ----------
    study : its folder or module in strainbench/studies
    file : what was written, where other files in the folder are measured on their own
    """
    known = read_machines(folder).get(machine, {}) if (folder / MACHINES).exists() else {}
    of_files = {name: made for name, made in _codes(known) if file and "/" in name}
    code = {**of_files, f"{study}/{file}" if file else study: code_digest(study)}
    remember_machine(folder, machine, {**facts, CODE: code})


def made_with_this_code(
    machines: Mapping[str, Mapping[str, object]], files: Iterable[str] = (), watched: bool = False
) -> bool:
    """Whether all digests, each beside any machine, are of sources that give what today's give.

    Parameters
    ----------
    files : of the folder, each of which needs one of its own where files were measured apart
    watched : whether cells of the study were ended from outside, see `strainbench.report.history`
    """
    made = defaultdict[str, list[object]](list)
    for facts in machines.values():
        for name, code in _codes(facts):
            made[name].append(code)
    apart = {name.partition("/")[2] for name in made}
    if not made or ("" not in apart and set(files) - apart):
        return False
    return all(
        not alike(study_files(name.split("/")[0]), watched).isdisjoint(of)
        for name, of in made.items()
    )


def _codes(facts: Mapping[str, object]) -> Iterable[tuple[str, object]]:
    codes = facts.get(CODE)
    return codes.items() if isinstance(codes, Mapping) else ()


def code_digest(study: str) -> str:
    """Of all that a study may measure."""
    return digest(study_files(study))


@cache
def study_files(study: str) -> tuple[Path, ...]:
    """The suite, its plug-ins, and the study itself."""
    return tuple(file for file in _sources() if _counts(file, study))


@cache
def suite_files() -> tuple[Path, ...]:
    """What the digest of the suite in each row is of."""
    return tuple(file for file in study_files("") if file.is_relative_to(SUITE))


def _sources() -> Iterator[Path]:
    for package in PACKAGES:
        yield from (ROOT / package).rglob("*.py")


def _counts(file: Path, study: str) -> bool:
    """Whether a file decides a study's numbers: none that only tells, and no other study."""
    room, *rest = file.relative_to(SUITE).parts if file.is_relative_to(SUITE) else ("",)
    named = room == "studies" and study == Path(rest[0]).stem
    own = named and file.name not in ONLY_TELLS
    return own or room not in TELLING
