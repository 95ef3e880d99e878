"""Export a projection and read it back: for a solver that is not written in Python.

The file holds the sheet, and the cone program min 1/2 u'Pu with A u + s = b and s in cones, whose u
are the displacements of the free vertices. Whoever reads it needs NumPy's format alone: the length
of the answer's u in the norm of P must be the objective that the referee finds here.
"""

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import scipy.sparse as sp

from strainbench import certify, solve
from strainbench.export import load_problem

EXPORT = "export swing --set resolution=6 --frame 5 --format npz -o"


def main() -> tuple[float, float]:
    """The objective by the file's own arrays, and the referee's [m^2]."""
    with TemporaryDirectory() as folder:
        file = Path(folder) / "frame.npz"
        command = [sys.executable, "-m", "strainbench", *EXPORT.split(), str(file)]
        subprocess.run(command, check=True)
        problem = load_problem(file)
        with np.load(file) as data:
            P = sp.csr_array((data["P_data"], data["P_indices"], data["P_indptr"]), data["P_shape"])
            free, target = data["free"], data["target"]
    x = solve(problem, "newton-ipm").positions
    u = (x - target)[free].ravel()
    return float(0.5 * u @ (P @ u)), certify(problem, x).objective


if __name__ == "__main__":
    print("objective by the file {:.9e}, by the referee {:.9e} m^2".format(*main()))
