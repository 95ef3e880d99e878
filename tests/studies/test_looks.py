"""Smoothness and compression of motions, from positions alone."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from scenarios.chainmail import Chainmail
from strainbench.bench.plan import plan
from strainbench.scenario.stage import Stage
from strainbench.solver.registry import find_solver
from strainbench.studies import looks


def test_shares_are_of_all_triangles_and_steps():
    still = [np.zeros((1, 3))] * 3
    found = looks.Look.of(still, np.array([[1.0, 0.97], [0.94, 0.85]]), 0.0)
    assert (found.below_99, found.below_95, found.below_90) == (0.75, 0.5, 0.25)
    assert found.least == 0.85
    assert found.steps == 3


def test_the_bounds_of_a_curve_are_those_of_its_angles():
    scene = Chainmail(resolution=2)
    stage = Stage(scene, find_solver("none"))
    allowed = looks.bounds(scene, stage)
    assert allowed == pytest.approx(1 + 0.25 * (0.2 + 0.8 * np.sin(looks.ANGLES) ** 2), abs=1e-4)


def test_a_file_has_a_line_a_cell(tmp_path):
    file = tmp_path / "looks.csv"
    looks.run(["swing"], ["resolution=2", "limit=1%,5%"], "none", 4, None, file)
    found = pd.read_csv(file)
    assert list(found["limit"]) == [0.01, 0.05]
    (cell,) = plan(["swing"], ["none"], ["resolution=2"], "simulate", 4, [1e-6], None)
    seen = looks.play(cell)
    assert found["least"][0] == pytest.approx(seen.least)
    assert found["beyond"].diff()[1] == pytest.approx(-0.04)


def test_a_wrong_word_is_one_line():
    with pytest.raises(SystemExit, match="looks: no scenario called"):
        looks.run(["nowhere"], [], "none", 4)
