"""Folders of instances: what is in them, that they resume, that they are the same again."""

from __future__ import annotations

import csv
import hashlib
from importlib.resources import files

import numpy as np
import pytest

from strainbench import certify
from strainbench.bench.plan import plan_one
from strainbench.bench.recording import record, record_all, recorder
from strainbench.export import load_problem
from strainbench.problem.dual import dual_bound
from strainbench.studies.testset.certificates import AIM, certified
from strainbench.studies.testset.collection import COLUMNS, Collection, Wanted
from strainbench.studies.testset.ours import SMALL, our_set
from tests.command import command

SCENES = {
    "hanging": ("swing", ["resolution=4"], 6),
    "exact": ("stretch-square", ["resolution=3", "directions=exact"], 1),
    "torn": ("twist", ["resolution=4", "turn_rate=1200"], 1),
    "torn-odd": ("twist", ["resolution=5", "turn_rate=977.8"], 1),
    "squeezed": ("stretch-square", ["resolution=2", "compression=10%"], 1),
}
SOLVERS = {"squeezed": "gauss-seidel"}  # those that take lower bounds


def wanted(*names):
    return [
        Wanted(name, plan_one(scene, SOLVERS.get(name, "newton-ipm"), settings, 9, 1e-6), frame)
        for name, (scene, settings, frame) in SCENES.items()
        if name in names
    ]


