"""Limits on stretch: samples of a curve, and every way to get them wrong."""

from __future__ import annotations

import re

import numpy as np
import pytest

from strainbench import StretchLimits


def angles_of(limits):
    return np.arctan2(limits.directions[:, 1], limits.directions[:, 0])


@pytest.mark.parametrize("m", [1, 2, 3, 4, 7, 18])
def test_isotropic_samples_are_equally_spaced_over_a_half_turn(m):
    limits = StretchLimits.isotropic(1.01, directions=m)
    np.testing.assert_allclose(angles_of(limits), -np.pi / 2 + np.pi / m * np.arange(m), atol=1e-15)
    np.testing.assert_array_equal(limits.bounds, np.full(m, 1.01))


@pytest.mark.parametrize("m", [1, 4, 18])
def test_directions_are_unit_vectors(m):
    directions = StretchLimits.isotropic(1.01, m).directions
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1, rtol=1e-15)


@pytest.mark.parametrize("m", [2, 4, 18])
def test_between_samples_the_stretch_is_at_most_b_over_cos(m, rng):
    limits = StretchLimits.isotropic(1.1, m)
    worst = 0.0
    for F in rng.normal(size=(300, 3, 2)):
        F *= 1.1 / np.linalg.norm(limits.directions @ F.T, axis=1).max()
        worst = max(worst, np.linalg.norm(F, 2))
    assert worst <= 1.1 / np.cos(np.pi / (2 * m)) * (1 + 1e-14)


def test_that_bound_is_attained_by_a_stretch_half_way_between_samples():
    limits = StretchLimits.isotropic(1.1, 4)
    between = angles_of(limits)[1] + np.pi / 8
    u = np.array([np.cos(between), np.sin(between)])
    F = 1.1 / np.cos(np.pi / 8) * np.outer([1, 0, 0], u)
    assert np.linalg.norm(limits.directions @ F.T, axis=1).max() == pytest.approx(1.1, rel=1e-14)


def test_orthotropic_bounds_lie_along_warp_weft_and_both_diagonals():
    limits = StretchLimits.orthotropic(warp=1.01, weft=1.02, shear=1.3)
    along = {round(a): b for a, b in zip(np.rad2deg(angles_of(limits)), limits.bounds, strict=True)}
    assert along == {-90: 1.02, -45: 1.3, 0: 1.01, 45: 1.3}


def test_sampled_keeps_angles_and_bounds(rng):
    angles, bounds = np.sort(rng.uniform(-1.5, 1.5, 6)), rng.uniform(1, 1.2, 6)
    limits = StretchLimits.sampled(angles, bounds)
    np.testing.assert_allclose(angles_of(limits), angles, rtol=1e-14)
    np.testing.assert_array_equal(limits.bounds, bounds)


def test_sampled_takes_bounds_for_each_element(rng):
    bounds = rng.uniform(1, 1.2, (5, 3))
    limits = StretchLimits.sampled([0.0, 1.0, 2.0], bounds)
    np.testing.assert_array_equal(limits.bounds, bounds)


def test_a_volume_takes_directions_in_space():
    limits = StretchLimits(np.eye(3), [1.01, 1.02, 1.03])
    assert limits.directions.shape == (3, 3)


def test_arrays_are_read_only_copies():
    directions, bounds = np.eye(2), np.array([1.1, 1.2])
    limits = StretchLimits(directions, bounds)
    directions[0, 0], bounds[0] = 7.0, 7.0
    assert limits.directions[0, 0] == 1.0
    assert limits.bounds[0] == 1.1
    for array in (limits.directions, limits.bounds):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


# --- lower bounds


@pytest.mark.parametrize(
    "limits",
    [
        StretchLimits.isotropic(1.1, 4, lower=0.9),
        StretchLimits.orthotropic(1.1, 1.2, 1.3, lower=0.9),
        StretchLimits.sampled([0.0, 0.5, 1.0, 1.5], np.full(4, 1.1), lower=0.9),
    ],
)
def test_one_lower_bound_is_that_of_every_direction(limits):
    np.testing.assert_array_equal(limits.lower, np.full(4, 0.9))


