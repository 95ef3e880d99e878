"""The backends of cvxpy: which are there, and their names for the same options."""

from __future__ import annotations

from functools import cache
from importlib.util import find_spec
from typing import Any

from strainbench import Clock

BACKENDS = ("CLARABEL", "ECOS", "SCS", "QOCO", "MOSEK")
"""Each is a package of this name."""
SEMIDEFINITE = ("CLARABEL", "SCS", "MOSEK")


def missing(backend: str) -> str | None:
    """Why a backend cannot be used here, or None."""
    installed = [name for name in BACKENDS if find_spec(name.lower())]
    if backend not in installed:
        found = ", ".join(installed)
        return f"cvxpy's backend {backend} is not installed; installed: {found}"
    return no_licence() if backend == "MOSEK" else None


@cache
def no_licence() -> str | None:
    """Why MOSEK cannot be used, where it is installed."""
    import mosek

    try:
        with mosek.Env() as environment:
            environment.checkoutlicense(mosek.feature.pton)
    except mosek.Error as error:
        return f"MOSEK has no licence here ({error})"
    return None


def time_options(backend: str, deadline: Clock) -> dict[str, Any]:
    """The time limit, and a single thread; ECOS and QOCO take neither and are single-threaded."""
    seconds = min(max(deadline.remaining, 1e-3), 1e9)
    options: dict[str, dict[str, Any]] = {
        "CLARABEL": {
            "presolve_enable": False,  # these two forbid new data
            "chordal_decomposition_enable": False,
            "accept_unknown": True,  # the iterate where it stalls or time is up
            "max_threads": 1,
            "time_limit": seconds,
        },
        "SCS": {"time_limit_secs": seconds},
        "MOSEK": {
            "accept_unknown": True,
            "mosek_params": {
                "MSK_IPAR_NUM_THREADS": 1,
                "MSK_DPAR_OPTIMIZER_MAX_TIME": seconds,
            },
        },
    }
    return options.get(backend, {})


def accuracy_options(backend: str, tolerance: float) -> dict[str, Any]:
    """Each backend's names for a hundredth of `tolerance`.

    SCS needs no less: at a tenth it leaves violations of up to four times `tolerance`.
    """
    eps = 0.01 * tolerance
    options: dict[str, dict[str, Any]] = {
        "CLARABEL": {
            "tol_feas": eps,
            "tol_gap_abs": eps,
            "tol_gap_rel": eps,
            "equilibrate_enable": False,
        },
        "ECOS": {"feastol": eps, "abstol": eps, "reltol": eps},
        "SCS": {"eps_abs": eps, "eps_rel": eps},
        "QOCO": {"abstol": eps, "reltol": eps},
        "MOSEK": {"eps": eps},
    }
    return options[backend]
