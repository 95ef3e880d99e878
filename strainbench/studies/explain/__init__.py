"""The story of one cell that failed: what, where, since when, and whether an easier one passes."""

from strainbench.studies.explain.choose import cell_of, choose, listed
from strainbench.studies.explain.story import Story, explain

__all__ = ["Story", "cell_of", "choose", "explain", "listed"]
