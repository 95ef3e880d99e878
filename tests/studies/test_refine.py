"""Adaptive maps find all that differs on smooth boundaries, with few points."""

from itertools import pairwise, product

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from strainbench.studies.stability.axis import Axis, parse_axis
from strainbench.studies.stability.refine import coarseness, inferred, wanted
from strainbench.studies.stability.words import FAILS, HOLDS, LATE, boundary


def evaluated(shape, truth, stride=4):
    """The points evaluated until nothing is wanted, and the whole map."""
    known = {}
    while missing := wanted(shape, known, stride):
        assert not missing & known.keys()
        known |= {point: truth(*point) for point in missing}
    return known, inferred(shape, known, stride)


@pytest.mark.parametrize("stride", [2, 4, 8])
@pytest.mark.parametrize("slope", [-1.3, 0.2, 1.0, 4.0])
def test_a_boundary_is_found_whole_with_few_points(stride, slope):
    shape = 24, 16

    def truth(i, j):
        return "fails" if j > slope * (i - 9) + 6 else "holds"

    known, found = evaluated(shape, truth, stride)
    assert found == {p: truth(*p) for p in product(*map(range, shape))}
    assert len(known) < 0.62 * 24 * 16


def test_one_outcome_needs_the_corners_alone():
    known, found = evaluated((24, 16), lambda *_: "holds")
    assert len(known) == 7 * 5
    assert set(found.values()) == {"holds"}
    assert len(found) == 24 * 16


@settings(deadline=None, max_examples=40)
@given(st.integers(1, 9), st.integers(1, 9), st.integers(0, 2**31))
def test_it_ends_and_every_pair_that_differs_was_evaluated(width, height, seed):
    outcomes = "ab" if seed % 2 else "aaab"

    def truth(i, j):
        return outcomes[hash((i, j, seed)) % len(outcomes)]

    known, found = evaluated((width, height), truth)
    assert len(found) == width * height
    for (i, j), outcome in found.items():
        for other in ((i + 1, j), (i, j + 1)):
            if other in found and found[other] != outcome:
                assert {(i, j), other} <= known.keys()
    assert all(found[p] == truth(*p) for p in known)


def test_a_range_has_levels_no_more_than_the_factor_apart():
    axis = parse_axis("--x", "limit=0.01%..20%")
    assert (axis.key, axis.shown[0], axis.shown[-1]) == ("limit", "0.01%", "20%")
    values = [float(w.rstrip("%")) for w in axis.shown]
    assert max(b / a for a, b in pairwise(values)) < 1.31
    steps = parse_axis("--y", "step=1/240..1/5")
    assert steps.shown[0] == "1/240"
    assert float(steps.words[0]) == pytest.approx(1 / 240)
    assert parse_axis("--x", "resolution=5..20").words == ("5", "6", "8", "10", "13", "16", "20")
    assert parse_axis("--x", "directions=2,4,8").words == ("2", "4", "8")


@pytest.mark.parametrize(
    "text",
    [
        "limit",
        "limit=",
        "=1..2",
        "limit=2..1",
        "limit=0..1",
        "limit=a..b",
        "limit=1..1",
        "limit=5",
        "limit=1/0..2",
        "limit=1e-30..1e30",
    ],
)
def test_words_that_are_no_axis(text):
    with pytest.raises(ValueError, match=r"^--x .*valid"):
        parse_axis("--x", text)


def test_boundaries_in_words():
    x = Axis("limit", ("1", "2", "3"), ("1%", "2%", "3%"))
    y = Axis("step", ("1", "2", "3", "4"), ("1/4", "1/3", "1/2", "1"))
    rows = ["FHH", "FHH", "FFF", "HFH"]
    verbs = {"H": HOLDS, "F": FAILS, "L": LATE}
    did = {(i, j): verbs[c] for j, row in enumerate(rows) for i, c in enumerate(row)}
    assert boundary(x, y, did) == [
        "holds from limit 2% on (fails at 1%) at step 1/4 to 1/3",
        "fails at every limit at step 1/2",
        "irregular between limit 1% and 3% at step 1",
    ]
    assert boundary(x, y, did | {(0, 0): LATE, (1, 2): LATE})[::2] == [
        "holds from limit 2% on (runs out of time at 1%) at step 1/4",
        "fails or runs out of time at every limit at step 1/2",
    ]
    always = dict.fromkeys(did, HOLDS)
    assert boundary(x, y, always) == ["holds at every limit everywhere"]
    del always[0, 0]
    always[2, 0] = FAILS
    assert boundary(x, y, always)[0] == "holds up to limit 2% (fails at 3%) at step 1/4"


def test_what_is_not_known_of_every_level_is_not_said_of_it():
    x = Axis("limit", ("1%", "2%", "3%"), ("1%", "2%", "3%"))
    y = Axis("step", ("1/60",), ("1/60",))
    (said,) = boundary(x, y, {(0, 0): HOLDS, (2, 0): HOLDS})
    assert said == "holds at every limit run everywhere"


def test_coarse_lattices_come_first():
    shape = (20, 9)
    points = sorted(wanted(shape, {}, stride=2), key=lambda point: -coarseness(shape, point))
    assert set(points[:4]) == {(0, 0), (0, 8), (19, 0), (19, 8)}
    strides = [coarseness(shape, point) for point in points[4:]]
    assert strides == sorted(strides, reverse=True)
    assert coarseness(shape, (16, 8)) == 16
    assert coarseness(shape, (16, 3)) == 1
