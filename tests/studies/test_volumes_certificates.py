"""Tables of the study of volumes: presses by a load, and what the referee says of last answers."""

from __future__ import annotations

import pandas as pd
import pytest

from strainbench.problem.problem import Problem
from strainbench.studies.volumes import certificates, pressed_by_load, violation, written
from strainbench.studies.volumes.part import Plan


def test_a_loaded_finger_has_a_row_at_each_load(monkeypatch):
    monkeypatch.setattr(pressed_by_load, "LOADS", (2.0, 3.0))
    rows = list(pressed_by_load.loaded("tip", "isotropic"))
    assert [r.load for r in rows] == [2, 3]
    assert [r.force for r in rows] == [pytest.approx(k, rel=0.1) for k in (2, 3)]
    assert 0.2 < rows[0].depth_mm < rows[1].depth_mm < 0.4
    assert {r.converged for r in rows} == {"yes"}


def test_the_last_answer_at_a_limit_is_judged():
    (found,) = certificates.certified("F = I, expanding", "isotropic", "lcp-qp")
    assert 1 <= found.step <= found.steps == 20
    assert (found.outcome, found.reading) == ("feasible", "any")
    assert found.violation < 1e-6
    assert 0 <= found.residual < 1e-3


@pytest.mark.parametrize(
    ("material", "reading"), [("anisotropic", "LAPACK's"), ("isotropic", "any")]
)
def test_equal_values_are_read_in_one_way_of_many(material, reading, monkeypatch):
    body, about = certificates.repeated.block()
    limits = certificates.repeated.MATERIALS[material]
    x = 1.05 * about
    frame = Problem(body.rest, body.elements, x, limits)
    monkeypatch.setattr(certificates, "answers", lambda *_: iter([(frame, x)]))
    (found,) = certificates.certified("F = 1.05 I", material, "lcp-qp")
    assert found.outcome == "feasible"
    assert found.gap < 1e-12
    assert found.reading == reading


def test_no_answer_is_said(monkeypatch):
    monkeypatch.setattr(certificates, "answers", lambda *_: iter(()))
    (found,) = certificates.certified("beam, 4%", "anisotropic", "lcp-qp")
    assert (found.outcome, found.steps, found.residual) == ("no answer", 0, None)
    line = certificates.PART.table(pd.DataFrame([found])).texts()[0]
    assert line[4:7] == ["0", "no answer", "none"]


def test_each_case_is_by_methods_that_take_it(monkeypatch):
    monkeypatch.setattr(violation, "METHODS", ("lcp-pgs-biot", "lcp-qp"))
    cells = list(certificates.cells(Plan()))
    assert len(cells) == len(set(cells))
    assert {m for _, material, m in cells if material == "isotropic"} == {"lcp-qp"}
    assert {case for case, _, _ in cells} == {
        *certificates.BEAMS,
        *certificates.repeated.STARTS,
        *certificates.FINGERS,
    }


def test_a_folder_keeps_the_rows_of_both_meshes(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(written.fig4, "KINDS", ("isotropic",))
    written.main("20", "2", "fig4", tmp_path)
    written.main("20", "4", "fig4", tmp_path)
    assert capsys.readouterr().out.count("fig4:") == 2
    assert pd.read_csv(tmp_path / "fig4.csv")["resolution"].tolist() == [4, 2]
    written.main("20", "2,4", "fig4", tmp_path)
    assert capsys.readouterr().out == ""
    assert pd.read_csv(tmp_path / "fig4.csv")["resolution"].tolist() == [2, 4]
