"""Claims of Tang et al. (2022) about the methods that fail: Table 1, and what becomes of steps."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from strainbench.bench.failure import COUNTED
from strainbench.report.claims.claim import Finding, Verdict, at, claim
from strainbench.report.claims.evidence import Evidence, NotThereError
from strainbench.report.claims.sides import or_missing
from strainbench.report.claims.table1 import PAPER, TABLE1
from strainbench.report.measures import COUNT, OPTIMAL, OUT_OF_TIME, cut_off_by_clock
from strainbench.report.printed import LIMITS, SIZES, STARRED
from strainbench.report.steps import newest_steps

IPOPT, STRAIN = "claims/ipopt", "claims/strain"
LBFGS, EXACT, EDGES = "ipopt-default-lbfgs", "ipopt-default", "ipopt-edges-default-lbfgs"
_BY_DEFAULT = (
    f"run swing --mode replay --frames 2-10 --set resolution={{}} --solver {EXACT},{LBFGS},{EDGES} "
    "--time-limit {}"
)
REPLAYED = (10, 20, 40)
"""Cells a side of their frames."""


class Tally(NamedTuple):
    """What became of the steps of a cell."""

    asked: int
    finished: int  # before the clock ended it
    within: int  # of these, within the limits
    counted: int  # of these, at a limit of iterations of the solver's own
    optimal: int
    broke: bool  # ended without an answer, by itself
    seconds: float  # that the clock allows
    why: str

    @property
    def failing(self) -> bool:
        """Whether a step failed that the clock did not end."""
        return self.broke or self.within < self.finished

    @property
    def all(self) -> bool:
        """Whether all steps are within the limits."""
        return self.within == self.asked


def tally(seen: Evidence, folder: str, **wanted: object) -> Tally:
    """Of the newest such cell."""
    cell = seen.cells(folder, **wanted).tail(1)
    run = cell.iloc[0]
    steps = newest_steps(seen.root / folder, cell)
    own = steps[~steps["status"].map(cut_off_by_clock).astype(bool)]
    finished = own[own["outcome"] != "no answer"]
    return Tally(
        int(run["steps_asked"]),
        len(finished),
        int(finished["outcome"].isin(COUNT).sum()),
        sum(bool(COUNTED.search(status)) for status in finished["status"]),
        int((finished["outcome"] == OPTIMAL).sum()),
        run["ending"] not in (*COUNT, OUT_OF_TIME, "violated"),
        float(run["time_limit"]),
        str(run["why"]),
    )


def _told(done: Tally) -> str:
    """The steps within the limits, and what ended the others."""
    ends = {
        f"{done.finished - done.within} violated": done.finished > done.within,
        done.why: done.broke,
        f"the clock after {done.seconds:.0f} s": not done.broke and done.finished < done.asked,
    }
    after = [text for text, so in ends.items() if so]
    near = f", {done.optimal} optimal" if done.optimal < done.within else ""
    return f"{done.within} of {done.asked}{near}" + (f" ({', '.join(after)})" if after else "")


def _each(sizes: tuple[int, ...], of: Callable[[int], Tally]) -> dict[int, Tally]:
    found = {}
    for n in sizes:
        try:
            found[n] = of(n)
        except NotThereError:
            continue
    return found


def _by_size(found: dict[int, Tally], sizes: tuple[int, ...]) -> str:
    return ", ".join(
        f"{n} cells {_told(found[n]) if n in found else 'not measured yet'}" for n in sizes
    )


@claim(
    "T29",
    "Table 1",
    "Ipopt with default options solves 10 x 10, some of 20 x 20, and fails from 40 x 40 on.",
    *(at(IPOPT, _BY_DEFAULT.format(*of)) for of in (("10", 120), ("20,40", 300))),
    TABLE1,
    fairness="Which Hessian they gave is not written; MUMPS against MA57; what the clock ended "
    "may be slow and not failing.",
)
def ipopt_by_default(seen: Evidence) -> Finding:
    """What became of the steps, with either Hessian, and with limits on edges."""
    lbfgs, exact, edges = (_frames(seen, name) for name in (LBFGS, EXACT, EDGES))
    if not lbfgs:
        raise NotThereError(f"{IPOPT} holds no cell of {LBFGS}")
    answered = ", ".join(f"{n} cells {t.finished} of {t.asked}" for n, t in edges.items())
    return Finding(
        ipopt_verdict(lbfgs, exact),
        f"Frames within the limits: L-BFGS {_by_size(lbfgs, REPLAYED)}; exact Hessian "
        f"{_by_size(exact, REPLAYED)}. {_reading(lbfgs, exact)}",
        or_missing(lambda: _ipopt_closed(seen))
        + (f" Limits on edges after Jin et al., with L-BFGS: answers {answered}." if edges else ""),
    )


def _frames(seen: Evidence, solver: str) -> dict[int, Tally]:
    return _each(REPLAYED, lambda n: tally(seen, IPOPT, solver=solver, resolution=n))


def ipopt_verdict(lbfgs: dict[int, Tally], exact: dict[int, Tally]) -> Verdict:
    """Holds if one Hessian has the pattern by failing; under conditions if L-BFGS by the clock."""
    if any(n not in lbfgs for n in REPLAYED):
        return Verdict.UNMEASURED
    both = [of for of in (lbfgs, exact) if all(n in of for n in REPLAYED)]
    fails = [
        of[10].all and 0 < of[20].within < of[20].asked and of[40].failing and not of[40].within
        for of in both
    ]
    return Verdict.of(any(fails), lbfgs[10].all and not lbfgs[40].all)


def _reading(lbfgs: dict[int, Tally], exact: dict[int, Tally]) -> str:
    told = []
    if 10 in exact:
        same = "solves" if exact[10].all else "does not solve"
        told.append(f"With the exact Hessian it {same} 10 cells.")
    for n in (20, 40):
        if n in lbfgs and not lbfgs[n].all:
            how = "fails on some" if lbfgs[n].failing else "fails on none: it is slow"
            told.append(f"With L-BFGS at {n} cells it {how}.")
    return " ".join(told)


def _ipopt_closed(seen: Evidence) -> str:
    found = {limit: _steps(seen, PAPER, LBFGS, limit) for limit in LIMITS}
    told = [f"at {100 * v:g}% {_by_size(of, SIZES)}" for v, of in found.items() if of]
    if not told:
        raise NotThereError(f"{PAPER} holds no cell of {LBFGS}")
    return f"The paper's 100 steps with L-BFGS: {'; '.join(told)}."


def _steps(seen: Evidence, folder: str, solver: str, limit: float) -> dict[int, Tally]:
    return _each(SIZES, lambda n: tally(seen, folder, solver=solver, resolution=n, limit=limit))


@claim(
    "T30",
    "Table 1",
    "Gauss-Seidel fails to converge from 20 cells on at 1%, at 60 cells at 10%.",
    TABLE1,
    at(
        STRAIN,
        "run swing --mode replay --frames 14-18 --set resolution=10,20 --set limit=1%,10% --solver "
        "gauss-seidel,gauss-seidel-strain --time-limit 200",
    ),
    fairness="They clamp entries of the strain (`gauss-seidel-strain`), here directions; both at "
    "most 1e5 sweeps, to 1e-6. What the clock ended is counted as neither.",
)
def gauss_seidel(seen: Evidence) -> Finding:
    """Steps that ended at the limit of sweeps, by size and limit."""
    done = {limit: _steps(seen, PAPER, "gauss-seidel", limit) for limit in LIMITS}
    if not any(done.values()):
        raise NotThereError(f"{PAPER} holds no cell of gauss-seidel")
    fails = {limit: tuple(n for n, t in of.items() if t.counted) for limit, of in done.items()}
    same = [fails[limit] == STARRED["GS", limit] for limit in LIMITS]
    return Finding(
        Verdict.of(all(same), any(fails.values())),
        "Steps that ended at the limit of sweeps, of those that the clock let finish: "
        + "; ".join(
            f"at {100 * v:g}% {_counted(of)}, {_beside(fails[v], v)}" for v, of in done.items()
        )
        + ".",
        or_missing(lambda: _entries(seen)),
    )


def _counted(of: dict[int, Tally]) -> str:
    return ", ".join(f"{n} cells {t.counted} of {t.finished}" for n, t in of.items())


def _beside(fails: tuple[int, ...], limit: float) -> str:
    theirs = STARRED["GS", limit]
    if fails == theirs:
        return "as in the paper"
    since = f"from {fails[0]} cells on" if fails else "nowhere"
    return f"so {since}, in the paper from {theirs[0]} on"


def _entries(seen: Evidence) -> str:
    found = {
        (solver, limit): _steps(seen, STRAIN, solver, limit)
        for solver in ("gauss-seidel-strain", "gauss-seidel")
        for limit in LIMITS
    }
    told = [f"{s} at {100 * v:g}% {_counted(of)}" for (s, v), of in found.items() if of]
    if not told:
        raise NotThereError(f"{STRAIN} holds no results")
    return f"Equal frames: {'; '.join(told)}."
