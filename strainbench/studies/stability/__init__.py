"""Stability maps: outcomes over two swept settings, refined along their boundaries."""

from strainbench.studies.stability.axis import Axis, parse_axis
from strainbench.studies.stability.measure import (
    FEWEST,
    LONG,
    PATIENCE,
    Map,
    lasting,
    measure,
)
from strainbench.studies.stability.report import sentences, write_map

__all__ = [
    "FEWEST",
    "LONG",
    "PATIENCE",
    "Axis",
    "Map",
    "lasting",
    "measure",
    "parse_axis",
    "sentences",
    "write_map",
]