def test_lower_bounds_merge_with_their_directions():
    limits = StretchLimits.sampled(np.deg2rad([-90, 0, 90]), [1.1, 1.2, 1.1], [0.8, 0.9, 0.8])
    np.testing.assert_array_equal(limits.lower, [0.8, 0.9])
    with pytest.raises(ValueError, match=r"limits\.directions\[2\] repeats direction 0"):
        StretchLimits.sampled(np.deg2rad([-90, 0, 90]), [1.1, 1.2, 1.1], [0.8, 0.9, 0.7])


@pytest.mark.parametrize(
    ("lower", "words"),
    [
        ([0.9, 0.0], r"limits\.lower\[1\] is 0"),
        ([1.2, 0.9], r"limits\.lower\[0\] is 1\.2: at most the bound 1\.1"),
        ([[0.9, 0.9], [0.9, 1.2]], r"limits\.lower\[1, 1\] is 1\.2: at most the bound 1\.1"),
        ([0.9], r"limits\.lower: shape \(1,\).*2 directions"),
        ([np.nan, 0.9], r"limits\.lower\[0\] is nan"),
        ("0.9", r"limits\.lower: "),
    ],
)
def test_bad_lower_bounds(lower, words):
    with pytest.raises(ValueError, match=words):
        StretchLimits(np.eye(2), [1.1, 1.1], lower=lower)


def test_lower_bounds_are_for_as_many_elements_as_the_upper_ones():
    with pytest.raises(ValueError, match=r"limits\.lower: 3 rows.*2"):
        StretchLimits(np.eye(2), np.full((2, 2), 1.1), lower=np.full((3, 2), 0.9))


def test_exact_limits_have_no_lower_bounds():
    with pytest.raises(ValueError, match=r"limits\.lower"):
        StretchLimits(np.eye(2), [1.1, 1.1], spectral=True, lower=[0.9, 0.9])


# --- one direction given twice


def test_a_curve_from_minus_90_to_90_degrees_has_its_ends_once():
    limits = StretchLimits.sampled(np.deg2rad([-90, 0, 90]), [1.1, 1.2, 1.1])
    np.testing.assert_allclose(np.rad2deg(angles_of(limits)), [-90, 0], atol=1e-12)
    np.testing.assert_array_equal(limits.bounds, [1.1, 1.2])


def test_ends_merge_for_each_element_too():
    limits = StretchLimits.sampled(np.deg2rad([-90, 0, 90]), [[1.1, 1.2, 1.1], [1.3, 1.2, 1.3]])
    np.testing.assert_array_equal(limits.bounds, [[1.1, 1.2], [1.3, 1.2]])


@pytest.mark.parametrize("bounds", [[1.1, 1.2, 1.15], [[1.1, 1.2, 1.1], [1.1, 1.2, 1.15]]])
def test_ends_with_different_bounds_are_an_error(bounds):
    with pytest.raises(ValueError, match=r"limits\.directions\[2\] repeats direction 0"):
        StretchLimits.sampled(np.deg2rad([-90, 0, 90]), bounds)


@pytest.mark.parametrize("apart", [1e-3, 1e-6])
def test_directions_that_differ_are_kept(apart):
    assert len(StretchLimits.sampled([0.0, apart], [1.1, 1.2]).bounds) == 2


# --- CSV


def write(tmp_path, text):
    path = tmp_path / "curve.csv"
    path.write_text(text)
    return path


def test_csv_angles_are_degrees(tmp_path):
    limits = StretchLimits.from_csv(write(tmp_path, "angle_degrees,bound\n-45,1.1\n30,1.2\n"))
    np.testing.assert_allclose(angles_of(limits), [-np.pi / 4, np.pi / 6], rtol=1e-14)
    np.testing.assert_array_equal(limits.bounds, [1.1, 1.2])


