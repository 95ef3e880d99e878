"""Claims about projection, cost and motion: verdicts follow from rows, whatever these hold."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from strainbench.report.claims import cost, methods, motion, projection, robustness
from strainbench.report.claims.claim import Verdict
from strainbench.report.claims.evidence import Evidence, NotThereError
from strainbench.report.claims.reading import loads, seconds_to, tally
from strainbench.report.claims.sides import or_missing

OPTIMAL: dict[str, Any] = {
    **{"ending": "optimal", "why": "", "reason": "", "relative_gap_max": 1e-7, "time": 1.0},
    **{"distance_max": 1e-6, "max_violation": 0.0, "iterations_mean": 10.0, "load": 1.0},
    **{"solve_seconds_mean": 1.0, "projections": 9, "projections_optimal": 9, "limit": 0.01},
    **{"resolution": 20, "mode": "replay:14-22", "directions": 4, "offset": 0.0},
}
FEASIBLE = {"ending": "feasible"}
VIOLATED = {"ending": "violated", "why": "violates by 4e-5"}
NOT_INSTALLED = {
    **{"ending": "no answer", "why": "not installed"},
    "reason": "unavailable: solver cvxpy-ecos is unavailable: cvxpy's backend ECOS is not "
    "installed; installed: SCS",
}
TALLY = """\
                             optimal  feasible  violated  no answer  solved, but violated  refused
