"""Fields of any type: set and checked, carried to another process, listed; labels as spelled."""

from __future__ import annotations

import pickle
from pathlib import Path

import pytest

from strainbench.bench.plan import plan
from strainbench.bench.settings import parse_value
from strainbench.cli.listing import described, found, tables
from strainbench.scenario.registry import list_scenarios
from strainbench.solver.registry import list_solvers
from tests.command import command

ODD = '''
from __future__ import annotations

import enum
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from strainbench import Solution, Solver

if TYPE_CHECKING:
    from nowhere import Number, Thing


class Kind(enum.Enum):
    WARP = "warp"
    WEFT = 2


@dataclass(frozen=True)
class Odd(Solver):
    """Odd (nobody)."""

    name = "odd"
    file: Path = Path("x")
    kind: Kind = Kind.WARP
    mode: Literal["a", "b", 3, None] = "a"
    pair: tuple[int, float] = (1, 2.0)
    words: list[str] = field(default_factory=lambda: ["a"])
    table: dict = field(default_factory=lambda: {"a": 1})
    array: np.ndarray = field(default_factory=lambda: np.zeros(3))
    thing: object = field(default_factory=lambda: print)
    half: float = np.float64(0.5)
    three: int = np.int64(3)
    number: Number = 2.5
    unknown: Thing = None
    one: float = 1

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        return Solution(problem.target, "solved", 1)
'''


@pytest.fixture
def odd(tmp_path):
    path = tmp_path / "odd.py"
    path.write_text(ODD)
    return str(path)


def planned(path, *settings):
    words = [f"odd.{setting}" for setting in settings]
    return plan(["swing"], [path], words, "simulate", 1, [1e-6], None)


def test_a_solver_with_any_default_is_planned_and_carried(odd):
    (cell,) = planned(odd)
    assert cell.solver.label == "odd"
    there = pickle.loads(pickle.dumps(cell)).solver.solver()
    here = cell.solver.solver()
    for name in ("half", "three", "pair", "words", "table", "mode", "one"):
        assert getattr(there, name) == getattr(here, name)
    assert planned(odd)[0].key == cell.key


@pytest.mark.parametrize(
    ("setting", "value"),
    [
        ("file=a/b", Path("a/b")),
        ("mode=3", 3),
        ("mode=none", None),
        ("pair=3:1%", (3, 0.01)),
        ("words=a:b", ["a", "b"]),
        ("number=4", 4.0),
        ("half=1%", 0.01),
    ],
)
def test_a_value_is_set_and_survives_the_way_to_a_process(odd, setting, value):
    (cell,) = planned(odd, setting)
    name = setting.partition("=")[0]
    found = getattr(pickle.loads(pickle.dumps(cell)).solver.solver(), name)
    assert (found, type(found)) == (value, type(value))
    assert cell.solver.label == f"odd[{setting}]"


@pytest.mark.parametrize("word", ["WEFT", "2"])
def test_an_enum_is_set_by_name_or_value(odd, word):
    assert planned(odd, f"kind={word}")[0].solver.solver().kind.name == "WEFT"


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("table=1", "table of odd in .*odd.py is a dict; valid are int"),
        ("array=1", "array of odd in .*odd.py is a ndarray"),
        ("unknown=1", "unknown of odd in .*odd.py is a value of a type"),
        ("mode=c", "must be one of a, b, 3, none"),
        ("kind=x", "must be one of WARP, WEFT"),
        ("pair=1", "must be int:float"),
        ("pair=1:x", "must be int:float"),
        ("half=x", "must be float"),
    ],
)
def test_what_cannot_be_set_is_one_line(odd, setting, words):
    with pytest.raises(ValueError, match=words) as caught:
        planned(odd, setting)
    assert "\n" not in str(caught.value)


def test_other_spellings_are_the_same_cell_and_all_labels_show_what_was_set(odd):
    keys = {planned(odd, f"one={word}")[0].key for word in ("1", "1.0", "100%")}
    assert keys == {planned(odd)[0].key}
    labels = [cell.solver.label for cell in planned(odd, "one=1,1.5")]
    assert labels == ["odd[one=1]", "odd[one=1.5]"]
    setting = "gauss-seidel.max_sweeps=100,100000"
    cells = plan(["swing"], ["gauss-seidel"], [setting], "simulate", 1, [1e-6], None)
    assert [cell.solver.label for cell in cells] == [
        "gauss-seidel[max_sweeps=100]",
        "gauss-seidel[max_sweeps=100000]",
    ]
    (default,) = plan(["swing"], ["gauss-seidel"], [], "simulate", 1, [1e-6], None)
    assert (default.solver.label, default.key) == ("gauss-seidel", cells[1].key)


