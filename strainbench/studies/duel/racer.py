"""What a duel is run by, and what is measured of one who takes part."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from strainbench.referee.certificate import Certificate
from strainbench.solver.solver import Solution


@dataclass(frozen=True)
class Rules:
    """The same for all.

    Parameters
    ----------
    tolerance : aimed at
    time_limit : [s] a projection
    """

    tolerance: float
    time_limit: float | None = None


@dataclass
class Racer:
    """A solver, or a unit of time, and what was measured of it.

    Parameters
    ----------
    label : the solver's, or FACTORISATION followed by the linear solver's name, or IMPLICIT_EULER
    setups, seconds, cpu : [s] of each set-up, of each projection, and of CPU that this took
    answers : of the last repeat, by frame
    certificates : of the answers
    version : of the checkout that it is from, where there are two
    """

    label: str
    setups: list[float] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    answers: dict[int, Solution] = field(default_factory=dict)
    certificates: list[Certificate] = field(default_factory=list)
    cpu: list[float] = field(default_factory=list)
    version: str = ""

    def add(self, number: int, answer: Solution, cpu: float) -> None:
        """Keep a turn on this frame."""
        self.seconds.append(answer.seconds)
        self.cpu.append(cpu)
        self.answers[number] = answer

    @property
    def name(self) -> str:
        """The label, with the version where there are two."""
        return f"{self.label} ({self.version})" if self.version else self.label

    @property
    def setup(self) -> float:
        """[s], the median; NaN of a unit."""
        return float(np.median(self.setups)) if self.setups else float("nan")

    @property
    def median(self) -> float:
        """[s] a projection; NaN where there was none."""
        return float(np.median(self.seconds)) if self.seconds else float("nan")

    @property
    def median_cpu(self) -> float:
        """[s] of CPU a projection; NaN where it was not measured."""
        return float(np.median(self.cpu)) if self.cpu else float("nan")

    @property
    def quartiles(self) -> tuple[float, float]:
        """[s] between which the middle half of the projections lies."""
        first, third = np.percentile(self.seconds, [25, 75]) if self.seconds else (np.nan,) * 2
        return float(first), float(third)

    @property
    def iterations(self) -> float:
        """Median over the frames; NaN of a unit."""
        counts = [a.iterations for a in self.answers.values()]
        return float(np.median(counts)) if counts else float("nan")

    @property
    def worst_violation(self) -> float:
        """Over the frames; NaN where an answer is not usable."""
        return float(np.max([c.max_violation for c in self.certificates] or [np.nan]))

    @property
    def worst_gap(self) -> float:
        """Over the frames; NaN where an answer is not usable."""
        return float(np.max([c.relative_gap for c in self.certificates] or [np.nan]))

    @property
    def worst_distance(self) -> float:
        """[m] of a vertex from the optimum, over the frames; NaN where an answer is not usable."""
        return float(np.max([c.distance for c in self.certificates] or [np.nan]))

    @property
    def unsolved(self) -> list[str]:
        """What it says of frames that it does not call solved."""
        return sorted({str(a.status) for a in self.answers.values()} - {"solved"})
