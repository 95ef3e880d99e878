"""Exported projections, read back by readers that know nothing of us."""

from __future__ import annotations

import re
from io import BytesIO
from itertools import islice
from zipfile import ZIP_DEFLATED, ZipFile

import clarabel
import numpy as np
import pytest
import scipy.sparse as sp

from strainbench import Problem, StretchLimits, certify, solve
from strainbench.bench.plan import plan_one
from strainbench.bench.recording import record
from strainbench.problem.export import FORMATS, as_npz, load_problem, write_problem
from strainbench.referee.reference import content_key
from tests.cli.test_cli import strainbench
from tests.problems import random_problem

FRAME = 5


@pytest.fixture(scope="module")
def swing():
    return record(plan_one("swing", "clarabel", ["resolution=5"], 1, 1e-6), FRAME)


def read_cbf(path):
    """Objective c, and A, b, cones with A z + s = b, as the mosek package reads a CBF file."""
    mosek = pytest.importorskip("mosek", reason="needs the mosek package, which reads CBF")
    with mosek.Task() as task:
        task.readdata(str(path))
        assert task.getobjsense() == mosek.objsense.minimize
        assert task.getnumcon() == 0
        c = np.array(task.getc())
        rows, columns, values = task.getaccftrip()
        size = task.getaccntot(), task.getnumvar()
        constants, domains = np.array(task.getaccgvector()), []
        for i in range(task.getnumacc()):
            domains.append((task.getdomaintype(task.getaccdomain(i)), task.getaccn(i)))
    blocks, cones = [], []
    for kind, n in domains:
        T = np.eye(n)
        cone = clarabel.SecondOrderConeT(n)
        if kind == mosek.domaintype.rquadratic_cone:  # 2 s t >= |v|^2
            T[:2, :2] = np.array([[1, 1], [1, -1]]) / np.sqrt(2)
        elif kind == mosek.domaintype.svec_psd_cone:  # lower triangles by column: upper ones
            order = round((np.sqrt(8 * n + 1) - 1) / 2)
            i, j = np.triu_indices(order)  # by row
            T = T[np.lexsort((i, j))]
            cone = clarabel.PSDTriangleConeT(order)
        else:
            assert kind == mosek.domaintype.quadratic_cone
        blocks.append(sp.csc_array(T))
        cones.append(cone)
    T = sp.block_diag(blocks, format="csc")
    F = sp.csc_array((values, (rows, columns)), shape=size)
    return c, -(T @ F), T @ constants, cones


def optimum(c, A, b, cones, scale, P=None):
    """Optimal value and point of a cone program, its objective times `scale` on the way."""
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-10
    P = sp.csc_matrix((len(c), len(c))) if P is None else sp.csc_matrix(scale * P)
    solver = clarabel.DefaultSolver(P, scale * c, sp.csc_matrix(A), b, cones, settings)
    result = solver.solve()
    return result.obj_val / scale, np.array(result.x)


def scale_of(problem):
    """Brings the objective to order one."""
    return 100 / (problem.edge_length**2 * float(problem.weights.mean()))


def exact(problem, *bounds):
    """The same problem with an exact limit."""
    limits = StretchLimits.exact(*bounds)
    return Problem(
        problem.rest, problem.elements, problem.target, limits, problem.pinned, problem.mass
    )


def cases(swing):
    """Sampled and exact limits, with pins and masses and without."""
    rng = np.random.default_rng(0)
    draws = [random_problem(rng, directions=4) for _ in range(3)]
    small = random_problem(rng, vertices=16, limit=0.05)
    return [swing, *draws, exact(small, 1.03), exact(small, 1.02, 1.3)]


@pytest.mark.parametrize("case", range(6))
def test_cbf_has_the_optimum_of_solve(case, swing, tmp_path):
    problem = cases(swing)[case]
    write_problem(problem, tmp_path / "frame.cbf", "cbf", "a test")
    value, z = optimum(*read_cbf(tmp_path / "frame.cbf"), scale_of(problem))
    solution = solve(problem, "clarabel-tight", tolerance=1e-7)
    assert value == pytest.approx(problem.objective(solution.positions), rel=1e-6)
    moved = (solution.positions - problem.target)[problem.free]
    assert z[:-1].reshape(-1, 3) == pytest.approx(moved, abs=1e-3 * problem.edge_length)


