"""How far drapes are from each other."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from strainbench.studies.drapes import FILE, SHAPES, hausdorff, run, samples


def test_a_surface_is_as_far_as_it_is_moved():
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    surface = samples(corners, np.array([[0, 1, 2]]))
    assert len(surface) == 45
    assert np.ptp(surface, axis=0) == pytest.approx([1, 1, 0])
    assert hausdorff(surface, surface + np.array([0, 0, 0.3])) == pytest.approx(0.3)
    assert hausdorff(surface, surface[:1]) == hausdorff(surface[:1], surface) > 0.9


def test_each_two_drapes_are_compared(tmp_path):
    run("3,4", tmp_path)
    table = pd.read_csv(tmp_path / FILE)
    assert len(table) == 15
    assert set(table["shape"]) == set(SHAPES)
    assert (table["hausdorff"] > 0).all()


def test_bad_numbers_of_cells_are_one_line(tmp_path):
    with pytest.raises(SystemExit, match="--resolution few: whole numbers with commas"):
        run("few", tmp_path)
