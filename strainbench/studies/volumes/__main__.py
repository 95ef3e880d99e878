"""Run the study."""

from strainbench.studies.program import start
from strainbench.studies.volumes.written import main

if __name__ == "__main__":
    start(main)