def solved_by_defaults(path):
    """What Clarabel's defaults make of a file."""
    c, A, b, cones = read_cbf(path)
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    nothing = sp.csc_matrix((len(c), len(c)))
    result = clarabel.DefaultSolver(nothing, c, sp.csc_matrix(A), b, cones, settings).solve()
    assert str(result.status) == "Solved"
    return result


def numbers_of(text, pattern):
    return float(re.search(pattern, text)[1])


@pytest.mark.parametrize("case", range(6))
def test_a_scaled_cbf_is_solved_by_defaults_and_says_how_to_map_back(case, swing, tmp_path):
    problem = cases(swing)[case]
    write_problem(problem, tmp_path / "a.cbf", "cbf", "a test", scaled=True)
    result = solved_by_defaults(tmp_path / "a.cbf")
    text = (tmp_path / "a.cbf").read_text()
    unit = numbers_of(text, r"x = target \+ (\S+) u")
    factor = numbers_of(text, r"# objective in .*: (\S+) t")
    solution = solve(problem, "clarabel-tight", tolerance=1e-7)
    assert factor * result.obj_val == pytest.approx(problem.objective(solution.positions), rel=1e-4)
    moved = (solution.positions - problem.target)[problem.free]
    u = np.array(result.x)[:-1].reshape(-1, 3)
    assert unit * u == pytest.approx(moved, abs=1e-2 * problem.edge_length)


HARD = [
    ("swing", ["resolution=10", "limit=0.1%"], 8),
    ("stress", ["case=mass-ratio"], 1),
    ("swing", ["resolution=20"], 8),
    ("garment", ["resolution=6"], 8),
]


@pytest.mark.slow
@pytest.mark.parametrize(("scene", "settings", "frame"), HARD)
def test_scaled_files_of_scenes_are_solved_by_defaults(scene, settings, frame, tmp_path):
    problem = record(plan_one(scene, "newton-ipm", settings, 1, 1e-6), frame)
    write_problem(problem, tmp_path / "a.cbf", "cbf", "a test", scaled=True)
    assert solved_by_defaults(tmp_path / "a.cbf").iterations < 60


@pytest.mark.parametrize("seed", range(3))
def test_npz_is_the_same_problem(seed, tmp_path):
    problem = random_problem(np.random.default_rng(seed), mass=seed > 0)
    write_problem(problem, tmp_path / "frame.npz", "npz", "a test")
    again = load_problem(tmp_path / "frame.npz")
    assert content_key(again) == content_key(problem)
    assert (again.mass is None) == (problem.mass is None)
    assert again.rest == pytest.approx(problem.rest, abs=0)
    same = solve(problem, "gauss-seidel").positions
    assert np.array_equal(solve(again, "gauss-seidel").positions, same)


def test_npz_of_seams_and_of_exact_limits(rng, tmp_path):
    flat = random_problem(rng, directions=4)
    sewn = Problem(
        flat.rest[flat.elements], flat.elements, flat.target, flat.limits, flat.pinned, flat.mass
    )
    for problem in (sewn, exact(sewn, 1.02, 1.1)):
        write_problem(problem, tmp_path / "frame.npz", "npz", "a test")
        again = load_problem(tmp_path / "frame.npz")
        assert content_key(again) == content_key(problem)
        assert again.limits.spectral == problem.limits.spectral


@pytest.mark.parametrize("case", [0, 1, 4])
def test_npz_has_the_cone_program_in_plain_arrays(case, swing, tmp_path):
    problem = cases(swing)[case]
    path = tmp_path / "frame.npz"
    path.write_bytes(as_npz(problem, "a test"))
    with np.load(path, allow_pickle=False) as data:
        d = dict(data)
    G, P, A = (
        sp.csr_array((d[f"{n}_data"], d[f"{n}_indices"], d[f"{n}_indptr"]), d[f"{n}_shape"])
        for n in "GPA"
    )
    assert np.array_equal(G.toarray(), problem.G.toarray())
    assert np.array_equal(d["bounds"], problem.bounds)
    kind = {
        "second-order": clarabel.SecondOrderConeT,
        "semidefinite": clarabel.PSDTriangleConeT,
    }[str(d["cone"])]
    cones = [kind(int(d["cone_order"]))] * int(d["cone_count"])
    value, u = optimum(d["q"], A, d["b"], cones, scale_of(problem), P)
    x = d["target"].copy()
    x[d["free"]] += u.reshape(-1, 3)
    assert value == pytest.approx(problem.objective(x), rel=1e-6)
    answer = solve(problem, "clarabel-tight", tolerance=1e-7)
    assert value == pytest.approx(problem.objective(answer.positions), rel=1e-6)


