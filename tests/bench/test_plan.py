"""From words to cells: settings, the cross product, and one clear line for a wrong word."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from strainbench.bench.cell import Cell, PluginRef
from strainbench.bench.plan import never_warm, plan
from strainbench.bench.recording import recorder
from strainbench.bench.settings import parse_settings, parse_value, split_values
from strainbench.scenario.registry import find_scenario
from strainbench.scenario.scenario import SceneWarning
from strainbench.solver.registry import find_solver

SOLVER = '''
from dataclasses import dataclass

from strainbench import Solution, Solver


@dataclass(frozen=True)
class Mine(Solver):
    """Nothing much (Nobody 2022)."""

    name = "mine"
    sweeps: int = 3
    relax: float = 1.0
    exact: bool = False

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        return Solution(problem.target, "solved", self.sweeps)
'''


@pytest.fixture
def mine(tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(SOLVER)
    return path


def cells(scenarios=("swing",), solvers=("none",), settings=(), **changes):
    given = {"mode": "simulate", "steps": 3, "tolerances": [1e-6], "time_limit": None}
    return plan(scenarios, solvers, settings, **(given | changes))


def parameters(ref):
    return dict(ref.parameters)


# --- words


def test_settings_are_sorted_by_owner_and_key():
    words = ["resolution=10,20", "limit=1%", "clarabel.form=paper", "resolution=40"]
    assert parse_settings(words) == {
        "": {"resolution": ["10", "20", "40"], "limit": ["1%"]},
        "clarabel": {"form": ["paper"]},
    }


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("1%,2%", ["1%", "2%"]),
        ('"a,b.obj"', ["a,b.obj"]),
        ('"a, b.obj",c d.obj', ["a, b.obj", "c d.obj"]),
        ('"say ""x"".obj"', ['say "x".obj']),
        ('5" wide.obj', ['5" wide.obj']),
    ],
)
def test_values_lie_between_commas_but_for_those_in_quotes(text, values):
    assert split_values(text) == values


@pytest.mark.parametrize("text", ['"a,b', '"a"b,c', "a\nb"])
def test_a_quote_that_does_not_end_is_one_line(text):
    with pytest.raises(ValueError, match=r'"V1,V2" for one value with a comma is valid') as error:
        parse_settings([f"path={text}"])
    assert "\n" not in str(error.value)


TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


@pytest.mark.parametrize("name", ["a,b.obj", "a b.obj", "[x].obj", "café, 1%.obj"])
def test_a_file_is_one_value_whatever_its_name(tmp_path, name):
    path = tmp_path / name
    path.write_text(TRIANGLE)
    (cell,) = cells(["garment"], settings=[f"path={path}"])
    assert parameters(cell.scenario)["path"] == str(path)
    (other,) = cells(["garment"], settings=[f'path="{path}"'])
    assert other.key == cell.key


def test_the_home_folder_is_found_and_its_file_part_of_the_cell(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    (tmp_path / "a,b.obj").write_text(TRIANGLE)
    (tmp_path / "c.csv").write_text("angle_degrees,bound\n0,1.1\n90,1.2\n")
    (cell,) = cells(["garment"], settings=["path=~/a,b.obj"])
    assert cell.scenario.content
    assert cell.key == cells(["garment"], settings=[f"path={tmp_path}/a,b.obj"])[0].key
    assert cells(["chainmail"], settings=["curve_file=~/c.csv"])[0].scenario.content


def test_what_a_scene_says_of_its_files_is_said_when_it_is_planned(tmp_path):
    (tmp_path / "two.obj").write_text(TRIANGLE + "f 3 2 1\n")
    with pytest.warns(SceneWarning, match=r"two\.obj: 1 of 2 faces that repeat") as said:
        cells(["garment"], ["none", "clarabel"], settings=[f"path={tmp_path}/two.obj"])
    assert len(said) == 1


def test_an_owner_may_have_hyphens_and_a_value_an_equals_sign():
    assert parse_settings(["gauss-seidel.max_sweeps=5"]) == {"gauss-seidel": {"max_sweeps": ["5"]}}
    assert parse_settings(["a.b=c=d"]) == {"a": {"b": ["c=d"]}}


@pytest.mark.parametrize("word", ["resolution", "=10", "resolution=", "swing.=3", ""])
def test_a_setting_needs_a_key_and_a_value(word):
    with pytest.raises(ValueError, match="KEY=VALUE") as caught:
        parse_settings([word])
    assert word in str(caught.value)


@pytest.mark.parametrize(
    ("hint", "text", "value"),
    [
        (int, "10", 10),
        (float, "0.01", 0.01),
        (float, "1%", 0.01),
        (float, "0.1%", 0.001),
        (float, "1e-3", 1e-3),
        (float, "20", 20.0),
        (bool, "true", True),
        (bool, "False", False),
        (str, "paper", "paper"),
        (float | None, "none", None),
        (float | None, "None", None),
        (float | None, "2", 2.0),
        (int | None, "2", 2),
        (str, "none", "none"),
    ],
)
def test_a_value_has_the_type_of_its_field(hint, text, value):
    found = parse_value("swing", "key", hint, text)
    assert found == value
    assert type(found) is type(value)


@pytest.mark.parametrize(
    ("hint", "text", "words"),
    [
        (int, "ten", "int"),
        (int, "1.5", "int"),
        (int, "10%", "int"),
        (float, "one", "float"),
        (float, "%", "float"),
        (bool, "1", "bool"),
        (float | None, "nothing", "float or none"),
        (int, "", "int"),
    ],
)
def test_a_wrong_value_is_one_line_that_says_what_is_valid(hint, text, words):
    with pytest.raises(ValueError, match=f"must be {words}") as caught:
        parse_value("swing", "key", hint, text)
    assert f"swing.key={text}" in str(caught.value)


# --- the cross product


def test_one_word_each_is_one_cell():
    (cell,) = cells()
    assert (cell.scenario.name, cell.solver.name) == ("swing", "none")
    assert (cell.mode, cell.steps, cell.tolerance) == ("simulate", 3, 1e-6)


def test_the_plan_is_the_cross_product_of_all_that_is_given():
    found = cells(
        solvers=["none,clarabel"],
        settings=["resolution=2,4", "limit=1%,10%", "clarabel.scaling=none,1,4"],
        tolerances=[1e-3, 1e-6],
    )
    assert len(found) == (2 * 2) * (1 + 3) * 2
    assert len({c.key for c in found}) == len(found)
    assert {parameters(c.scenario)["limit"] for c in found} == {0.01, 0.1}
    assert {parameters(c.scenario)["resolution"] for c in found} == {2, 4}


def test_a_duration_gives_each_step_size_its_number_of_steps():
    found = cells(settings=["step=0.01,0.0166666667,0.1,0.8"], duration=0.5)
    assert [c.steps for c in found] == [50, 30, 5, 1]
    assert [cells(settings=["step=0.3"], duration=d)[0].steps for d in (0.01, 0.5)] == [1, 2]


def test_a_setting_with_an_owner_touches_nobody_else():
    (none, *clarabel) = cells(solvers=["none", "clarabel"], settings=["clarabel.form=paper"])
    assert none.solver.parameters == ()
    assert [parameters(c.solver)["form"] for c in clarabel] == ["paper"]


def test_a_scenarios_own_setting_goes_before_a_shared_one():
    (cell,) = cells(settings=["resolution=2", "swing.resolution=3"])
    assert parameters(cell.scenario)["resolution"] == 3


def test_a_variant_keeps_its_settings_where_others_are_set():
    (cell,) = cells(solvers=["clarabel-paper"], settings=["clarabel.equilibrate=false"])
    changed = {"form": "paper", "scaling": None, "equilibrate": False}
    assert parameters(cell.solver) == find_solver("clarabel").parameters | changed


@pytest.mark.parametrize(
    "words",
    [
        {"solvers": ["none", "none"]},
        {"solvers": ["none,none"]},
        {"settings": ["resolution=3,3"]},
        {"settings": ["limit=1%,0.01"]},
        {"scenarios": ["swing", "swing"]},
        {"tolerances": [1e-6, 1e-6]},
    ],
    ids=str,
)
def test_what_is_given_twice_is_one_cell(words):
    assert len(cells(**words)) == 1


def test_all_is_every_solver_of_ours_once():
    labels = [c.solver.label for c in cells(solvers=["all", "none"])]
    assert len(labels) == len(set(labels))
    assert {"none", "clarabel", "clarabel-default", "clarabel-paper"} <= set(labels)


def test_a_solver_from_a_file_runs_beside_ours(mine):
    found = cells(solvers=[str(mine), "none"], settings=["mine.sweeps=3,5", "mine.exact=true"])
    assert [c.solver.label for c in found] == [
        "mine[sweeps=3,exact=true]",
        "mine[sweeps=5,exact=true]",
        "none",
    ]
    assert found[0].solver.path == str(mine)


# --- one clear line


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ({"scenarios": ["swim"]}, r"no scenario called 'swim'.*swing.*\.py file"),
        ({"solvers": ["clarable"]}, r"no solver called 'clarable'.*clarabel.*\.py file"),
        ({"solvers": ["none,"]}, r"no solver called ''.*clarabel"),
        ({"settings": ["colour=red"]}, r"swing has no setting 'colour'.*resolution.*limit"),
        ({"settings": ["none.k=1"]}, r"none has no setting 'k'"),
        ({"settings": ["clarabel.form=paper"]}, r"'clarabel' is not in this run.*none, swing"),
        ({"settings": ["resolution=ten"]}, r"swing\.resolution=ten: .*int"),
        ({"settings": ["resolution=0"]}, r"swing: resolution is 0"),
        ({"settings": ["limit=1"]}, r"swing: limit is 1\.0.*0\.01 or 1%"),
        ({"settings": ["limit=nan"]}, r"swing: limit is nan"),
        ({"settings": ["directions=0"]}, r"swing: directions is 0"),
        ({"settings": ["step=0"]}, r"swing: step is 0"),
        ({"settings": ["step=inf"]}, r"swing: step is inf"),
        ({"settings": ["integrator=rk4"]}, r"swing: integrator is 'rk4'.*sap"),
        ({"settings": ["norm=max"]}, r"swing: norm is 'max'.*unweighted, mass"),
        ({"settings": ["diagonals=both"]}, r"swing: diagonals is 'both'.*alternating, uniform"),
        ({"mode": "relive"}, r"--mode relive: .*simulate, replay"),
        ({"mode": "simulate:2-3"}, r"--mode simulate:2-3: .*simulate, replay"),
        ({"mode": "replay:3-2"}, r"--frames 3-2: .*14-30"),
        ({"mode": "replay:"}, r"--frames '': .*14-30"),
        ({"mode": "replay:0-2"}, r"--frames 0-2: .*14-30"),
        ({"mode": "replay:2-4", "steps": 9}, r"--frames 2-4 and --steps 9: one of them"),
        ({"mode": "replay:2-4", "steps": None, "duration": 1.0}, r"--frames 2-4 and --duration 1"),
        ({"settings": ["offset=nan"]}, r"swing: offset is nan"),
        ({"settings": ["offset=5", "directions=exact"]}, r"swing: offset is 5.*exact"),
        ({"steps": 0}, r"--steps 0"),
        ({"duration": 0.0}, r"--duration 0"),
        ({"duration": float("inf")}, r"--duration inf"),
        ({"duration": 1.0, "scenarios": ["drape"]}, r"--duration 1: no time passes in drape"),
        ({"tolerances": [0.0]}, r"--tolerance 0"),
        ({"tolerances": [1e-6, float("nan")]}, r"--tolerance nan"),
        ({"tolerances": [float("inf")]}, r"--tolerance inf"),
        ({"time_limit": -1.0}, r"--time-limit -1"),
        ({"time_limit": 0.0}, r"--time-limit 0"),
        ({"solvers": ["nowhere/mine.py"]}, r"nowhere/mine\.py: no such file"),
        ({"scenarios": ["mine.py"]}, r"mine\.py: no such file"),
    ],
)
def test_a_wrong_word_is_one_line_that_says_what_is_valid(words, message):
    with pytest.raises(ValueError, match=message) as caught:
        cells(**words)
    assert "\n" not in str(caught.value)


def test_a_wrong_value_for_a_solver_names_it():
    with pytest.raises(ValueError, match=r"clarabel: form is 'cubic'.*quadratic, paper"):
        cells(solvers=["clarabel"], settings=["clarabel.form=cubic"])


def test_a_solver_that_cannot_be_made_without_settings_is_one_line(mine):
    mine.write_text(SOLVER.replace("sweeps: int = 3", "sweeps: int"))
    with pytest.raises(ValueError, match=r"mine.*sweeps"):
        cells(solvers=[str(mine)])


# --- identity


def test_a_cells_key_knows_all_that_it_measures(mine):
    base = {"solvers": [str(mine)]}
    others = [
        base | {"settings": ["resolution=3"]},
        base | {"settings": ["mine.sweeps=4"]},
        base | {"mode": "replay"},
        base | {"steps": 4},
        base | {"tolerances": [1e-5]},
        {"solvers": ["none"]},
    ]
    keys = [cell.key for words in (base, *others) for cell in cells(**words)]
    assert len(set(keys)) == 7
    assert cells(**base)[0].key == keys[0]


def test_the_time_limit_is_not_part_of_the_key():
    assert cells(time_limit=5.0)[0].key == cells()[0].key


def test_the_default_given_in_words_is_the_same_cell():
    assert cells(settings=["limit=1%", "resolution=20"])[0].key == cells()[0].key


def test_an_edited_file_is_another_cell(mine):
    (cell,) = cells(solvers=[str(mine)])
    before = cell.key
    mine.write_text(SOLVER + "\n# another line\n")
    assert cell.key == before  # what was planned
    assert cells(solvers=[str(mine)])[0].key != before
    mine.write_text(SOLVER)
    assert cells(solvers=[str(mine)])[0].key == before


def test_an_edited_file_that_a_setting_names_is_another_cell(tmp_path):
    curve = tmp_path / "curve.csv"
    keys = set()
    for bound in (1.1, 1.2):
        curve.write_text(f"angle_degrees,bound\n0,{bound}\n45,1.3\n90,1.1\n")
        keys.add(cells(scenarios=["chainmail"], settings=[f"curve_file={curve}"])[0].key)
    assert len(keys) == 2


def test_a_moved_file_is_the_same_cell(mine, tmp_path):
    before = cells(solvers=[str(mine)])[0].key
    (tmp_path / "elsewhere").mkdir()
    (after,) = cells(solvers=[str(mine.rename(tmp_path / "elsewhere" / "other.py"))])
    assert after.key == before


def test_the_recording_does_not_depend_on_the_solver_or_its_tolerance():
    one, two = cells(solvers=["none", "clarabel"], mode="replay")
    assert one.recording_key == two.recording_key
    assert replace(one, tolerance=1e-2, time_limit=1.0).recording_key == one.recording_key
    assert replace(one, steps=9).recording_key != one.recording_key
    (other,) = cells(settings=["resolution=3"])
    assert other.recording_key != one.recording_key


def test_some_frames_of_a_recording_are_a_cell_of_their_own():
    (all_,), (some,) = (
        cells(mode=mode, steps=None, duration=None) for mode in ("replay", "replay:2-4")
    )
    (one,) = cells(mode="replay:4", steps=None)
    assert (some.mode, some.steps, some.window) == ("replay:2-4", 3, (2, 4))
    assert (one.mode, one.window) == ("replay:4-4", (4, 4))
    assert recorder(some).steps == 4
    assert some.key != all_.key
    assert some.recording_key == one.recording_key != all_.recording_key


def test_the_title_tells_what_runs():
    (cell,) = cells(solvers=["clarabel-paper"], settings=["limit=0.1%", "resolution=7"])
    assert cell.title == "swing 7 at 0.1%, clarabel-paper"


@pytest.mark.parametrize("name", ["none", "clarabel", "clarabel-default", "clarabel-paper"])
def test_a_reference_to_a_solver_is_loaded_again(name):
    solver = find_solver(name)
    ref = PluginRef.of(solver)
    assert ref.label == name
    assert ref.solver() == solver


def test_a_reference_to_a_scenario_is_loaded_again():
    scene = find_scenario("swing")(resolution=3, limit=0.05, diagonals="uniform")
    assert PluginRef.of(scene).scenario() == scene


def test_a_reference_to_a_solver_from_a_file_is_loaded_again(mine):
    (cell,) = cells(solvers=[str(mine)], settings=["mine.relax=1.5"])
    solver = cell.solver.solver()
    assert solver.name == "mine"
    assert solver.parameters == {"sweeps": 3, "relax": 1.5, "exact": False}
    assert Path(cell.solver.path).is_absolute()


def test_cells_can_be_counted_and_compared(mine):
    words = {"solvers": [str(mine), "clarabel"]}
    assert set(cells(**words)) == set(cells(**words))
    assert all(isinstance(cell, Cell) for cell in cells(**words))


# --- starts


def labels(solvers, *starts, **changes):
    return [cell.solver.label for cell in cells(solvers=solvers, starts=starts, **changes)]


def test_warm_twins_stand_beside_the_solvers_that_have_one():
    names = ["dykstra-plain", "clarabel"]
    assert labels(names, "cold") == names
    assert labels(names, "cold", "warm") == ["dykstra-plain", "dykstra-plain-warm", "clarabel"]
    assert labels(names, "warm") == ["dykstra-plain-warm"]
    assert never_warm(names) == ["clarabel"]


def test_a_warm_twin_is_found_by_its_name_and_another_cell():
    assert labels(["newton-ipm-warm"], "cold") == ["newton-ipm-warm"]
    assert labels(["newton-ipm-warm", "newton-ipm"], "cold", "warm") == [
        "newton-ipm-warm",
        "newton-ipm",
    ]
    cold, warm = cells(solvers=["newton-ipm"], starts=("cold", "warm"))
    assert cold.key != warm.key
    assert warm.solver.solver() == replace(cold.solver.solver(), warm=True)


def test_a_warm_twin_keeps_the_other_settings():
    settings = ["dykstra.max_sweeps=7"]
    assert labels(["dykstra"], "warm", settings=settings) == ["dykstra[max_sweeps=7]-warm"]


def test_a_file_may_define_a_solver_that_starts_warm(mine):
    mine.write_text(SOLVER.replace("exact: bool", "warm: bool"))
    warm = cells(solvers=[str(mine)], starts=("warm",))[0].solver
    assert (warm.label, warm.solver().warm) == ("mine-warm", True)


@pytest.mark.parametrize("starts", [("hot",), ("cold", ""), ()])
def test_a_wrong_start_is_named(starts):
    with pytest.raises(ValueError, match=r"--start .*cold, warm and cold,warm"):
        cells(starts=starts)


def test_nothing_is_left_to_start_warm():
    with pytest.raises(ValueError, match="none, clarabel cannot start from the frame before"):
        cells(solvers=["none", "clarabel"], starts=("warm",))
