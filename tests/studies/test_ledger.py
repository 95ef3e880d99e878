"""The ledger tells a part that matters from one that does not."""

from __future__ import annotations

import numpy as np
import pytest

from strainbench.bench.plan import plan
from strainbench.solver.registry import find_solver
from strainbench.studies.ledger.measure import (
    AS_IT_IS,
    ELSEWHERE,
    NEEDED,
    NEGLIGIBLE,
    OMITTED,
    PARTS,
    WRONG,
    Added,
    Run,
    account,
    compared,
    verdict,
)
from strainbench.studies.ledger.report import write_ledger


def cells(scene, *settings, steps=6, tolerance=1e-6):
    settings = ["resolution=4", *settings]
    return plan([scene], ["clarabel"], settings, "simulate", steps, [tolerance], None)


def rows(scene, *settings, **options):
    return {row.change: row for row in account(*cells(scene, *settings, **options))}


@pytest.fixture(scope="module")
def swing():
    return rows("swing")


def test_every_part_has_a_row(swing):
    assert list(swing)[:3] == [AS_IT_IS, "tolerance / 100", "solver newton-ipm"]
    assert [change.split()[-1] for change in list(swing)[3:]] == list(PARTS)


def test_the_scene_as_it_is_changes_nothing(swing):
    assert swing[AS_IT_IS].distance_mm == 0
    assert swing[AS_IT_IS].energy_mj == 0
    assert swing[AS_IT_IS].newton_failures == 0


@pytest.mark.parametrize("part", ["inertia", "gravity", "membrane", "bending"])
def test_each_part_that_the_swing_needs_matters(swing, part):
    noise = swing["tolerance / 100"]
    assert swing[f"without {part}"].distance_mm > 5 * noise.distance_mm
    assert abs(swing[f"without {part}"].energy_mj) > 5 * abs(noise.energy_mj)


def test_a_floor_out_of_reach_does_not(swing):
    assert swing["with contact"].distance_mm == 0
    assert swing["with contact"].energy_mj == 0


def test_without_gravity_a_sheet_at_rest_stays(swing):
    fall = 1000 * 0.5 * 9.81 * (6 / 60) ** 2  # of a free vertex [mm]
    assert swing["without gravity"].active == 0
    assert 0.5 * fall < swing["without gravity"].distance_mm < 1.5 * fall


def test_left_out_bending_leaves_a_smaller_hessian(swing):
    assert swing["without bending"].hessian_nonzeros < swing[AS_IT_IS].hessian_nonzeros


def test_what_a_scene_cannot_have_says_why(swing):
    assert swing["with wind"].note == "it states no wind"
    assert swing["with wind"].distance_mm is None


def test_a_flat_square_feels_no_bending_but_would_fall():
    square = rows("stretch-square")
    assert square["with bending"].distance_mm < 1e-6
    assert square["with gravity"].distance_mm == pytest.approx(1000 * 9.81 / 60**2, rel=1e-3)
    assert square["with membrane"].distance_mm > 1e-3
    assert square["with inertia"].note == "no time passes in it"
    assert square[AS_IT_IS].hessian_nonzeros is None
    assert square["with bending"].energy_mj is None


def test_a_twist_is_compared_while_it_has_an_answer():
    twist = rows("twist", "step=0.05", steps=8)
    assert "no answer in step" in twist[AS_IT_IS].note
    assert 0 < twist[AS_IT_IS].compared_after < 8
    assert twist[AS_IT_IS].active > 0
    assert twist["with inertia"].distance_mm > twist["tolerance / 100"].distance_mm


def test_inertia_added_to_a_scene_without_physics_is_the_velocity_of_its_answers():
    from scenarios.twist import Twist

    scene = Twist(resolution=3, step=0.1)
    added = Added(scene, "inertia")
    x = scene.sheet()[2]
    free = scene.problem().free
    step = np.array([0.0, 0.02, 0.0])
    np.testing.assert_allclose(added.candidate(x), x)
    added.keep(x + step)
    np.testing.assert_allclose(added.candidate(x + step)[free], (x + 2 * step)[free])


def test_contact_matters_where_the_sheet_touches():
    touching = rows("sphere-drop", "margin=0.015", "step=0.02", steps=6)
    assert touching["without contact"].distance_mm > 1


def test_the_drape_stands_still():
    drape = rows("drape", steps=4)
    assert drape["with inertia"].note == "no time passes in it"
    assert drape["with contact"].note == "its method knows no contact"
    assert drape["without gravity"].energy_mj > 0.1  # its weight is counted, and pulls no more


def test_the_table_is_written(tmp_path):
    paths = write_ledger(cells("stretch-square", steps=1), tmp_path)
    assert [p.name for p in paths] == ["ledger.csv", "ledger.md"]
    assert paths[0].read_text().count("\n") == 1 + 3 + len(PARTS)
    assert "with bending" in paths[1].read_text()
    assert (tmp_path / "machines.json").exists()


def test_each_part_has_a_verdict(swing):
    assert {swing[f"without {p}"].verdict for p in ("inertia", "gravity", "membrane")} == {NEEDED}
    assert swing["with contact"].verdict == NEGLIGIBLE
    assert swing["with wind"].verdict == ""


def test_what_the_solvers_themselves_differ_by_is_negligible():
    scene = cells("swing")[0].scenario.scenario()
    assert verdict(0.1, 0.1, scene, "bending") == NEGLIGIBLE
    assert verdict(0.2, 0.1, scene, "bending") == NEEDED
    assert verdict(0.2, 0.1, scene, "wind") == WRONG
    assert verdict(0.2, 0.1, cells("stretch-square")[0].scenario.scenario(), "gravity") == ELSEWHERE


def test_each_part_has_its_cost(swing):
    bending = swing["without bending"]
    assert bending.added_nonzeros == swing[AS_IT_IS].hessian_nonzeros - bending.hessian_nonzeros
    assert bending.added_nonzeros > 0
    assert swing["without gravity"].added_nonzeros == 0
    assert all(row.time_share < 1 for row in swing.values() if row.time_share is not None)
    assert swing[AS_IT_IS].time_share is None


def test_bending_that_is_left_out_says_why():
    chainmail = rows("chainmail", "directions=4", steps=12)["with bending"]
    assert chainmail.verdict == OMITTED
    assert chainmail.note == "loose links turn freely"


def test_a_solver_that_is_not_there_is_one_line(tmp_path, monkeypatch):
    from dataclasses import replace

    (cell,) = cells("stretch-square")
    absent = replace(cell, solver=replace(cell.solver, unavailable="needs nothing we have"))
    with pytest.raises(ValueError, match="needs nothing we have"):
        write_ledger([absent], tmp_path)


def test_a_solver_that_fails_is_a_note():
    from tests.misbehaving import Raise

    scene = cells("stretch-square")[0].scenario.scenario()
    run = Run(scene, Raise(), 1e-6).play(3)
    assert run.note == "no answer in step 1: ZeroDivisionError: by a solver"
    assert compared(AS_IT_IS, run, run).distance_mm is None


def test_a_scene_that_ends_is_another_note():
    from tests.scenario.test_stage import Twice

    run = Run(Twice(resolution=3), find_solver("none"), 1e-6).play(5)
    assert run.note == "the scene ended in step 3: the scene has no more steps"
    assert len(run.positions) == 2
