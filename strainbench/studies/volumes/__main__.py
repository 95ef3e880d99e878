"""Run the study."""

import typer

from strainbench.studies.volumes.written import main

if __name__ == "__main__":
    typer.run(main)