def test_a_frame_is_the_kth_candidate():
    cell = plan_one("swing", "none", ["resolution=2", "integrator=sar"], 1, 1e-6)
    candidates = []

    def project(target):
        candidates.append(target)
        return target

    list(islice(cell.scenario.scenario().play(project), 2))
    assert len(candidates) == 4  # two each step
    for k, candidate in enumerate(candidates, start=1):
        assert np.array_equal(record(cell, k).target, candidate)


SHORT = """
from strainbench import Solution, Solver
from strainbench.scenario.scenario import SheetScenario, StepReport
from scenarios.stretch_square import StretchSquare
import numpy as np
class Short(StretchSquare):
    "Two projections (nobody)"
    name = "short"
    def play(self, project):
        for _ in range(2):
            project(self.sheet()[2])
            yield StepReport()
class Lost(Solver):
    "No answer (nobody)"
    name = "lost"
    def solve(self, problem, state, **_):
        return Solution(np.full_like(problem.target, np.nan), "lost the way", 0)
"""


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["short.py", "--frame", "3"], "--frame 3: short asks for 2 projections, so 1 to 2 are"),
        (["swing", "--frame", "0"], "--frame 0: a whole number above 0 is valid"),
        (["swing", "--frame", "2", "--format", "mps"], "--format mps: valid are cbf, npz"),
        (["swing", "--frame", "2", "--solver", "short.py"], "lost has no answer to projection 1"),
        (["swing", "--frame", "1", "--solver", "none,gauss-seidel"], "give 2 solvers"),
        (["swing", "--frame", "1", "--set", "limit=1%,2%"], "give 2 scenes"),
        (["swing", "--frame", "1", "-o", "short.py/x.cbf"], "cannot be written to"),
    ],
)
def test_a_wrong_word_is_one_line(words, line, tmp_path):
    (tmp_path / "short.py").write_text(SHORT)
    target = [] if "-o" in words else ["-o", "frame.cbf"]
    small = ["--set", "resolution=2"]
    done = strainbench("export", *words, *small, *target, cwd=tmp_path)
    assert done.returncode == 2
    assert line in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_a_file_that_is_no_exported_problem(tmp_path):
    (tmp_path / "a.npz").write_bytes(b"PK but not a zip")
    (tmp_path / "b.npz").write_bytes(b"text")
    np.savez(tmp_path / "c.npz", rest=np.zeros(3))
    np.save(tmp_path / "d.npy", np.zeros(3))
    for name in ("a.npz", "b.npz", "c.npz", "d.npy", "missing.npz"):
        with pytest.raises(ValueError, match=name):
            load_problem(tmp_path / name)


@pytest.mark.parametrize("kind", FORMATS)
def test_the_same_problem_gives_the_same_bytes(kind, swing):
    assert FORMATS[kind](swing, "twice") == FORMATS[kind](swing, "twice")


# --- round trips, and files that are damaged or hostile


def drawn(seed):
    """A problem of each kind that there is: lower bounds, by element, seams, exact, masses."""
    rng = np.random.default_rng(seed)
    flat = random_problem(rng, exact=seed % 3 == 0, per_element=seed % 2 == 0, mass=seed % 4 > 1)
    limits = flat.limits
    if not limits.spectral and seed % 3 == 1:
        limits = StretchLimits(limits.directions, limits.bounds, lower=0.9 * limits.bounds)
    rest = flat.rest[flat.elements] if seed % 5 == 0 else flat.rest
    return Problem(rest, flat.elements, flat.target, limits, flat.pinned, flat.mass), rng


