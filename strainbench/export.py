"""Problems as files: `strainbench.problem.export`."""

from strainbench.problem.export import load_problem as load_problem
from strainbench.problem.export import write_problem as write_problem
