"""Run cells as jobs of a SLURM cluster, through dask-jobqueue.

    pip install 'strainbench[cluster]' dask-jobqueue
    python docs/howto/cluster.py 8 strainbench run swing --set resolution=40 --results results

starts eight jobs, each a worker with one core and one cell at a time, runs the command with the
address of their scheduler, and ends the jobs. Change SLURM for your site: `--exclusive` gives a
job its node, so that nothing else disturbs the times. With `local` in place of the number, the
workers are processes of this machine.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from typing import Any

SLURM = {
    "cores": 1,
    "processes": 1,  # one worker of one thread a job
    "memory": "8GB",
    "walltime": "04:00:00",
    "job_extra_directives": ["--exclusive"],
}


def run_on(cluster: Any, jobs: int, command: Sequence[str]) -> int:
    """Run a command with the scheduler of a dask cluster of so many jobs; its exit status."""
    with cluster:
        cluster.scale(jobs)
        words = [*command, "--scheduler", cluster.scheduler_address]
        return subprocess.run(words, check=False).returncode


def main(where: str, *command: str) -> int:
    """See above."""
    if where == "local":
        from distributed import LocalCluster

        local = LocalCluster(n_workers=0, threads_per_worker=1, dashboard_address=None)
        return run_on(local, 1, command)
    from dask_jobqueue import SLURMCluster

    return run_on(SLURMCluster(**SLURM), int(where), command)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
