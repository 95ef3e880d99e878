"""How many directions, how fine a mesh and how short a step are enough."""

from __future__ import annotations

import pytest

from strainbench.bench.plan import plan
from strainbench.studies.ledger import enough as study
from strainbench.studies.ledger import write_enough
from strainbench.studies.ledger.enough import Beyond, Level, Score, beside, beyond, level, levels
from strainbench.studies.ledger.sufficient import sentences


def cell(scene="swing", *settings, steps=8):
    words = ["resolution=4", *settings]
    return plan([scene], ["newton-ipm"], words, "simulate", steps, [1e-6], None)[0]


def made(**scores):
    named = {name.replace("_", "-"): Score(*pair) for name, pair in scores.items()}
    return Level("s", 10, 0.1, named)


def test_more_directions_leave_less_stretch(monkeypatch):
    monkeypatch.setattr(study, "DIRECTIONS", (2, 4, 12))
    found = list(beyond(cell(steps=12)))
    assert [at.directions for at in found] == [2, 4, 12]
    excess = [at.excess for at in found]
    assert excess[0] > excess[1] > excess[2] > 0
    assert not found[0].enough(0.01)
    assert found[2].enough(0.01)


def test_a_curve_of_limits_is_no_limit_to_go_beyond():
    with pytest.raises(ValueError, match="chainmail: its limits are a curve"):
        list(beyond(cell("chainmail")))


def test_an_order_that_turns_is_named():
    fine = made(newton_ipm=(0.0, 1.0), gauss_seidel=(1.0, 3.0), xpbd=(5.0, 1.5))
    same = made(newton_ipm=(0.0, 2.0), gauss_seidel=(1.0, 2.1), xpbd=(1.1, 1.0))
    turned = made(newton_ipm=(0.0, 2.0), gauss_seidel=(1.2, 1.9), xpbd=(1.1, 1.0))
    assert beside(same, fine).upset == []
    assert beside(turned, fine).upset == [
        "gauss-seidel before xpbd in distance",
        "newton-ipm before gauss-seidel in time",
    ]


def test_where_nothing_is_projected_nothing_holds():
    fine = made(newton_ipm=(0.0, 1.0))
    assert beside(made(), fine).upset == ["nothing had to be projected"]


def test_all_methods_meet_the_same_candidates():
    found = level(cell().scenario.scenario(), 8, 1e-6)
    assert list(found.scores) == list(study.RACED)
    assert found.scores["newton-ipm"].distance_mm == 0
    assert found.scores["clarabel"].distance_mm < 0.1
    assert found.scores["gauss-seidel"].distance_mm > found.scores["clarabel"].distance_mm
    assert all(score.seconds > 0 for score in found.scores.values())


def test_levels_are_coarser_then_slower():
    found = list(levels(cell(steps=8)))
    assert [at.resolution for at in found] == [4, 2, 4, 4, 4]
    assert [round(60 * at.step) for at in found] == [1, 1, 2, 4, 8]
    assert found[0].upset == ()


def test_the_last_level_that_holds_is_said():
    names = {"newton_ipm": (0.0, 1.0), "gauss_seidel": (1.0, 3.0)}
    fine = made(**names)
    turned = beside(Level("s", 5, 0.1, made(newton_ipm=(0, 3.0), gauss_seidel=(1, 1)).scores), fine)
    long = beside(Level("s", 10, 0.2, fine.scores), fine)
    stretched = [Beyond("s", 4, 0.02), Beyond("s", 12, 0.0005)]
    assert list(sentences(cell(), stretched, [fine, turned, long])) == [
        "12 directions keep the true stretch within 10% of the limit's strain of 0.01.",
        "The order of the methods holds down to 10 cells a side.",
        "It holds up to a step of 0.2 s, the longest tried.",
    ]
    none = next(sentences(cell(), stretched[:1], [fine]))
    assert none.startswith("not even 36 directions keep")


def test_it_is_written(tmp_path, monkeypatch):
    monkeypatch.setattr(study, "DIRECTIONS", (4,))
    paths = write_enough(cell(steps=6), tmp_path)
    assert [p.name for p in paths] == ["enough.md", "directions.csv", "levels.csv"]
    assert "What is enough: swing 4 at 1%" in paths[0].read_text()
    assert paths[2].read_text().count("\n") == 6
