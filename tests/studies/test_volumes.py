"""The tables of limits on volumes: rows from play, and files that say how they were made."""

from __future__ import annotations

import pandas as pd
import pytest

from strainbench.studies import press, sweeps, volumes


def test_rows_are_what_is_played():
    first = volumes.first_violated("hyperbolic", 0.02, 2)
    assert first.time_ms == pytest.approx(100)
    assert (first.top, first.stretch) == (
        pytest.approx(0.941, abs=0.01),
        pytest.approx(1.064, abs=0.005),
    )
    row = volumes.held("anisotropic", "lcp-qp", 0.06, 2)
    assert (row.steps, row.ended) == (4, "")
    assert row.worst >= row.median >= 0


def test_limits_that_are_never_violated_say_never(monkeypatch):
    monkeypatch.setitem(volumes.LASTS, "beam-compress", 0.02)
    row = volumes.first_violated("hyperbolic", 0.02, 2)
    assert row.time_ms is None
    table = volumes.documented([row], [], [], [], "", "").parts[2]
    assert table.texts()[0][2] == "never"


def test_what_ends_a_method_is_said(monkeypatch):
    class Stopping(volumes.Stage):
        def accept(self, projection):
            raise volumes.StageError("the solver", "no answer")

    monkeypatch.setattr(volumes, "Stage", Stopping)
    assert volumes.held("anisotropic", "lcp-qp", 0.06, 2).ended == "no answer"


def test_a_folder_has_both_tables_and_their_command(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(volumes, "KINDS", ("hyperbolic",))
    monkeypatch.setattr(volumes, "METHODS", ("lcp-qp",))
    monkeypatch.setattr(sweeps, "STEPS", (0.03,))
    monkeypatch.setattr(press, "PRESSES", ())
    monkeypatch.setattr(press, "FRICTIONS", (1.0,))
    volumes.main("60", 2, tmp_path / "new")
    text = (tmp_path / "new" / "volumes.md").read_text(encoding="utf-8")
    assert "python -m strainbench.studies.volumes --step 60 --resolution 2" in text
    assert "| hyperbolic | 60 |" in text
    assert len(pd.read_csv(tmp_path / "new" / "violation.csv")) == 2
    assert list(pd.read_csv(tmp_path / "new" / "fig4.csv")["limits"]) == ["hyperbolic"]
    assert capsys.readouterr().out.count("step_ms") == 3
    costs = pd.read_csv(tmp_path / "new" / "sweeps.csv")
    assert costs["steps"].sum() > 5
    assert costs["sweeps"].is_monotonic_increasing
    assert costs["solved"].iloc[0] == 100
    assert (costs["iterations"] < 40).all()
    (row,) = pd.read_csv(tmp_path / "new" / "press.csv").itertuples()
    assert (row.press, row.depth_mm, row.friction) == ("side", 1.0, 1.0)
    assert row.cone_error < 1e-14 < row.force
    assert "| side | anisotropic | 1 | 1 |" in text


def test_a_press_has_a_row_at_each_depth():
    rows = list(press.pressed("tip", "isotropic", 0.5, (0.2, 0.5)))
    assert [r.depth_mm for r in rows] == [0.2, 0.5]
    assert [r.force for r in rows] == [pytest.approx(k, rel=0.05) for k in (1.6, 4.0)]
    assert {r.converged for r in rows} == {"yes"}


@pytest.mark.parametrize("step", ["", "5,x", "-1", "2000"])
def test_steps_that_are_none_are_named(step, tmp_path):
    with pytest.raises(SystemExit, match=f"--step {step}: milliseconds with commas"):
        volumes.main(step, 2, tmp_path)