def test_a_scene_is_named_by_all_digits():
    settings = ["step=0.01666,0.016664", "limit=1.00001%"]
    cells = plan(["swing"], ["none"], settings, "simulate", 1, [1e-6], None)
    assert [cell.scenario.label for cell in cells] == [
        "swing 20 at 1.00001%, step=0.01666",
        "swing 20 at 1.00001%, step=0.016664",
    ]


@pytest.mark.parametrize(("hint", "text", "value"), [(int | float, "1.0", 1), (str, "a:b", "a:b")])
def test_values_are_of_the_narrowest_type(hint, text, value):
    found = parse_value("x", "key", hint, text)
    assert (found, type(found)) == (value, type(value))


# --- what plug-ins' files do


def test_two_folders_have_helpers_of_their_own(odd, tmp_path):
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "helper.py").write_text(f"WORD = {folder!r}")
        text = ODD.replace('"odd"', f'"{folder}"').replace(
            "        return Sol", "        from helper import WORD\n        raise OSError(WORD)\n#"
        )
        (tmp_path / folder / "mine.py").write_text(
            "from helper import WORD\n"
            + text.replace("from __future__ import annotations\n", "")
            .replace("number: Number", "number: float")
            .replace("unknown: Thing", "unknown: object")
        )
    paths = [str(tmp_path / f / "mine.py") for f in ("one", "two")]
    cells = plan(["swing"], paths, [], "simulate", 1, [1e-6], None)
    solvers = [cell.solver.solver() for cell in cells]
    for solver in (*solvers, solvers[0]):
        with pytest.raises(OSError, match=solver.name):
            solver.solve(None, None, tolerance=1, monitor=None, deadline=None)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("import sys; sys.exit('no')", r"does not import: SystemExit: no \(line 1\)"),
        ("x = 1\ndef f(:", r"SyntaxError: .*line 2"),
        ("raise BaseException('a\\nb')", "BaseException: a b"),
        (ODD.replace('name = "odd"', 'name = " "'), "has no name"),
        (ODD.replace("def solve", "label = property(lambda s: 1 / 0)\n    def solve"), "ZeroDiv"),
        (ODD.replace("one: float = 1", "one: float"), "does not import: TypeError|needs a default"),
        (ODD.replace("def solve", "def salve"), "Odd lacks solve"),
    ],
)
def test_a_file_that_cannot_be_used_is_one_line(odd, text, words):
    Path(odd).write_text(text)
    with pytest.raises(ValueError, match=words) as caught:
        planned(odd)
    assert odd in str(caught.value)
    assert "\n" not in str(caught.value)


# --- list


def test_every_field_of_ours_is_documented():
    names = [e.name for e in (*list_solvers(), *list_scenarios()) if not e.unavailable]
    for name in names:
        (plugin,) = found(name)
        assert [f.name for f in described(plugin) if not f.about] == [], name


@pytest.mark.parametrize(
    ("scene", "units"),
    [
        ("swing", {"step": "s", "offset": "degrees"}),
        ("collision", {"step": "s", "stiffness": "N/m", "margin": "m", "floor": "m"}),
        ("flag", {"step": "s", "wind": "m/s", "drag": "N s/m^3"}),
        ("twist", {"turn_rate": "degrees/s", "step": "s"}),
    ],
)
def test_fields_have_units(scene, units):
    (plugin,) = found(scene)
    assert {f.name: f.unit for f in described(plugin) if f.unit} == units


@pytest.mark.parametrize("word", [(), ("swing",), ("clarabel-paper",), ("none",)])
def test_a_list_fits_80_columns(word, monkeypatch, capsys):
    done = command(monkeypatch, capsys, "list", *word, width=80)
    assert done.returncode == 0
    assert max(map(len, done.stdout.splitlines())) <= 80
    if not word:
        for entry in (*list_solvers(), *list_scenarios()):
            assert f" {entry.name} " in done.stdout


def test_a_list_names_nothing_else():
    with pytest.raises(ValueError, match=r"list swin: valid are .*did you mean swing"):
        list(tables("swin"))
