"""Nothing that is done with results grows faster than they do: counted in calls."""

from __future__ import annotations

import sys

import pytest

from tests.growth import folder_of, works


def calls(work):
    """Of functions, Python's and C's, within `work` the second time."""
    work()
    count = 0

    def seen(frame, event, argument):
        nonlocal count
        count += event in ("call", "c_call")

    sys.setprofile(seen)
    try:
        work()
    finally:
        sys.setprofile(None)
    return count


@pytest.fixture(scope="module")
def counted(tmp_path_factory):
    """The calls of each work at 20 rows, and at 200."""
    place = tmp_path_factory.mktemp("growth")
    found = [works(folder_of(size, place / str(size))) for size in (20, 200)]
    return {name: [calls(each[name]) for each in found] for name in found[0]}


def test_all_of_the_rows_take_no_more_than_their_number_of_times(counted):
    for name, (few, many) in counted.items():
        assert many <= 10.5 * few, name


def test_one_more_cell_takes_the_same_whatever_is_there(counted):
    few, many = counted["one more cell"]
    assert many <= 1.05 * few
