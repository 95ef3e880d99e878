"""Plug-ins: found by name or by file, with the reason where one cannot be used."""

from __future__ import annotations

import importlib
import sys

import pytest

import solvers
from strainbench.bench.plan import plan_solvers
from strainbench.plugins import UnavailableError
from strainbench.scenario.registry import find_scenario, list_scenarios, scenarios_of
from strainbench.solver.registry import find_solver, list_solvers, solvers_of

HEAD = """
from dataclasses import dataclass

from strainbench import Solution, Solver
"""
BODY = '''
@dataclass(frozen=True)
class Mine(Solver):
    """Nothing much (Nobody 2022)."""

    name = "{name}"
    sweeps: int = 3

    def solve(self, problem, state, *, tolerance, monitor, deadline):
        return Solution(problem.target, "solved", self.sweeps)
'''


def write(tmp_path, text, name="mine.py"):
    path = tmp_path / name
    path.parent.mkdir(exist_ok=True)
    path.write_text(text)
    return str(path)


@pytest.fixture
def planted(tmp_path, monkeypatch):
    """Plants modules called planted_... among our solvers."""
    monkeypatch.setattr(solvers, "__path__", [*solvers.__path__, str(tmp_path)])

    def plant(file, text):
        write(tmp_path, text, file)
        importlib.invalidate_caches()

    yield plant
    for name in [m for m in sys.modules if m.startswith("solvers.planted")]:
        del sys.modules[name]
    for name in [n for n in vars(solvers) if n.startswith("planted")]:
        delattr(solvers, name)


@pytest.fixture
def without_clarabel(monkeypatch):
    """As if the package clarabel were not installed."""
    monkeypatch.delitem(sys.modules, "solvers.clarabel", raising=False)
    monkeypatch.setitem(sys.modules, "clarabel", None)


# --- ours


def test_solvers_and_scenarios_are_listed_with_method_and_paper():
    for entry in (*list_solvers(), *list_scenarios()):
        assert entry.method
        assert entry.name == entry.name.lower()
        assert "_" not in entry.name
    assert {"none", "clarabel", "clarabel-paper"} <= {e.name for e in list_solvers()}
    assert "swing" in {e.name for e in list_scenarios()}


def test_names_are_listed_once():
    names = [e.name for e in list_solvers()]
    assert len(set(names)) == len(names)


@pytest.mark.parametrize("name", ["none", "clarabel", "clarabel-default", "clarabel-paper"])
def test_what_is_listed_is_found_under_its_label(name):
    assert find_solver(name).label == name


def test_a_variant_has_its_settings():
    assert find_solver("clarabel-paper").parameters["form"] == "paper"
    assert find_solver("clarabel").parameters["form"] == "quadratic"


def test_a_label_tells_what_differs_from_the_defaults():
    kind = type(find_solver("clarabel"))
    assert kind(scaling=8.0).label == "clarabel[scaling=8.0]"
    assert kind(form="paper").label == "clarabel[form=paper]"
    assert kind(form="paper", scaling=None, equilibrate=True).label == "clarabel-paper"


@pytest.mark.parametrize("name", ["clarable", "clarabel-fast", "Clarabel", "clarabel_paper", ""])
def test_an_unknown_solver_is_told_what_there_is(name):
    with pytest.raises(ValueError, match=r"no solver called .*clarabel.*none.*\.py file") as caught:
        find_solver(name)
    assert not isinstance(caught.value, UnavailableError)


def test_an_unknown_scenario_is_told_what_there_is():
    with pytest.raises(ValueError, match=r"no scenario called 'swim'.*swing.*\.py file"):
        find_scenario("swim")


# --- what cannot be imported


def test_a_missing_package_makes_a_solver_unavailable(without_clarabel):
    with pytest.raises(UnavailableError, match=r"solver clarabel is unavailable: needs clarabel"):
        find_solver("clarabel")
    with pytest.raises(UnavailableError, match="clarabel-paper"):
        find_solver("clarabel-paper")


def test_an_unavailable_solver_is_listed_with_the_reason(without_clarabel):
    (entry,) = [e for e in list_solvers() if e.name.startswith("clarabel")]
    assert entry.unavailable
    assert "needs clarabel" in entry.unavailable
    assert entry.method == "Interior-point second-order cone programming"
    assert "Tang et al. 2022" in entry.paper
    others = [e for e in list_solvers() if e.name == "none"]
    assert [e.unavailable for e in others] == [None]


def test_an_unavailable_solver_is_planned_with_the_reason(without_clarabel):
    ours, other = plan_solvers(["clarabel", "none"], {}, ("cold",))
    assert ours.name == "clarabel"
    assert "needs clarabel" in ours.unavailable
    assert other.unavailable is None


def test_a_missing_package_is_named_by_its_first_part(planted):
    planted("planted_needy.py", "import nowhere_to_be_found.linalg.lapack" + HEAD)
    with pytest.raises(UnavailableError, match=r"needs nowhere_to_be_found, "):
        find_solver("planted-needy")


