"""Stability maps: outcomes over two swept settings, refined along their boundaries."""

from strainbench.studies.stability.axis import Axis, parse_axis
from strainbench.studies.stability.measure import Map, measure
from strainbench.studies.stability.report import sentences, write_map

__all__ = ["Axis", "Map", "measure", "parse_axis", "sentences", "write_map"]
