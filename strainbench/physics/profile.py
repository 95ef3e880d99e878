"""The old name of `strainbench.studies.euler`: where a step of implicit Euler spends its time."""

import runpy

if __name__ == "__main__":
    runpy.run_module("strainbench.studies.euler", run_name="__main__")
