"""A claim of a paper, and what was found of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum

from strainbench.report.claims.evidence import Evidence, NotThereError


class Verdict(StrEnum):
    """What is said of a claim."""

    HOLDS = "holds"
    CONDITIONS = "holds under conditions"
    FAILS = "does not hold here"
    NOT_TESTABLE = "not testable here"
    UNMEASURED = "not measured yet"

    @classmethod
    def of(cls, holds: bool, otherwise: bool = False) -> Verdict:
        """That it holds; under conditions if `otherwise` alone; that it doesn't."""
        return cls.HOLDS if holds else cls.CONDITIONS if otherwise else cls.FAILS


@dataclass(frozen=True)
class Finding:
    """A verdict, the numbers it rests on, and those from another side."""

    verdict: Verdict
    numbers: str
    second: str = ""


Measure = Callable[[Evidence], Finding]


@dataclass(frozen=True)
class Claim:
    """A claim and how it is looked at.

    Parameters
    ----------
    name : T or H for the paper, and a number
    where : sections, equations, figures and tables of the paper
    words : in ours
    commands : that measure it, see `at`
    fairness : what could explain a difference
    measure : reads the numbers and says the verdict; raises NotThereError where they are not there
    """

    name: str
    where: str
    words: str
    commands: Sequence[str]
    fairness: str
    measure: Measure

    def find(self, evidence: Evidence) -> Finding:
        """What was measured, or that it was not."""
        try:
            return self.measure(evidence)
        except NotThereError as missing:
            return Finding(Verdict.UNMEASURED, str(missing))


PROGRAM = "strainbench "


def at(folder: str, words: str) -> str:
    """A command that measures into a folder of the results."""
    return f"{PROGRAM}{words} --results results/{folder}"


CLAIMS: dict[str, Claim] = {}
"""All, in the order of the papers."""


def claim(
    name: str, where: str, words: str, *commands: str, fairness: str = ""
) -> Callable[[Measure], Measure]:
    """Register a claim with the function that measures it."""

    def register(measure: Measure) -> Measure:
        CLAIMS[name] = Claim(name, where, words, commands, fairness, measure)
        return measure

    return register