def test_csv_columns_are_found_by_name(tmp_path):
    text = "source,bound,angle_degrees\nmeasured,1.1,0\nmeasured,1.2,90\n"
    limits = StretchLimits.from_csv(write(tmp_path, text))
    np.testing.assert_array_equal(limits.bounds, [1.1, 1.2])
    np.testing.assert_allclose(limits.directions, np.eye(2), atol=1e-15)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("angle,bound\n0,1.1\n", r"curve\.csv.*angle.*valid are angle_degrees, bound"),
        ("", r"curve\.csv.*valid are angle_degrees, bound"),
        ("0,1.1\n90,1.2\n", r"curve\.csv.*valid are angle_degrees, bound"),
        ("angle_degrees,bound\n", r"curve\.csv: no samples"),
        ("angle_degrees,bound\n0,1.1\n90,wide\n", r"curve\.csv, line 3: .*wide"),
        ("angle_degrees,bound\n0\n", r"curve\.csv, line 2: "),
        ("angle_degrees,bound\n0,1.1\n90,nan\n", r"line 3: .*nan is not finite"),
        ("angle_degrees,bound\n0,1.1\n90,-1\n", r"line 3: .*-1 is no stretch"),
        ("angle_degrees,bound\ninf,1.1\n", r"line 2: .*inf is not finite"),
        ("angle_degrees,bound\n0,1,05\n", r"line 2: .*3 values for 2 columns"),
        ("angle_degrees,bound,bound\n0,1.1,1.2\n", r"columns .*once each"),
        ("angle_degrees,bound,strain\n0,1.1,0.1\n", r"columns .*once each"),
        ("angle_degrees,bound\n0,1.05\n45,0.05\n", r"line 3: .*0\.05 is no stretch.*strain"),
        ("angle_degrees,bound\n0,5\n", r"line 2: .*5 is no stretch.*percent"),
        ("angle_degrees,bound\n0,\n", r"line 2: .*'' is not a number"),
        ("angle_degrees,bound\n-90,1.1\n0,1.1\n90,1.2\n", r"line 4: .*another bound above, 1\.1"),
        ("angle_degrees,bound\n0,1.1\n1.5708,1.2\n", r"are radians"),
    ],
)
def test_a_wrong_csv_is_one_clear_line(tmp_path, text, words):
    with pytest.raises(ValueError, match=words) as caught:
        StretchLimits.from_csv(write(tmp_path, text))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "content",
    [
        b"\xef\xbb\xbfangle_degrees,bound\n0,1.05\n90,1.5\n",
        "angle_degrees\tbound\n0\t1,05\n90\t1.5\n".encode("utf-16"),
        b"angle_degrees;bound\r\n0;1,05\r\n\r\n90;1,5\r\n",
        b"angle_degrees , strain\n0,0.05\n90,0.5\n",
        b"angle_degrees,percent\n0,5\n90,50\n",
        b"angle_radians,bound\n0,1.05\n1.5707963267948966,1.5\n",
        b"angle_degrees,bound,who\n0,1.05,Caf\xe9\n90,1.5,\n",
    ],
)
def test_what_people_write_is_read_right(tmp_path, content):
    (tmp_path / "curve.csv").write_bytes(content)
    limits = StretchLimits.from_csv(tmp_path / "curve.csv")
    np.testing.assert_allclose(limits.bounds, [1.05, 1.5], rtol=1e-14)
    np.testing.assert_allclose(limits.directions, np.eye(2), atol=1e-15)


@pytest.mark.parametrize("name", [".", "nowhere.csv"])
def test_a_curve_that_is_no_file_is_one_line(tmp_path, name):
    with pytest.raises(ValueError, match="no such file"):
        StretchLimits.from_csv(tmp_path / name)


# --- bad input names the field, the index and the value


