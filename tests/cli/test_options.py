"""Every option of every verb with nonsense: one line on what is wrong and valid, status 2."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from typer.main import get_command

from strainbench.bench.machine import describe_machine  # noqa: F401 (numba's import, off any clock)
from strainbench.bench.runner import Runner
from strainbench.cli import app as cli
from strainbench.cli import listing
from strainbench.cli.options import RECORDER
from strainbench.referee.reference import REFERENCE_SOLVER
from tests.command import command

FIELD = Path(__file__).parents[2] / "results/field"
SOLVER = ["--solver", "none"]
SMALL = ["--set", "resolution=2"]
VERBS = {
    "run": ["swing", *SOLVER, *SMALL, "--steps", "1"],
    "report": [],
    "compare": ["a", "b"],
    "recommend": ["swing", "--to", "1mm", "--within", "1s", *SMALL, "--results", str(FIELD)],
    "render": ["swing", *SOLVER, *SMALL, "--steps", "1"],
    "polar": ["swing", *SOLVER, *SMALL, "--steps", "1"],
    "export": ["swing", *SMALL, "--frame", "1", "-o", "frame.cbf"],
    "converge": ["swing", "--solver", "clarabel", *SMALL, "--frame", "1"],
    "duel": ["swing", *SOLVER, *SMALL, "--frame", "1"],
    "ledger": ["swing", *SMALL, "--steps", "1"],
    "step": ["swing", *SOLVER, *SMALL],
    "map": ["swing", "--solver", "none", "--x", "limit=1%,2%", "--y", "step=0.01,0.02"],
    "sensitivity": ["swing", *SOLVER, *SMALL, "--frame", "1", "--draws", "1"],
    "profile": ["swing", *SOLVER, *SMALL, "--frame", "1"],
    "check": ["none"],
    "testset": ["d", "--small"],
    "explain": ["1"],
    "claims": [],
}
"""A valid line of each verb, to which one wrong word is added."""
WHOLE = ["", "x", "-1", "0", "1.5", "nan", "inf", "99999999999999999999"]
NUMBER = ["", "x", "-1", "0", "nan", "inf", "-inf", "1e999", "5%"]
EMPTY = ["", " "]
NAME = ["", "x", "-1", "0", "nan", "swing,", "./nowhere.py", "./"]
SETTING = [
    "",
    "x",
    "=",
    "resolution",
    "resolution=",
    "=2",
    "colour=2",
    "nobody.resolution=2",
    "resolution=abc",
    "resolution=0",
    "resolution=-3",
    "resolution=1.5",
    "resolution=nan",
    "resolution=100000",
    "resolution=99999999999999999999",
    "limit=-0.01",
    "limit=-1%",
    "limit=nan",
    "limit=inf",
    "limit=1e999",
    "limit=",
    "directions=0",
    "directions=x",
    "directions=-4",
    "step=0",
    "step=inf",
    "integrator=",
    "integrator=x",
]
FEW_SETTINGS = ["", "x", "colour=2", "resolution=0", "resolution=100000", "limit=nan"]
NONSENSE = {
    **dict.fromkeys(["--steps", "--jobs", "--threads", "--every", "--repeats"], WHOLE),
    "--draws": WHOLE,
    "--frame": WHOLE,
    **dict.fromkeys(["--duration", "--time-limit", "--memory-limit"], NUMBER),
    "--tolerance": NUMBER,
    "--results": EMPTY,
    "--output": EMPTY,
    "--scheduler": EMPTY,
    "--against": ["", " ", "nowhere", "/dev/null"],
    "--solver": NAME,
    "--set": SETTING,
    "--mode": ["", "x", "0", "Replay", "simulate,replay"],
    "--frames": ["", "x", "0", "3-2", "1-2-3", "2"],
    "--processes": ["", "x", "Fork", "fork,spawn"],
    "--to": ["", "x", "0.1", "0mm", "-1mm", "nanmm", "1 mile", "20ms"],
    "--within": ["", "x", "20", "0ms", "-1ms", "infs", "1mm"],
    "--x": ["", "x", "limit", "limit=", "limit=2..1", "limit=1..x", "limit=5"],
    "--y": ["", "x", "step", "step=1/0..2", "step=1"],
    "--budget": ["", "x", "20", "0s", "-1min", "1d"],
    "--methods": ["", "x"],
    "--columns": ["", "x", "seconds,x"],
    "--per": ["", "x", "frame", "Step"],
    "--fail-on": ["", "x", "ratio", "ratio>", "ratio>x", "ratio>0", "ratio<1"],
    "--start": ["", "x", "cold,", "0"],
    "--format": ["", "x", "0", "png,", "PNG "],
    "--camera": ["", "x", "30", "nan,30", "30,91", "inf,0", "1,2,3"],
    "--scale": ["", "x", "0", "-5%", "nan", "inf", "5", "%"],
}
FLAGS = {
    "--rerun",
    "--paper",
    "--units",
    "--measure",
    "--help",
    "--debug",
    "--optimal",
    "--scaled",
    "--small",
    "--enough",
}


def options():
    """(verb, option) for every option there is."""
    for verb, given in get_command(cli.app).commands.items():
        for parameter in given.params:
            for name in parameter.opts:
                if name.startswith("--") and name not in FLAGS:
                    yield verb, name


def test_every_option_is_tried():
    assert {name for _, name in options()} == set(NONSENSE)
    assert set(get_command(cli.app).commands) == {*VERBS, "list"}


CASES = [
    (verb, name, word)
    for verb, name in options()
    for word in (FEW_SETTINGS if name == "--set" and verb != "run" else NONSENSE[name])
]


def is_one_line(done, status=2):
    assert done.returncode == status, done
    assert done.stderr.startswith("strainbench: ")
    assert len(done.stderr.strip().splitlines()) == 1
    assert "Traceback" not in done.stdout + done.stderr
    return done.stderr


@pytest.mark.parametrize(("verb", "name", "word"), CASES)
def test_nonsense_is_one_line_that_says_what_is_valid(
    verb, name, word, monkeypatch, capsys, tmp_path
):
    monkeypatch.chdir(tmp_path)
    line = is_one_line(command(monkeypatch, capsys, verb, *VERBS[verb], f"{name}={word}"))
    assert any(hint in line for hint in ("valid", "must be", "no such file"))
    assert not any(tmp_path.iterdir())  # nothing was begun


@pytest.mark.parametrize("verb", VERBS)
def test_an_option_that_there_is_not(verb, monkeypatch, capsys):
    line = is_one_line(command(monkeypatch, capsys, verb, *VERBS[verb], "--nowhere"))
    assert "No such option: --nowhere" in line


def test_a_verb_that_is_nearly_right_is_told(monkeypatch, capsys):
    assert "'list'" in is_one_line(command(monkeypatch, capsys, "lst"))


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["run", "swin"], "(did you mean swing?)"),
        (["run", "swing", "--solver", "clarable"], "(did you mean clarabel?)"),
        (["run", "swing", "--set", "resolutoin=3"], "(did you mean resolution?)"),
        (["run", "swing", "--solver", "none,./mine.py"], "./mine.py: no such file"),
        (["run", "swing", "--solver", "folder/"], "folder/ is a folder"),
        (["run", "./folder"], "./folder is a folder, no such file: the path of a .py file"),
        (["run", "swing", "--set", "resolution=100000"], "resolution is 100000: its arrays need"),
        (["export", "swing", "--frame", "1", "-o", "folder"], "such as folder/frame.cbf"),
        (["export", "swing", "--frame", "1", "-o", "x.txt"], "valid are cbf, npz"),
        (["run", "swing", "--debug", "--scheduler", "x"], "--debug and --scheduler: one of them"),
        (["check", ""], "no solver called ''"),
        (["check", "clarable"], "(did you mean clarabel?)"),
        (["check", "./nowhere.py"], "./nowhere.py: no such file"),
        (["check"], "Missing argument"),
        (["testset", ""], "DIR '': the path of a folder is valid"),
        (["testset", "file"], "file/optima cannot be written to"),
        (["converge", "swing", "--solver", "none", "--frame", "1"], "other solvers are valid"),
        (["render", "swing", "--scale", "5"], "5% is valid, or 500% if it is meant"),
        (["render", "swing", "-o", "file/x"], "file/x cannot be written to"),
        (["polar", "swing", "-o", "folder"], "a name that ends in .svg, .png, .pdf is valid"),
        (["compare", "folder"], "Missing argument"),
        (["compare", "folder", "folder"], "folder holds no results"),
        (["compare", "file", "file"], "file holds no results"),
        (["compare", "", "folder"], "A '': the path of a folder is valid"),
        (["report", "--results", "file"], "file holds no results"),
        (["run", "swing", "--results", "file"], "file cannot be written to"),
        (["list", ""], "list '': valid are solvers, scenarios"),
        (["ledger", "nowhere"], "no scenario called 'nowhere'"),
        (["duel", "swing", "--solver", "none", "--frame", "5-1"], "--frame 5-1: whole numbers"),
        (["duel", "swing", "--solver", "none", "--frame", "1-1000000000000"], "is too many"),
        (["run", "swing", "--duration", "1e12"], "steps of swing are too many"),
    ],
)
def test_what_is_wrong_is_named(words, line, monkeypatch, capsys, tmp_path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").write_text("")
    monkeypatch.chdir(tmp_path)
    assert line in is_one_line(command(monkeypatch, capsys, *words))


def test_mp4_alone_needs_ffmpeg(monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", str(tmp_path))
    words = ["render", *VERBS["render"], "--format", "mp4"]
    assert "needs ffmpeg" in is_one_line(command(monkeypatch, capsys, *words))


def test_without_a_word_the_help_is_shown(monkeypatch, capsys):
    done = command(monkeypatch, capsys)
    assert "Usage: " in done.stdout
    assert "a command is missing; valid are list, run, report" in is_one_line(done)
    commands = get_command(cli.app).commands
    assert set(cli.VERBS) == set(commands)


def loaded_by(word):
    """What the command prints, and the modules that it has loaded by then."""
    words = f"import sys; sys.argv = ['strainbench', {word!r}]; import strainbench.cli as cli\n"
    look = "try: cli.main()\nfinally: print(*sys.modules, file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", words + look], capture_output=True, text=True)
    assert "typer" in done.stderr.split()
    return done.stdout, set(done.stderr.split())


def test_help_and_version_import_nothing_heavy():
    shown, modules = loaded_by("--help")
    assert "Usage: " in shown
    heavy = {"numpy", "scipy", "numba", "pandas", "matplotlib", "cvxpy", "psutil", "distributed"}
    assert not heavy & {module.split(".")[0] for module in modules}
    assert not {"rich.markdown", "rich.progress"} & modules


def test_a_list_imports_no_solver_s_library_and_compiles_nothing():
    shown, modules = loaded_by("list")
    assert "cvxpy-scs" in shown
    heavy = {"cvxpy", "osqp", "qoco", "cyipopt", "scs", "ecos", "numba", "meshio", "pypardiso"}
    assert not heavy & {module.split(".")[0] for module in modules}
    assert not {"scipy.sparse", "scipy.integrate", "scipy.optimize"} & modules


def test_the_help_names_every_verb_and_option(monkeypatch, capsys):
    shown = command(monkeypatch, capsys, "--help").stdout
    for word in (*cli.VERBS, "--version", "--help"):
        assert f" {word} " in shown


def test_frames_are_exported_with_the_answers_of_the_reference_solver():
    assert RECORDER == REFERENCE_SOLVER


def test_the_version(monkeypatch, capsys):
    done = command(monkeypatch, capsys, "--version")
    assert (done.returncode, done.stdout) == (0, f"strainbench {cli.__version__}\n")


# --- faults of ours, and Ctrl-C


def fail(error):
    def raising(*_):
        raise error

    return raising


def test_a_fault_of_ours_is_one_line_and_status_1(monkeypatch, capsys):
    monkeypatch.setattr(listing, "tables", fail(KeyError("colour")))
    line = is_one_line(command(monkeypatch, capsys, "list"), status=1)
    assert "KeyError: 'colour'" in line
    assert "STRAINBENCH_DEBUG=1 shows where" in line
    monkeypatch.setenv("STRAINBENCH_DEBUG", "1")
    with pytest.raises(KeyError):
        command(monkeypatch, capsys, "list")


def test_an_error_of_the_disk_is_one_line_and_status_1(monkeypatch, capsys):
    error = OSError(28, "No space left on device", "/full/runs.csv")
    monkeypatch.setattr(listing, "tables", fail(error))
    line = is_one_line(command(monkeypatch, capsys, "list"), status=1)
    assert line == "strainbench: /full/runs.csv: No space left on device\n"


def test_an_interrupt_says_what_is_kept_only_where_something_is(monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(listing, "tables", fail(KeyboardInterrupt()))
    done = command(monkeypatch, capsys, "list")
    assert (done.returncode, done.stderr) == (130, "strainbench: interrupted\n")

    def interrupted(runner, cells):
        runner.observer.planned(cells, skipped.pop())
        raise KeyboardInterrupt

    skipped = [1, 0]
    monkeypatch.setattr(Runner, "run", interrupted)
    for kept in ("no cell had finished", "every finished cell is kept (1 of 1)"):
        done = command(monkeypatch, capsys, "run", *VERBS["run"])
        assert done.returncode == 130
        assert f"interrupted; {kept}" in done.stderr
