"""Where a chart is shown: how large it is, and how large its text."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


@dataclass(frozen=True)
class Sizes:
    """In pixels; in points for a paper.

    Parameters
    ----------
    width : of the whole chart
    height : of its plane
    text : of axes' numbers and names; titles of axes are `title`
    mark : the area of a mark
    line : the width of a line
    left : room for the numbers and the title of the axis
    names : the most room for names beside the plane
    """

    width: float
    height: float
    text: float
    title: float
    mark: float
    line: float
    left: float
    names: float


class Target(Enum):
    """A page, a phone, a column of a paper 3.3 in wide."""

    PAGE = Sizes(584, 400, 12, 12, 70, 1.5, 74, 200)
    PHONE = Sizes(352, 300, 11.5, 11.5, 50, 1.3, 62, 160)
    PAPER = Sizes(237.6, 150, 7.5, 8, 22, 0.9, 44, 98)

    @property
    def sizes(self) -> Sizes:
        """Its sizes."""
        return self.value

    @property
    def interactive(self) -> bool:
        """Whether it can be pointed at."""
        return self is not Target.PAPER
