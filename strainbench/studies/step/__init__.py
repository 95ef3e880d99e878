"""What projection itself changes: closed loops beside the step that is constrained whole."""

from strainbench.studies.step.measure import measure as measure
from strainbench.studies.step.report import tables as tables
from strainbench.studies.step.report import write_distances as write_distances