def index(folder):
    return list(csv.DictReader((folder / "index.csv").read_text().splitlines()))


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A collection, and its index by name."""
    found = Collection(tmp_path_factory.mktemp("set"), "A set | of *tests*", wanted(*SCENES))
    list(found.write(record_all))
    return found, {row["name"]: row for row in index(found.folder)}


def test_the_index_has_what_the_files_have(made):
    found, rows = made
    assert tuple(rows["hanging"]) == COLUMNS
    assert list(rows) == list(SCENES)
    for name, row in rows.items():
        problem = load_problem(found.folder / f"{name}.npz")
        assert int(row["variables"]) == 3 * len(problem.free)
        assert int(row["constraints"]) == problem.constraints
        for path, column in (
            (f"{name}.npz", "npz_sha256"),
            (f"{name}.cbf", "cbf_sha256"),
            (f"optima/{name}.npz", "optimum_sha256"),
        ):
            if row[column]:
                content = (found.folder / path).read_bytes()
                assert hashlib.sha256(content).hexdigest() == row[column]
    assert rows["squeezed"]["cbf_sha256"] == ""
    assert {name: row["status"] for name, row in rows.items()} == {
        **dict.fromkeys(("hanging", "exact"), "optimal"),
        **dict.fromkeys(("torn", "torn-odd"), "infeasible"),
        "squeezed": "local",
    }


@pytest.mark.parametrize("name", ["hanging", "exact"])
def test_a_certificate_holds_by_its_own_formula(name, made):
    found, rows = made
    problem = load_problem(found.folder / f"{name}.npz")
    with np.load(found.folder / f"optima/{name}.npz") as data:
        x, Y = data["positions"], data["multipliers"]
    assert not np.any(problem.violations(x))
    back = (problem.G.T @ Y)[problem.free] ** 2 / problem.weights[problem.free, None]
    pull = np.sum(Y * (problem.G @ problem.target))
    bound = pull - 0.5 * back.sum() - problem.bounds @ problem.dual_norms(Y)
    optimum = problem.objective(x)
    assert bound == pytest.approx(float(rows[name]["lower_bound"]), rel=1e-9)
    assert bound <= optimum <= bound * (1 + AIM)
    assert optimum == float(rows[name]["optimum"])
    assert certify(problem, x).outcome == "optimal"


def test_infeasible_ones_are_shown_to_be(made):
    found, rows = made
    assert "m apart" in rows["torn"]["reason"]
    assert load_problem(found.folder / "torn.npz").infeasible_pins()
    odd = load_problem(found.folder / "torn-odd.npz")
    assert odd.infeasible_pins() is None
    with np.load(found.folder / "optima/torn-odd.npz") as data:
        assert dual_bound(odd, data["multipliers"])[0] > odd.largest_objective
    assert rows["torn-odd"]["optimum"] == ""


def test_beside_them_lie_readme_licence_and_citation(made):
    found, _ = made
    readme = (found.folder / "README.md").read_text()
    assert readme.startswith("# A set \\| of \\*tests\\*\n")
    assert "| torn | twist 4 at 1%, turn\\_rate=1200 |" in readme.replace(
        "turn_rate", "turn\\_rate"
    )
    assert "BSD" in (found.folder / "LICENSE").read_text()
    assert "type: dataset" in (found.folder / "CITATION.cff").read_text()


def test_what_is_there_is_not_made_again_and_what_was_spoilt_is(made, tmp_path):
    collection = Collection(tmp_path, "twice", wanted("hanging", "exact"))
    assert len(collection.missing()) == 2
    making = collection.write(record_all)
    next(making)
    making.close()  # as an interrupt would
    assert [w.name for w in collection.missing()] == ["exact"]
    (row,) = collection.write(record_all)
    assert row["name"] == "exact"
    assert list(collection.write(record_all)) == []
    for name in ("hanging.npz", "exact.cbf", "optima/exact.npz"):
        first = (made[0].folder / name).read_bytes()
        assert (tmp_path / name).read_bytes() == first  # bit for bit
    (tmp_path / "exact.cbf").write_text("spoilt")
    assert [w.name for w in collection.missing()] == ["exact"]
    scaled = Collection(tmp_path, "twice", wanted("hanging"), scaled=True)
    assert [w.name for w in scaled.missing()] == ["hanging"]
    (tmp_path / "index.csv").write_text("nonsense\n1\n")
    assert len(collection.missing()) == 2


def test_a_feasible_target_is_its_own_optimum():
    problem = record(recorder(plan_one("swing", "none", ["resolution=3"], 1, 1e-6)), 1)
    found = certified(problem)
    assert (found.status, found.objective, found.gap) == ("optimal", 0.0, 0.0)


def test_ours_has_the_range_that_it_promises():
    text = (files("strainbench.studies.testset") / "ours.csv").read_text()
    sizes = {row["name"]: int(row["variables"]) for row in csv.DictReader(text.splitlines())}
    everything = our_set(small=False)
    assert list(sizes) == [w.name for w in everything]
    assert len(sizes) >= 40
    assert min(sizes.values()) <= 110
    assert max(sizes.values()) == 120_000
    limits = [dict(w.cell.scenario.parameters)["limit"] for w in everything]
    assert min(limits) == 0.0001
    assert max(limits) >= 0.2
    small = {w.name: w for w in our_set(small=True)}
    assert set(small) == {name for name, size in sizes.items() if size <= SMALL}
    assert len(small) >= 40
    for name in ("swing-5", "square-20", "skirt-6", "twist-5-beyond", "flag-20"):
        assert 3 * len(small[name].cell.scenario.scenario().problem().free) == sizes[name]


# --- the verbs


def test_export_of_several_frames_and_scenes(monkeypatch, capsys, tmp_path):
    words = ["export", "swing", "stretch-square", "--set", "resolution=2", "-o", tmp_path / "d"]
    done = command(monkeypatch, capsys, *words, "--frame", "1-6", "--every", "3")
    assert done.returncode == 0, done.stderr
    names = [row["name"] for row in index(tmp_path / "d")]
    scenes = "swing-2-at-1pct", "stretch-square-2-at-1pct"
    assert names == [f"{scene}-{k:03d}" for scene in scenes for k in (3, 6)]
    third = record(plan_one("swing", "newton-ipm", ["resolution=2"], 6, 1e-6), 3)
    again = load_problem(tmp_path / "d/swing-2-at-1pct-003.npz")
    assert np.array_equal(again.target, third.target)
    done = command(monkeypatch, capsys, *words, "--frame", "1-6", "--every", "3")
    assert "4 of 4 instances are there" in done.stdout


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["--frame", "1-3", "--every", "4"], "--every 4: --frame 1-3 has fewer"),
        (["--frame", "3-1"], "--frame 3-1: whole numbers above 0 and ranges are valid"),
        (["--frame", "1,x"], "--frame 1,x: whole numbers"),
        (["--frame", "1,2", "-o", "x.npz"], "several projections are files of a folder"),
        (["--frame", "1,2", "--format", "mps"], "--format mps: valid are cbf, npz"),
        (["--frame", "1,2", "--format", "npz", "--scaled"], "--format cbf is valid"),
        (["--frame", "1", "-o", "x.npz", "--scaled"], "--scaled: --format cbf is valid"),
        (["--frame", "1,2", "-o", "file"], "file/optima cannot be written to"),
    ],
)
def test_a_wrong_word_is_one_line(words, line, monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("")
    place = [] if "-o" in words else ["-o", "d"]
    small = ["--set", "resolution=2"]
    done = command(monkeypatch, capsys, "export", "swing", *small, *place, *words)
    assert done.returncode == 2
    assert line in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