@pytest.mark.parametrize(
    ("number", "text", "error"),
    [
        (0, "from strainbench.nowhere import thing", ImportError),
        (1, "from strainbench import nothing_of_that_name", ImportError),
        (2, "import solvers.nowhere", ImportError),
        (3, "raise ImportError('broken')", ImportError),
        (4, "1 / 0", ZeroDivisionError),
        (5, "def broken(:", SyntaxError),
    ],
)
def test_an_error_in_our_own_code_is_raised(planted, number, text, error):
    planted(f"planted_broken{number}.py", text)
    with pytest.raises(error):
        find_solver(f"planted-broken{number}")
    with pytest.raises(error):
        list_solvers()


def test_one_file_is_all_that_a_solver_needs(planted):
    planted("planted_whole.py", HEAD + BODY.format(name="planted-whole"))
    assert find_solver("planted-whole").parameters == {"sweeps": 3}
    (entry,) = [e for e in list_solvers() if e.name == "planted-whole"]
    assert (entry.method, entry.paper) == ("Nothing much", "Nobody 2022")


def test_a_solver_may_be_a_folder(planted):
    head = HEAD + "from solvers.planted_folder.inner import THREE\n"
    body = BODY.format(name="planted-folder").replace("= 3", "= THREE")
    planted("planted_folder/inner.py", "THREE = 3")
    planted("planted_folder/__init__.py", head + body)
    assert find_solver("planted-folder").parameters == {"sweeps": 3}


# --- files from outside


def test_a_file_defines_a_solver(tmp_path):
    (found,) = solvers_of(write(tmp_path, HEAD + BODY.format(name="mine")))
    assert found.name == "mine"
    assert found().label == "mine"


def test_a_file_may_define_several_and_import_others(tmp_path):
    text = HEAD + "from solvers.none import NoProjection\n" + BODY.format(name="one")
    text += BODY.format(name="two").replace("Mine", "Second")
    found = solvers_of(write(tmp_path, text))
    assert [c.name for c in found] == ["one", "two"]


def test_an_edited_file_is_loaded_anew(tmp_path):
    path = write(tmp_path, HEAD + BODY.format(name="mine"))
    solvers_of(path)
    write(tmp_path, (HEAD + BODY.format(name="mine")).replace("sweeps: int = 3", "sweeps: int = 4"))
    (found,) = solvers_of(path)
    assert found().parameters == {"sweeps": 4}


def test_two_files_of_one_name_do_not_mix(tmp_path):
    one = write(tmp_path, HEAD + BODY.format(name="one"), "a/mine.py")
    two = write(tmp_path, HEAD + BODY.format(name="two"), "b/mine.py")
    (first,), (second,) = solvers_of(one), solvers_of(two)
    assert first.name == "one"
    assert second.name == "two"
    assert first.__module__ != second.__module__


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("import nowhere_to_be_found", r"does not import: ModuleNotFoundError: .*nowhere"),
        ("1 / 0", r"does not import: ZeroDivisionError"),
        ("def broken(:", r"does not import: SyntaxError"),
        ("x = 1", r"defines no solver: a subclass of strainbench\.Solver"),
        (HEAD, r"defines no solver"),
        (HEAD + "class Half(Solver):\n    name = 'half'", r"defines no solver"),
        (HEAD + BODY.format(name="none"), r"'none' is taken by our own solver"),
        (HEAD + BODY.format(name="clarabel"), r"'clarabel' is taken by our own solver"),
        (HEAD + BODY.format(name="clarabel-paper"), r"'clarabel-paper' is taken"),
        (HEAD + BODY.replace('name = "{name}"', ""), r'Mine has no name = "\.\.\."'),
        (HEAD + BODY.replace('"{name}"', "3"), r'Mine has no name = "\.\.\."'),
    ],
)
def test_a_file_that_is_no_solver_is_one_line(tmp_path, text, words):
    path = write(tmp_path, text)
    with pytest.raises(ValueError, match=words) as caught:
        solvers_of(path)
    assert path in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(ValueError, match=r"mine\.py: no such file"):
        solvers_of(str(tmp_path / "mine.py"))


def test_a_folder_is_no_file(tmp_path):
    with pytest.raises(ValueError, match="no such file"):
        solvers_of(str(tmp_path))


def test_a_file_that_is_no_python_is_named(tmp_path):
    path = write(tmp_path, "name: mine", "mine.yaml")
    with pytest.raises(ValueError, match=r"mine\.yaml: not a Python file"):
        solvers_of(path)


def test_a_solver_is_no_scenario(tmp_path):
    path = write(tmp_path, HEAD + BODY.format(name="mine"))
    with pytest.raises(ValueError, match=r"defines no scenario: a subclass of strainbench\.Scenar"):
        scenarios_of(path)


def test_a_file_that_failed_leaves_no_module_behind(tmp_path):
    before = set(sys.modules)
    with pytest.raises(ValueError, match="does not import"):
        solvers_of(write(tmp_path, "1 / 0"))
    assert {m for m in set(sys.modules) - before if m.startswith("strainbench_file")} == set()
