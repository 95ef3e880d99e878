"""Verdicts and sentences of claims turn with the records that they are about."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest

from strainbench.report.claims.bdf2 import spectral_radius
from strainbench.report.claims.claim import CLAIMS, Finding, Verdict
from strainbench.report.claims.evidence import Evidence
from strainbench.report.claims.failing import Tally, ipopt_verdict
from strainbench.report.claims.sides import in_steps
from strainbench.report.claims.table1 import FREEDOM, exponent
from strainbench.report.claims.written import audit

RESULTS = Path(__file__).parents[2] / "results"
DRAPES = """shape,resolution,other,other_resolution,hausdorff
isotropic,15,isotropic,30,0.02
orthotropic,15,orthotropic,30,0.02
anisotropic,15,anisotropic,30,0.02
isotropic,30,orthotropic,30,0.1
isotropic,30,anisotropic,30,0.1
orthotropic,30,anisotropic,30,{}
"""
Edit = Callable[[pd.DataFrame], pd.DataFrame]


def copied(
    root: Path, folder: str, runs: Edit = lambda t: t, steps: Edit = lambda t: t
) -> Evidence:
    """A folder of the results in `root`, changed."""
    shutil.copytree(RESULTS / folder, root / folder, dirs_exist_ok=True)
    for name, edit in (("runs.csv", runs), ("steps.csv", steps)):
        table = pd.read_csv(root / folder / name, dtype=str, keep_default_na=False)
        edit(table).to_csv(root / folder / name, index=False)
    return Evidence(root)


def found(name: str, evidence: Evidence) -> Finding:
    """What is found of a claim."""
    return CLAIMS[name].find(evidence)


def test_steps_at_the_limit_of_sweeps_are_counted():
    told = found("T30", Evidence(RESULTS)).numbers
    cell = Evidence(RESULTS).one("paper", solver="gauss-seidel", resolution=60, limit=0.1)["cell"]
    steps = pd.read_csv(RESULTS / "paper" / "steps.csv")
    steps = steps[steps["cell"] == cell]
    counted = (steps["status"] == "iteration limit").sum()
    finished = (steps["status"] != "time limit").sum()
    assert 0 < counted < finished
    assert f"60 cells {counted} of {finished}, as in the paper" in told


def test_a_gauss_seidel_that_never_stops_contradicts(tmp_path):
    def solved(steps: pd.DataFrame) -> pd.DataFrame:
        return steps.replace({"status": {"iteration limit": "solved"}})

    finding = found("T30", copied(tmp_path, "paper", steps=solved))
    assert finding.verdict is Verdict.FAILS
    assert "so nowhere, in the paper from 60 on" in finding.numbers


def tally(within: int, *, broke: bool = False) -> Tally:
    """Of nine steps, those that finished within the limits."""
    return Tally(9, within, within, 0, within, broke, 300.0, "not finite" if broke else "")


@pytest.mark.parametrize(
    ("at_20", "at_40", "verdict"),
    [
        (tally(4), tally(0, broke=True), Verdict.HOLDS),
        (tally(4), tally(0), Verdict.CONDITIONS),  # the clock
        (tally(9), tally(9), Verdict.FAILS),
        (None, tally(0), Verdict.UNMEASURED),
    ],
)
def test_what_the_clock_ended_is_no_failure(at_20, at_40, verdict):
    done = {10: tally(9), 20: at_20, 40: at_40}
    assert ipopt_verdict({n: t for n, t in done.items() if t}, {}) is verdict


def test_schemes_are_unstable_where_the_projection_holds_and_bdf2_reflects():
    held = {s: spectral_radius(s, held=True) for s in ("bar-bdf2", "bar", "bar-stable", "sar")}
    assert held["bar-bdf2"] > 1.5
    assert held["bar"] > 1.5
    assert held["bar-stable"] < 1
    assert held["sar"] == pytest.approx(1, abs=1e-5)  # the odd-even velocity stays
    assert all(spectral_radius(s, held=False) <= 1 + 1e-6 for s in held)


def test_a_rise_of_the_energy_is_told(tmp_path):
    assert "No run's energy rises" in found("T21", Evidence(RESULTS)).numbers

    def kicked(steps: pd.DataFrame) -> pd.DataFrame:
        last = steps.groupby("cell", sort=False).tail(1).index[-1]
        return steps.assign(kinetic_energy=steps["kinetic_energy"].mask(steps.index == last, "1"))

    finding = found("T21", copied(tmp_path, "fig5", steps=kicked))
    assert finding.verdict is Verdict.FAILS
    assert "The energy rises above its first step's in steps of 1/5 s." in finding.numbers


def test_settings_that_lack_are_counted(tmp_path):
    def some(runs: pd.DataFrame) -> pd.DataFrame:
        of = runs["scenario_parameters"].str
        norm = of.contains('"norm": "unweighted"')
        cells = of.contains('"resolution": 10,') & of.contains('"limit": 0.01,')
        return runs[norm & cells & of.contains('"step": 0.01|"step": 0.005')]

    finding = found("T16", copied(tmp_path, "claims/schemes", runs=some))
    assert finding.verdict is Verdict.CONDITIONS
    assert "9 more are not measured yet" in finding.numbers
    assert "unweighted norm" in finding.numbers
    assert "Not measured yet" in finding.second  # rises in the norm of the masses


@pytest.mark.parametrize(("apart", "verdict"), [(0.041, "HOLDS"), (0.039, "CONDITIONS")])
def test_drapes_differ_where_meshes_move_them_less(tmp_path, apart, verdict):
    (tmp_path / "claims" / "drapes").mkdir(parents=True)
    (tmp_path / "claims" / "drapes" / "apart.csv").write_text(DRAPES.format(apart), "utf-8")
    finding = found("T12", Evidence(tmp_path))
    assert finding.verdict is Verdict[verdict]
    assert finding.second.startswith("Not measured yet: drape")


def test_the_free_cloth_loses_by_its_position_not_by_its_motion():
    evidence = Evidence(RESULTS)
    steps = in_steps(evidence, "fig4", ("time", "kinetic_energy"), solver="none")
    moving = 1000 * steps["kinetic_energy"][steps["time"].between(1, 2)].mean()
    finding = found("T15", evidence)
    assert f"from 1 to 2 s {moving:.1f} and" in finding.second
    assert "by its motion it is the reverse" in finding.second


def test_exponents_are_over_degrees_of_freedom():
    assert exponent(pd.Series(3 * FREEDOM**1.25)) == pytest.approx(1.25)
    assert FREEDOM[0] == 3 * 11**2


@pytest.mark.slow
def test_folders_with_one_cell_each_leave_no_claim_without_a_word(tmp_path):
    for file in RESULTS.rglob("runs.csv"):
        folder = tmp_path / file.parent.relative_to(RESULTS)
        if "stability" in folder.parts or "certificates" in folder.parts:
            continue
        folder.mkdir(parents=True)
        lines = file.read_text(encoding="utf-8").splitlines()
        (folder / "runs.csv").write_text("\n".join(lines[:2]) + "\n", encoding="utf-8")
        for name in ("steps.csv", "machines.json"):
            shutil.copy(file.with_name(name), folder)
    findings = audit(tmp_path)
    assert all(finding.numbers for _, finding in findings)
    assert Verdict.UNMEASURED in {finding.verdict for _, finding in findings}
