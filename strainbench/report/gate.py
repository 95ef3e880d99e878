"""When a comparison fails: `--fail-on outcome`, `--fail-on ratio>1.1`."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import isfinite

from strainbench.options import shown
from strainbench.report.pair import Pair

OUTCOME = "outcome"
RATIO = re.compile(r"\s*ratio\s*>\s*(\d*\.?\d+(?:[eE][+-]?\d+)?)\s*")
VALID = "outcome, and ratio> with a number, such as 'ratio>1.1', are valid"


@dataclass(frozen=True)
class Gate:
    """What no cell may do, in the words that it was given in."""

    word: str
    broken: Callable[[Pair], bool]
    applies: Callable[[Pair], bool] = lambda _: True

    @classmethod
    def read(cls, word: str) -> Gate:
        """ValueError for a word that means nothing."""
        if word.strip() == OUTCOME:
            return cls(OUTCOME, lambda pair: pair.worse)
        found = RATIO.fullmatch(word)
        most = float(found[1]) if found else 0.0
        if not (isfinite(most) and most > 0):
            raise ValueError(f"--fail-on {shown(word)}: {VALID}")
        return cls(f"ratio>{most:g}", lambda p: p.surely_above(most), lambda p: p.ratio > 0)

    def failures(self, pairs: Sequence[Pair]) -> list[str]:
        """A line for each cell that breaks it; ValueError where none can."""
        if not any(map(self.applies, pairs)):
            raise ValueError(f"--fail-on {self.word}: the folders have no cells that compare in it")
        broken = [pair for pair in pairs if self.broken(pair)]
        return [f"fails on {self.word}: {pair.title}, {pair.verdict}" for pair in broken]
