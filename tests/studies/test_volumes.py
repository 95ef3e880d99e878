"""The tables of limits on volumes: rows from play, and files that say how they were made."""

from __future__ import annotations

import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import pandas as pd
import pytest

from strainbench.report import provenance
from strainbench.report.freshness import age
from strainbench.studies.volumes import (
    cousin,
    fig4,
    growth,
    press,
    pressed_past,
    repeated,
    sweeps,
    violation,
    written,
)
from strainbench.studies.volumes.part import Plan


def test_rows_are_what_is_played():
    (first,) = fig4.first_violated("hyperbolic", 2, 20.0)
    assert first.time_ms == pytest.approx(100)
    assert (first.top, first.stretch) == (
        pytest.approx(0.941, abs=0.01),
        pytest.approx(1.064, abs=0.005),
    )
    (row,) = violation.held("anisotropic", "lcp-qp", 60.0)
    assert (row.steps, row.ended) == (4, "")
    assert row.worst >= row.median >= 0


def test_limits_that_are_never_violated_say_never(monkeypatch):
    monkeypatch.setattr(fig4, "LASTS", 0.02)
    (row,) = fig4.first_violated("hyperbolic", 2, 20.0)
    assert row.time_ms is None
    table = fig4.PART.table(pd.DataFrame([row]))
    assert table.texts()[0][3] == "never"


def test_linear_limits_depend_on_what_stands_for_none(monkeypatch):
    monkeypatch.setattr(fig4, "STEP", 0.02)
    (printed,) = fig4.first_violated("linear", 2, 20.0)
    (free,) = fig4.freed("linear", 2, 1e6)
    (other,) = fig4.freed("linear", 2, 2.0)
    assert (free.time_ms, free.top, free.stretch) == (
        pytest.approx(printed.time_ms),
        pytest.approx(printed.top),
        pytest.approx(printed.stretch),
    )
    assert other.time_ms < printed.time_ms - 20


def test_enforced_orthogonal_limits_freeze_the_beam(monkeypatch):
    monkeypatch.setattr(fig4, "LASTS", 0.1)
    (frozen,) = fig4.kept("orthogonal", "lcp-qp", 20.0)
    (free,) = fig4.kept("hyperbolic", "none", 20.0)
    assert 1 - frozen.top < 0.5 * (1 - free.top)


def test_what_ends_a_method_is_said(monkeypatch):
    class Stopping(violation.Stage):
        def accept(self, projection):
            raise violation.StageError("the solver", "no answer")

    monkeypatch.setattr(violation, "Stage", Stopping)
    (row,) = violation.held("anisotropic", "lcp-qp", 60.0)
    assert row.ended == "no answer"