@pytest.mark.parametrize("seed", range(12))
def test_what_is_loaded_is_judged_the_same(seed, tmp_path):
    problem, rng = drawn(seed)
    write_problem(problem, tmp_path / "a.npz", "npz", "a test")
    again = load_problem(tmp_path / "a.npz")
    x = problem.target + 0.3 * problem.edge_length * rng.normal(size=problem.target.shape)
    assert again.convex == problem.convex
    assert np.array_equal(again.violations(x), problem.violations(x))
    assert again.objective(x) == problem.objective(x)
    assert np.array_equal(again.pinned, problem.pinned)
    assert np.array_equal(again.rest, problem.rest)
    x[problem.pinned] = problem.target[problem.pinned]
    if problem.convex:
        one, two = certify(problem, x), certify(again, x)
        assert (one.outcome, one.lower_bound) == (two.outcome, two.lower_bound)
    write_problem(again, tmp_path / "b.npz", "npz", "a test")
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.npz", "b.npz"]


def test_cbf_refuses_lower_bounds(tmp_path):
    problem = drawn(1)[0]
    assert not problem.convex
    with pytest.raises(ValueError, match=r"--format cbf: limits on compression .* npz is valid"):
        write_problem(problem, tmp_path / "a.cbf", "cbf", "a test")
    assert list(tmp_path.iterdir()) == []


def members(path):
    with ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def header(shape, dtype="<f8"):
    stream = BytesIO()
    facts = {"descr": dtype, "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_1_0(stream, facts)
    return stream.getvalue()


def saved(array):
    stream = BytesIO()
    np.save(stream, array, allow_pickle=True)
    return stream.getvalue()


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("target", header((10**12,)) + bytes(8)),
        ("target", header((-1, 3))),
        ("target", header((10**12, 3), "|O")),
        ("target", b"junk"),
        ("target", saved(np.full((4, 3), np.nan))),
        ("target", saved(np.array(["a"]))),
        ("target", saved(np.array([None]))),
        ("elements", saved(np.zeros((2, 3)))),
        ("elements", saved(np.full((2, 3), 99999))),
        ("limit_spectral", saved(np.array("False"))),
        ("limit_lower", saved(np.array(2.0))),
        ("pinned", None),
    ],
)
def test_a_hostile_array_is_one_line(tmp_path, name, content):
    path = tmp_path / "a.npz"
    write_problem(drawn(2)[0], path, "npz", "a test")
    parts = members(path)
    with ZipFile(path, "w") as archive:
        for member, data in parts.items():
            if member != f"{name}.npy":
                archive.writestr(member, data)
        if content is not None:
            archive.writestr(f"{name}.npy", content)
    with pytest.raises(ValueError, match=r"a\.npz holds no exported problem") as error:
        load_problem(path)
    assert "\n" not in str(error.value)


def test_an_archive_that_claims_more_than_it_holds(tmp_path):
    path = tmp_path / "a.npz"
    write_problem(drawn(2)[0], path, "npz", "a test")
    parts = members(path)
    huge = 8 * 10**8
    with ZipFile(path, "w", ZIP_DEFLATED) as archive:
        for member, data in parts.items():
            archive.writestr(member, data)
    with ZipFile(path) as archive:
        info = next(i for i in archive.infolist() if i.filename == "target.npy")
        old = info.file_size.to_bytes(4, "little")
    path.write_bytes(path.read_bytes().replace(old, huge.to_bytes(4, "little")))
    with pytest.raises(ValueError, match=r"a\.npz"):
        load_problem(path)


def test_a_file_cut_or_changed_anywhere_is_one_line_or_the_problem(tmp_path):
    problem, rng = drawn(2)
    path = tmp_path / "a.npz"
    write_problem(problem, path, "npz", "a test")
    content = path.read_bytes()
    for _ in range(60):
        at = int(rng.integers(len(content)))
        cut = bytes([content[at] ^ int(rng.integers(1, 256))])
        for damaged in (content[:at], content[:at] + cut + content[at + 1 :]):
            path.write_bytes(damaged)
            try:
                again = load_problem(path)
            except ValueError as error:
                assert "a.npz" in str(error)  # noqa: PT017
                assert "\n" not in str(error)  # noqa: PT017
            else:
                assert content_key(again) == content_key(problem)
