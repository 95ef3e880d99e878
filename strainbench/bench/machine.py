"""The facts of a machine that a time depends on."""

from __future__ import annotations

import hashlib
import json
import os
import platform
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from importlib.metadata import PackageNotFoundError, version

import psutil
from cpuinfo import get_cpu_info
from threadpoolctl import threadpool_info

from strainbench.physics.linear import available_linear_solvers

THREAD_VARIABLES = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMBA_NUM_THREADS",
    "RAYON_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)
PACKAGES = (
    *("casadi", "clarabel", "cvxopt", "cvxpy", "cyipopt", "ecos", "llvmlite", "mkl", "mosek"),
    *("numba", "numpy", "osqp", "pypardiso", "qdldl", "qoco", "scipy", "scs", "strainbench"),
)
"""Those that a time depends on; casadi's wheel carries Ipopt and MUMPS."""


def describe_machine(threads: int) -> tuple[str, dict[str, object]]:
    """A short name and the facts: processor, memory, system, libraries, threads a solver.

    The linear solver is that of newton-ipm and implicit Euler, the fastest that is installed.
    """
    cpu = get_cpu_info()
    model = str(cpu.get("brand_raw", platform.processor() or "unknown processor"))
    facts: dict[str, object] = {
        "processor": model,
        "cores": psutil.cpu_count(logical=False) or os.cpu_count(),
        "memory_gb": round(psutil.virtual_memory().total / 1024**3, 1),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "threads_per_solver": threads,
        "linear_solver": available_linear_solvers()[0].name,
        "blas": _blas(),
        "packages": installed(PACKAGES),
    }
    digest = hashlib.sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()[:6]
    return f"{model}, {facts['cores']} cores ({digest})", facts


def memory_share(jobs: int = 1) -> float:
    """[MB] that each of some cells may take by default: 3/4 of the machine's, shared."""
    return float(0.75 * psutil.virtual_memory().total / 1024**2 / jobs)


def _blas() -> list[str]:
    """The BLAS libraries that NumPy and SciPy have loaded, and the kernels that they chose."""
    pools = [pool for pool in threadpool_info() if pool["user_api"] == "blas"]
    names = ("internal_api", "version", "architecture")
    return sorted({" ".join(str(pool.get(n) or "") for n in names).strip() for pool in pools})


def installed(packages: Iterable[str]) -> dict[str, str]:
    """The packages' versions, or "not installed"."""
    return {name: _version(name) for name in packages}


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


@contextmanager
def fixed_threads(threads: int) -> Iterator[None]:
    """Let processes started inside use this many threads in BLAS, OpenMP, numba and rayon."""
    before = {name: os.environ.get(name) for name in THREAD_VARIABLES}
    os.environ.update({name: str(threads) for name in THREAD_VARIABLES})
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
