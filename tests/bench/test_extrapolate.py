"""Growth on paper is that of a power, and of a line."""

from __future__ import annotations

import pytest

from tests.extrapolate import grown


def test_time_is_carried_on_by_its_exponent_and_memory_by_its_slope():
    def row(n):
        return {
            "solve_seconds_median": str(2e-6 * n**1.5),
            "peak_memory_mb": str(100 + 0.01 * n),
            "variables": str(n),
        }

    assert grown(row(1_000), row(4_000), 1e6) == pytest.approx((1.5, 2000.0, 10.1))