@pytest.mark.parametrize(
    ("directions", "bounds", "words"),
    [
        (np.eye(2), [1.1, 0.0], r"limits\.bounds\[1\] is 0"),
        (np.eye(2), [-2.0, 1.0], r"limits\.bounds\[0\] is -2"),
        (np.eye(2), [[1.1, 1.1], [1.1, 0.0]], r"limits\.bounds\[1, 1\] is 0"),
        (np.eye(2), [1.1, np.nan], r"limits\.bounds\[1\] is nan"),
        (np.eye(2), [np.inf, 1.0], r"limits\.bounds\[0\] is inf"),
        (np.eye(2), [1.1], r"limits\.bounds: shape \(1,\).*2 directions"),
        (np.eye(2), 1.1, r"limits\.bounds: .*shape \(\)"),
        (np.eye(2), np.ones((1, 2, 2)), r"limits\.bounds: .*shape \(1, 2, 2\)"),
        ([[1.0, 0.0], [0.6, 0.9]], [1.1, 1.1], r"limits\.directions\[1\] is \[0\.6 0\.9\]"),
        ([[0.0, 0.0]], [1.1], r"limits\.directions\[0\] is \[0\. 0\.\]"),
        ([[1.0, np.nan]], [1.1], r"limits\.directions\[0, 1\] is nan"),
        ([1.0, 0.0], [1.1], r"limits\.directions: .*\(2,\)"),
        (np.zeros((0, 2)), [], r"limits\.directions: at least one"),
        ("warp", [1.1], r"limits\.directions: "),
    ],
)
def test_bad_limits(directions, bounds, words):
    with pytest.raises(ValueError, match=words):
        StretchLimits(directions, bounds)


@pytest.mark.parametrize("directions", [0, -1, 2.0, "four", None])
def test_isotropic_needs_a_whole_number_of_directions(directions):
    with pytest.raises(ValueError, match=re.escape(f"directions is {directions!r}")):
        StretchLimits.isotropic(1.01, directions)


@pytest.mark.parametrize(("bound", "word"), [(0.0, "0"), (-1.0, "-1"), (np.nan, "nan")])
def test_isotropic_needs_a_bound_above_zero(bound, word):
    with pytest.raises(ValueError, match=rf"limits\.bounds\[0\] is {word}"):
        StretchLimits.isotropic(bound)


@pytest.mark.parametrize(
    "build",
    [
        lambda: StretchLimits.isotropic("1%"),
        lambda: StretchLimits.sampled([0.0], ["1%"]),
        lambda: StretchLimits(np.eye(2), [[1.1, 1.2], [1.1]]),
    ],
    ids=["a word", "a word in a list", "ragged"],
)
def test_bounds_that_are_no_array_of_numbers_are_named(build):
    with pytest.raises(ValueError, match=r"limits\.bounds"):
        build()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"bound": 0.0}, r"limits\.bounds\[0\] is 0"),
        ({"bound": 1.1, "weft": [1.1, -1.0]}, r"limits\.bounds\[1, 1\] is -1"),
        ({"bound": [1.1, 1.2], "weft": [1.1, 1.2, 1.3]}, r"limits\.weft: shape \(3,\)"),
        ({"bound": [[1.1]]}, r"limits\.bound: expected 0 or 1 dimensions"),
        ({"bound": np.nan}, r"limits\.bound\[\] is nan"),
        ({"bound": 1.1, "dim": 4}, r"dim is 4: valid are 2, or 3"),
        ({"bound": 1.1, "weft": 1.2, "dim": 3}, r"dim is 3: valid are 2, or 3 without a weft"),
    ],
)
def test_bad_exact_limits_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        StretchLimits.exact(**arguments)


def test_exact_limits_are_given_on_the_material_axes():
    with pytest.raises(ValueError, match="material axes"):
        StretchLimits(np.eye(2)[::-1], np.array([1.1, 1.1]), spectral=True)
    np.testing.assert_array_equal(StretchLimits.exact([1.1, 1.2]).bounds, [[1.1, 1.1], [1.2, 1.2]])
    np.testing.assert_array_equal(StretchLimits.exact(1.1, 1.3).bounds, [1.1, 1.3])
