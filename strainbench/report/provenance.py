"""What the numbers of a study were made with: the machine, and the sources as they were.

Rows of cells know their sources each; a study keeps one digest beside its machine's facts, so that
numbers that come out the same again are known to be of the code as it is.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path

from strainbench.bench.records import remember_machine
from strainbench.sources import PACKAGES, ROOT, SUITE, TELLING, digest

CODE = "code"
ONLY_TELLS = ("chart.py", "report.py")
"""Files of studies that no number depends on."""


def remember_study(folder: Path, study: str, machine: str, facts: Mapping[str, object]) -> None:
    """Note a machine's facts in the folder of a study, with the digest of what it measured.

    Parameters
    ----------
    study : its folder in strainbench/studies
    """
    remember_machine(folder, machine, {**facts, CODE: {study: code_digest(study)}})


def made_with_this_code(machines: Mapping[str, Mapping[str, object]]) -> bool:
    """Whether a study's digest, beside any of its machines, is that of the sources as they are."""
    codes = [code for facts in machines.values() if isinstance(code := facts.get(CODE), Mapping)]
    return any(made == code_digest(study) for code in codes for study, made in code.items())


@cache
def code_digest(study: str) -> str:
    """Of all that a study may measure: the suite, its plug-ins, and the study itself."""
    return digest(file for file in _sources() if _counts(file, study))


def _sources() -> Iterator[Path]:
    for package in PACKAGES:
        yield from (ROOT / package).rglob("*.py")


def _counts(file: Path, study: str) -> bool:
    """Whether a file decides a study's numbers: none that only tells, and no other study."""
    room, *rest = file.relative_to(SUITE).parts if file.is_relative_to(SUITE) else ("",)
    own = room == "studies" and study in rest[:1] and file.name not in ONLY_TELLS
    return own or room not in TELLING