clarabel                         200         0         0          0                     0        0
clarabel-paper                   149        11         0          0                     0       40
cvxpy-scs-default                 34         0       166          0                   152        0
"""


class Rows(Evidence):
    """Rows and steps that are made up, by folder."""

    def __init__(self, root: Path, **folders: list[dict[str, Any]]) -> None:
        super().__init__(root)
        self.folders = {name.replace("__", "/"): rows for name, rows in folders.items()}

    def _read(self, folder: str) -> pd.DataFrame:
        if folder not in self.folders:
            raise NotThereError(f"{folder} holds no results")
        return pd.DataFrame([{**OPTIMAL, **row} for row in self.folders[folder]])

    def steps(self, folder: str, cells: pd.DataFrame, column: str) -> pd.Series:
        return pd.Series([100.0])


def named(**how: dict[str, Any]) -> list[dict[str, Any]]:
    """A row a solver, `_` for `-`."""
    return [{"solver": name.replace("_", "-"), **row} for name, row in how.items()]


def test_what_is_missing_on_another_side_is_said(tmp_path):
    assert or_missing(tally, Evidence(tmp_path)) == (  # type: ignore[arg-type]
        "Not measured yet: certificates holds no tally.md."
    )
    (tmp_path / "certificates").mkdir()
    (tmp_path / "certificates" / "tally.md").write_text(TALLY, encoding="utf-8")
    found = tally(Evidence(tmp_path))
    assert found.loc["clarabel-paper", "refused"] == 40
    assert found.loc["cvxpy-scs-default", "solved, but violated"] == 152


def test_a_level_is_reached_where_it_is_kept(tmp_path):
    (tmp_path / "convergence").mkdir()
    samples = pd.DataFrame(
        {"solver": "a", "seconds": [1.0, 2.0, 3.0, 4.0], "relative_gap": [1.0, 1e-3, 1e-1, 1e-4]}
    )
    samples.to_csv(tmp_path / "convergence" / "convergence.csv", index=False)
    seen = Evidence(tmp_path)
    assert seconds_to(seen, "a", "relative_gap", 1e-2) == 4.0
    with pytest.raises(NotThereError, match="no relative_gap of 1e-06 by a"):
        seconds_to(seen, "a", "relative_gap", 1e-6)


@pytest.mark.parametrize(("found", "weak"), [([1.0, 1.1], False), ([0.06, 1.1], True)])
def test_times_beside_unlike_loads_are_called_weak(found, weak):
    assert ("weak" in loads(pd.DataFrame({"load": found}))) == weak


def box(**others: dict[str, Any]) -> list[dict[str, Any]]:
    return named(clarabel_default={}, qoco_default={}, **others)


def test_cone_solvers_out_of_the_box(tmp_path):
    found = projection.any_solver(
        Rows(tmp_path, claims__field=box(cvxpy_scs_default=VIOLATED, cvxpy_ecos_default={}))
    )
    assert found.verdict is Verdict.CONDITIONS
    assert "cvxpy-scs-default violates by 4e-5;" in found.numbers
    assert "not measured yet: cvxpy-mosek-default" in found.numbers
    assert "SCS, a first-order method" in found.numbers
    found = projection.any_solver(
        Rows(tmp_path, claims__field=box(cvxpy_scs_default={}, cvxpy_ecos_default=NOT_INSTALLED))
    )
    assert found.verdict is Verdict.HOLDS
    assert (
        "cvxpy-ecos-default has no answer: cvxpy's backend ECOS is not installed" in found.numbers
    )
    assert "SCS, a" not in found.numbers
    found = projection.any_solver(Rows(tmp_path, claims__field=box(cvxpy_ecos_default=VIOLATED)))
    assert found.verdict is Verdict.FAILS


def test_a_scaled_cone_solver_stands_for_one_that_was_not_run_out_of_the_box(tmp_path):
    found = projection.any_solver(
        Rows(tmp_path, claims__field=box(cvxpy_scs_default=VIOLATED, cvxpy_ecos={}))
    )
    assert "cvxpy-ecos optimal (gap 1e-7)" in found.numbers
    assert "not measured yet: cvxpy-mosek-default." in found.numbers


def test_the_cone_program_to_the_letter_about_the_target_and_far_away(tmp_path):
    literal, rest = {"clarabel_paper": {}, "clarabel": {}}, {"mode": "replay:1-15"}
    found = projection.cone_program(Rows(tmp_path, claims__field=named(**literal)))
    assert found.verdict is Verdict.HOLDS
    assert "Not measured yet: claims/field holds no cell with solver cvxpy-ecos." in found.second
    worse = {**rest, **FEASIBLE, "projections_optimal": 4, "relative_gap_max": 0.08}
    far = {"scenario": "stress", "case": "far", "severity": 1.0}
    seen = Rows(
        tmp_path,
        claims__field=named(**literal, cvxpy_ecos={}),
        claims__tightness=named(clarabel_paper=worse, cvxpy_ecos=rest),
        failures=named(clarabel_paper={**far, **VIOLATED}, clarabel=far),
    )
    found = projection.cone_program(seen)
    assert "optimal in 4 of 9 frames, with gaps up to 8e-2" in found.numbers
    assert "optimal, gaps 1e-7 and 1e-7 (in motion, from rest)" in found.second
    assert "Eq. 12 to the letter violates by 4e-5, with the quadratic objective it ends" in (
        found.second
    )


def test_two_stationary_answers_are_taken_from_the_records():
    found = projection.not_convex(Evidence(Path(__file__).parents[2] / "results"))
    assert found.verdict is Verdict.HOLDS
    assert "KKT residuals" in found.second


def field(lbfgs: float = 10.0) -> list[dict[str, Any]]:
    return named(
        clarabel_default={},
        ipopt_default={"ending": "out of time", "why": "0 of 9"},
        ipopt_default_lbfgs={"time": lbfgs},
    )


@pytest.mark.parametrize(
    ("ipopt", "literal", "verdict", "words"),
    [
        (2.0, 4.0, Verdict.CONDITIONS, "As printed the cone program is the slower"),
        (20.0, 2.0, Verdict.HOLDS, "20.0 times as long as Clarabel"),
    ],
)
def test_nonlinear_programs_beside_cone_programs(tmp_path, ipopt, literal, verdict, words):
    programs = named(clarabel={}, clarabel_paper={"time": literal}, ipopt={"time": ipopt})
    found = cost.cheaper_than_nlp(Rows(tmp_path, claims__programs=programs, claims__field=field()))
    assert found.verdict is verdict
    assert words in found.numbers
    assert ("As printed" in found.numbers) == (literal > ipopt)
    assert "out of time (0 of 9) with the exact Hessian; with L-BFGS optimal" in found.numbers


def test_fast_projection_is_counted_over_cells(tmp_path):
    pair = named(fast_projection={"time": 1.0}, gauss_seidel={"time": 2.0})
    slower = named(
        fast_projection={"resolution": 10, "scenario": "swing", "time": 2.0},
        gauss_seidel={"resolution": 10, "scenario": "swing", "time": 1.0},
    )
    hard = {"scenario": "stress", "case": "mass-ratio", "severity": 1.0}
    failing = named(fast_projection={**hard, **VIOLATED})
    seen = Rows(tmp_path, claims__field=pair, failures=failing)
    assert methods.coupling(seen).verdict is Verdict.HOLDS
    seen = Rows(tmp_path, claims__field=pair, failures=failing, paper=slower)
    found = methods.coupling(seen)
    assert found.verdict is Verdict.CONDITIONS
    assert "faster in 1 of 2 cells" in found.numbers
    assert "0.50 (10 cells, 1%)" in found.numbers


@pytest.mark.parametrize(
    ("apart", "verdict"),
    [(0.2, Verdict.CONDITIONS), (0.0, Verdict.NOT_TESTABLE)],
)
def test_local_minima_of_edges_are_seen_by_their_objectives(tmp_path, monkeypatch, apart, verdict):
    cells = [
        {
            "cell": f"{lower}{n}",
            "scenario": "swing",
            "solver_parameters": json.dumps({"lower": lower}),
        }
        for lower in (0.0, 0.9)
        for n in range(2)
    ]
    objectives = {"0.00": 1.0, "0.01": 1.0, "0.90": 1.0, "0.91": 1.0 + apart}
    steps = pd.DataFrame(
        [
            {"cell": c, "step": "1", "status": "solved for edge lengths", "objective": str(v)}
            for c, v in objectives.items()
        ]
    )
    monkeypatch.setattr(methods, "newest_steps", lambda _, own: steps[steps.cell.isin(own.cell)])
    seen = Rows(tmp_path, claims__field=named(ipopt_edges=VIOLATED), claims__edges=cells)
    found = methods.edges(seen)
    assert found.verdict is verdict
    assert f"lower ones of 0.9 as well, objectives differ in {int(apart > 0)} of 1" in found.numbers


def test_hard_cases_that_nobody_solves_are_left_out(tmp_path):
    def case(name: str, **how: dict[str, Any]) -> list[dict[str, Any]]:
        return [{"scenario": "stress", "case": name, "severity": 1.0, **r} for r in named(**how)]

    four = {"newton_ipm": {}, "clarabel": {}, "clarabel_default": {}, "clarabel_paper": FEASIBLE}
    none = {name: {"ending": "no answer", "why": "not finite"} for name in four}
    found = robustness.robust(Rows(tmp_path, failures=case("a", **four) + case("b", **none)))
    assert found.verdict is Verdict.CONDITIONS
    assert "clarabel-paper within the limits 1 of 1, optimal 0" in found.numbers
    assert "no method at all ends within the limits: b 1 at 1% (no answer)" in found.numbers
    found = robustness.robust(Rows(tmp_path, failures=case("a", **{**four, "clarabel_paper": {}})))
    assert found.verdict is Verdict.HOLDS
    found = robustness.robust(Rows(tmp_path, failures=case("a", newton_ipm={})))
    assert "Not measured yet: clarabel, clarabel-default, clarabel-paper" in found.numbers
    assert found.verdict is Verdict.CONDITIONS


def tight(moving: float, rest: float) -> list[dict[str, Any]]:
    return [
        {"solver": s, "limit": limit, "mode": mode, "iterations_mean": n, "constraints": 1000}
        for s in (*cost.CONES, "ipopt")
        for mode, more in ((cost.MOVING, moving), (cost.FROM_REST, rest))
        for limit, n in ((0.2, 10.0), (0.001, 10.0 * more))
    ]


@pytest.mark.parametrize(
    ("moving", "rest", "verdict", "lead"),
    [
        (1.1, 2.0, Verdict.CONDITIONS, "Once the cloth moves, tightness costs next to nothing."),
        (1.1, 1.1, Verdict.HOLDS, "Once the cloth moves, tightness costs next to nothing."),
        (2.0, 2.0, Verdict.FAILS, "Tightness costs iterations in motion too."),
    ],
)
def test_tightness_by_frames(tmp_path, moving, rest, verdict, lead):
    found = cost.tightness(Rows(tmp_path, claims__tightness=tight(moving, rest)))
    assert found.verdict is verdict
    assert found.numbers.startswith(lead)
    assert "10% of the limits are active at 20%" in found.numbers
    assert "Not measured yet: claims/tightness holds no cell" in found.second


@pytest.mark.parametrize(("more", "verdict"), [(1.2, Verdict.HOLDS), (4.0, Verdict.FAILS)])
def test_more_directions(tmp_path, more, verdict):
    cells = [
        {"solver": s, "limit": limit, "directions": n, "time": t}
        for s in cost.CONES
        for limit in (0.01, 0.2)
        for n, t in ((4, 1.0), (18, more))
    ]
    found = cost.directions(Rows(tmp_path, claims__directions=cells))
    assert found.verdict is verdict
    assert ("does not explain" in found.numbers) == (more > 2)


def looks(tmp_path: Path, name: str, rows: list[dict[str, Any]]) -> None:
    folder = tmp_path / "claims" / "looks"
    folder.mkdir(parents=True, exist_ok=True)
    pd.DataFrame(rows).to_csv(folder / name, index=False)


@pytest.mark.parametrize(
    ("loose", "tight", "verdict"),
    [(0.5, 0.3, Verdict.CONDITIONS), (0.3, 0.3, Verdict.HOLDS), (0.5, 0.9, Verdict.FAILS)],
)
def test_smoothness_of_all_limits(tmp_path, loose, tight, verdict):
    limited = [
        {"solver": "newton-ipm", "limit": v, "jitter": j}
        for v, j in ((0.1, loose), (0.01, 0.3), (0.001, tight))
    ]
    seen = Rows(tmp_path, claims__smooth=[*limited, {"solver": "none", "jitter": 0.3}])
    found = motion.smooth(seen)
    assert found.verdict is verdict
    assert ("10% is 1.7 times rougher" in found.numbers) == (loose > 0.4)
    looks(
        tmp_path,
        "timesteps.csv",
        [
            {"solver": s, "limit": v, "step": 1 / 240, "jitter": 0.1, "resolution": 10}
            for s in ("none", "newton-ipm")
            for v in motion.LIMITS
        ],
    )
    assert "At 10 cells, by step: 1/240 s 0.10 without limits" in motion.smooth(seen).second


@pytest.mark.parametrize(
    ("below_95", "below_90", "verdict"),
    [(0.0, 0.0, Verdict.HOLDS), (0.2, 0.0, Verdict.CONDITIONS), (0.2, 0.1, Verdict.FAILS)],
)
def test_compression_by_shares_of_triangles(tmp_path, below_95, below_90, verdict):
    shares = {"below_99": 0.4, "below_95": below_95, "below_90": below_90}
    rows = [{"resolution": n, "limit": v, **shares} for n in (10, 40) for v in motion.LIMITS]
    looks(tmp_path, "sizes.csv", rows)
    found = motion.buckles(Rows(tmp_path))
    assert found.verdict is verdict
    assert "at 40 cells" in found.numbers
    assert "10 cells 40%" in found.second


def test_chainmail_of_two_patterns(tmp_path):
    rows = named(newton_ipm={"scenario": "chainmail", "pattern": "rows"})
    found = motion.chainmail(Rows(tmp_path, claims__chainmail=rows))
    assert found.verdict is Verdict.HOLDS
    assert "not measured yet: hexagonal" in found.numbers
    looks(
        tmp_path,
        "chainmail.csv",
        [
            {"pattern": "rows", "beyond": 2e-3, "directions": 18, "limit": 0.25},
            {"pattern": "hexagonal", "beyond": -1e-3, "directions": 18, "limit": 0.25},
        ],
    )
    seen = Rows(tmp_path, claims__chainmail=rows)
    assert "2e-3 (rows), 0 (hexagonal)" in motion.chainmail(seen).second
    with pytest.raises(NotThereError, match="claims/chainmail holds no results"):
        motion.chainmail(Rows(tmp_path))
