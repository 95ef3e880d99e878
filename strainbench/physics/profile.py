"""Where a step of implicit Euler spends its time: `strainbench.studies.euler`."""

import typer

from strainbench.studies.euler import run

if __name__ == "__main__":
    typer.run(run)