def test_a_folder_has_its_tables_and_their_command(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(fig4, "KINDS", ("hyperbolic",))
    monkeypatch.setattr(violation, "METHODS", ("lcp-qp",))
    monkeypatch.setattr(sweeps, "STEPS", (0.03,))
    monkeypatch.setattr(press, "PRESSES", ())
    monkeypatch.setattr(press, "FRICTIONS", (1.0,))
    parts = "fig4,violation,sweeps,press"
    written.main("60", "2", parts, tmp_path / "new")
    text = (tmp_path / "new" / "volumes.md").read_text(encoding="utf-8")
    assert f"python -m strainbench.studies.volumes --step 60 --resolution 2 --part {parts}" in text
    assert "| hyperbolic | 2 | 60 |" in text
    assert len(pd.read_csv(tmp_path / "new" / "violation.csv")) == 2
    assert list(pd.read_csv(tmp_path / "new" / "fig4.csv")["limits"]) == ["hyperbolic"]
    assert capsys.readouterr().out.count("step_ms") == 3
    costs = pd.read_csv(tmp_path / "new" / "sweeps.csv")
    assert costs["steps"].sum() > 5
    assert costs["sweeps"].is_monotonic_increasing
    assert costs["solved"].iloc[0] == 100
    assert (costs["iterations"] < 40).all()
    row, deeper = pd.read_csv(tmp_path / "new" / "press.csv").itertuples()
    assert (row.press, row.depth_mm, row.friction) == ("side", 1.0, 1.0)
    assert row.cone_error < 1e-14 < row.force < 0.5 * deeper.force
    assert deeper.depth_mm == 1.1
    assert "| side | anisotropic | 1 | 1 |" in text


def test_what_a_folder_has_is_kept_and_told_in_the_plans_order(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(fig4, "KINDS", ("isotropic",))
    written.main("20", "2", "fig4", tmp_path)
    capsys.readouterr()
    written.main("40,20", "2", "fig4", tmp_path)
    said = capsys.readouterr().out
    assert said.count("fig4:") == 1
    assert "step_ms 40" in said
    assert pd.read_csv(tmp_path / "fig4.csv")["step_ms"].tolist() == [40, 20]


def test_a_file_notes_the_sources_that_it_is_begun_with(tmp_path, monkeypatch):
    monkeypatch.setattr(fig4, "KINDS", ("isotropic",))
    written.main("40", "2", "fig4", tmp_path)
    assert age(tmp_path) == []
    monkeypatch.setattr(provenance, "code_digest", lambda study: "another")
    monkeypatch.setattr(provenance, "alike", lambda files, watched: {"another"})
    written.main("40,20", "2", "fig4", tmp_path)
    assert age(tmp_path) == ["not known: its numbers stand in no history"]
    (tmp_path / "fig4.csv").unlink()
    written.main("40", "2", "fig4", tmp_path)
    assert age(tmp_path) == []


def test_a_press_has_a_row_at_each_depth():
    rows = list(press.pressed("tip", "isotropic", 0.5, (0.2, 0.5)))
    assert [r.depth_mm for r in rows] == [0.2, 0.5]
    assert [r.force for r in rows] == [pytest.approx(k, rel=0.05) for k in (1.6, 4.0)]
    assert {r.converged for r in rows} == {"yes"}


def test_a_press_past_the_limits_says_where_no_step_is_left():
    *_, last = pressed_past.past("tip", "lcp-qp")
    assert last.depth_mm < max(pressed_past.DEPTHS)
    assert "infeasible" in last.ended


@pytest.mark.parametrize("step", ["", "5,x", "-1", "2000", "nan"])
def test_steps_that_are_none_are_named(step, tmp_path):
    with pytest.raises(SystemExit, match=f"--step {step}: milliseconds with commas"):
        written.main(step, "2", "", tmp_path)


@pytest.mark.parametrize("resolution", ["0", "2.5", "inf", "two"])
def test_meshes_that_are_none_are_named(resolution, tmp_path):
    with pytest.raises(SystemExit, match=f"--resolution {resolution}: whole numbers"):
        written.main("5", resolution, "", tmp_path)


def test_a_part_that_is_none_is_named(tmp_path):
    with pytest.raises(SystemExit, match="--part fig5: valid are fig4, free, enforced, violation"):
        written.main("5", "2", "fig4,fig5", tmp_path)


def test_the_convex_cousins_are_other_materials():
    """The table of what 5% on e2 alone allows, up to 3."""
    known = {
        "uniaxial at 30 degrees to e2": (0.0577, 0.0661, 0.0577, 0.0548),
        "uniaxial at 60 degrees to e2": (0.1000, 0.1874, 0.1000, 0.0735),
        "uniaxial along the free e1": (3, 3, 3, 0.127),
        "shear F12": (0.133, 0.320, 0.100, 0.123),
    }
    for mode, amounts in known.items():
        for rule, amount in zip(cousin.RULES, amounts, strict=False):
            (row,) = cousin.allowed(mode, rule)
            assert row.amount == pytest.approx(amount, rel=6e-3), (mode, rule)


def test_a_convex_beam_is_compared_to_the_hyperbolic_one(monkeypatch):
    monkeypatch.setattr(cousin, "LASTS", 0.2)
    names = [cell[0] for cell in cousin.beam_cells(Plan())]
    assert set(names) == set(cousin.BEAMS)
    (own,) = cousin.beside("hyperbolic", "lcp-qp")
    assert (own.apart, own.ratio) == (0, 1)
    (other,) = cousin.beside("‖F e_j‖ <= 1 + d", "clarabel")
    assert other.own < 1e-6 < other.hyperbolic
    assert other.apart > 0.01
    cousin._played.cache_clear()


@pytest.mark.parametrize("material", repeated.MATERIALS)
def test_equal_singular_values_are_no_end(material):
    """Of all elements, as they expand by a tenth a step."""
    (row,) = repeated.came("F = I, expanding", material, "lcp-pgs")
    assert row.steps == repeated.STEPS
    assert (row.inverted, row.gap) == (0, pytest.approx(0, abs=1e-6))
    (free,) = repeated.came("F = I, expanding", material, "none")
    assert row.worst < 0.2 * free.worst


def test_cuts_end_a_collapse_within_the_limits_at_once():
    (row,) = repeated.came("a point, F = 0", "isotropic", "sequential-cuts")
    assert (row.steps, row.inverted, row.upright) == (repeated.STEPS, 0, 1)
    assert row.worst <= 1e-6


def test_methods_stand_beside_limits_that_they_take():
    pairs = {cell[:2] for cell in violation.cells(Plan())}
    assert {m for m, s in pairs if s == "sequential-cuts"} == {"isotropic"}
    pairs = {cell[1:] for cell in repeated.cells(Plan())}
    assert {m for m, s in pairs if s == "sequential-cuts"} == {"isotropic"}
    assert {m for m, s in pairs if s == "lcp-qp"} == set(repeated.MATERIALS)


def test_growth_counts_what_a_mesh_takes(monkeypatch):
    monkeypatch.setattr(growth, "METHODS", ("none", "lcp-qp"))
    alone, limited = growth.stepped(2)
    assert (limited.tetrahedra, limited.unknowns, limited.converged) == (200, 270, "yes")
    assert limited.rows > alone.rows == 0
    assert limited.count > 1
    assert limited.ratio > alone.ratio
    assert 0 <= alone.megabytes <= limited.megabytes


@pytest.mark.skipif(sys.platform != "linux", reason="it is not known elsewhere")
def test_memory_of_a_mesh_is_not_its_parents():
    held = np.ones(40_000_000)  # 320 MB
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        child = pool.submit(growth._peak).result()
    assert 10 < child < held.nbytes / 1e6 < growth._peak()


def test_a_method_that_cannot_take_the_limits_plays_no_step():
    with pytest.raises(ValueError, match="newton-ipm: it has no form for limits on principal"):
        next(cousin.beside("isotropic", "newton-ipm"))
