"""How much an answer depends on how its problem is written down."""

from strainbench.studies.sensitivity.measure import measure as measure
from strainbench.studies.sensitivity.report import Outcome as Outcome
