"""The compiled loops do what the same loops in C do, and keep what is not a number."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.augmented_lagrangian import minimum
from tests.kernels import COMPILER, compare, loops, sheet, table


@pytest.mark.slow
@pytest.mark.skipif(not COMPILER, reason="no C compiler")
def test_every_loop_agrees_with_c_to_rounding():
    compared = [compare(loop, 1) for loop in loops(sheet(6))]
    assert {one.name.split(",")[0] for one in compared} == {
        *("gauss-seidel", "xpbd", "dykstra", "admm", "augmented-lagrangian")
    }
    for one in compared:
        assert one.apart < 1e-11, one.name
        assert one.ratios[0] > 0
    assert len(table(compared, "loops").lines) == len(compared)


@pytest.mark.slow
def test_products_and_sums_rounded_at_once_keep_what_is_not_a_number():
    problem = sheet(3)
    mesh, x = minimum.Blocks.of(problem), problem.target
    least = minimum.Minimum(mesh, problem, np.zeros((problem.rows, 1, 3)), 1.0, x)
    p, out = np.ones_like(x), np.empty_like(x)
    minimum.product(least.hessian, p, out)
    assert np.isfinite(out).all()
    p[5, 1] = np.nan
    minimum.product(least.hessian, p, out)
    assert np.isnan(out[5, 1])
