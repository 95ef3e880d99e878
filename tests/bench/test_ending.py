"""How cells end is told by words that old rows have too."""

from __future__ import annotations

import pytest

from strainbench.bench.ending import Ending


@pytest.mark.parametrize("ending", Ending)
def test_an_end_is_read_back_from_its_reason(ending):
    assert Ending.of(f"{ending} of 2 s (1 of 3 steps)") is ending


@pytest.mark.parametrize(
    ("reason", "ending"),
    [
        ("time limit of 9 s (4 of 10 steps)", Ending.TIME_LIMIT),
        ("unavailable: needs ecos", Ending.UNAVAILABLE),
        ("crashed: its process ended with exit code -6 (SIGABRT)", Ending.CRASHED),
        ("ZeroDivisionError: by a solver (0 of 3 steps)", None),
        ("3 of 10 projections: violation 2e-03 above 1e-06 at worst", None),
        ("", None),
    ],
)
def test_rows_of_before_are_read(reason, ending):
    assert Ending.of(reason) is ending


def test_no_end_begins_like_another():
    assert all(Ending.of(ending) is ending for ending in Ending)


def test_only_what_may_come_by_itself_is_tried_again():
    assert [ending for ending in Ending if ending.passing] == [Ending.UNAVAILABLE, Ending.LOST]
