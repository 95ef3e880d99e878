"""Two checkouts of strainbench in one duel: each has a process of its own that stays.

Both sides run the same script in the same Python and differ in where `strainbench` and `solvers`
are found; they take turns on the same candidates, one of them waiting while the other works.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import IO, Any

from strainbench.fields import same
from strainbench.problem.export import write_problem
from strainbench.problem.problem import Problem
from strainbench.solver.registry import find_solver
from strainbench.solver.solver import Solution, Solver
from strainbench.studies.duel.racer import Racer, Rules

HERE = Path(__file__).resolve().parents[3]
WORKER = Path(__file__).with_name("worker.py")


def check_tree(folder: Path) -> Path:
    """The folder, whole, if a checkout is there; else ValueError."""
    if not (folder / "strainbench" / "__init__.py").is_file():
        valid = "the folder of another checkout of strainbench is valid"
        raise ValueError(f"--against {folder}: there is no strainbench in it; {valid}")
    return folder.resolve()


def version_of(folder: Path) -> str:
    """The commit of a checkout, "-dirty" where files were edited since; else the folder's name."""
    words = ["git", "-C", str(folder), "describe", "--always", "--dirty", "--exclude", "*"]
    top = ["git", "-C", str(folder), "rev-parse", "--show-toplevel"]
    with suppress(OSError, subprocess.CalledProcessError):
        if Path(_output(top)).resolve() == folder.resolve():
            return _output(words)
    return folder.resolve().name


def _output(words: Sequence[str]) -> str:
    return subprocess.run(words, capture_output=True, check=True, text=True).stdout.strip()


class Tree:
    """A checkout's process, which answers `worker.py`'s messages."""

    def __init__(self, folder: Path, errors: IO[bytes]) -> None:
        self.folder, self.version, self._errors = folder, version_of(folder), errors
        self._process = subprocess.Popen(
            [sys.executable, "-P", str(WORKER)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=errors,
            env={**os.environ, "PYTHONPATH": str(folder)},
        )

    def ask(self, *message: object) -> Any:
        """The answer; ValueError with the last that the process said where it ends instead."""
        assert self._process.stdin is not None is not self._process.stdout
        try:
            pickle.dump(message, self._process.stdin)
            self._process.stdin.flush()
            return pickle.load(self._process.stdout)
        except (BrokenPipeError, EOFError):
            self._process.wait()
            self._errors.seek(0)
            said = self._errors.read().decode(errors="replace").strip().splitlines()
            reason = said[-1] if said else f"exit status {self._process.returncode}"
            raise ValueError(f"the solvers of {self.folder} ended: {reason}") from None

    def close(self) -> None:
        """End the process, in the middle of a turn too."""
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe is not None
            with suppress(BrokenPipeError):
                pipe.close()


class There:
    """A solver in a checkout's process, as `measure.Here` is one in this process."""

    def __init__(self, tree: Tree, which: int, label: str) -> None:
        self._tree, self._which = tree, which
        self.entry = Racer(label, version=tree.version)

    def prepare(self) -> None:
        """Anew, on a clock of its own."""
        self.entry.setups.append(self._tree.ask("prepare", self._which))

    def take_turn(self, number: int, frame: Problem) -> None:
        """Project one frame."""
        x, status, iterations, seconds, cpu = self._tree.ask("solve", self._which, frame.target)
        self.entry.add(number, Solution(x, status, iterations, seconds=seconds), cpu)


@contextmanager
def processes(
    solvers: Sequence[Solver], problem: Problem, rules: Rules, against: Path
) -> Iterator[list[There]]:
    """The solvers of this checkout, then those of the other, ready to take turns.

    Raises
    ------
    ValueError
        One line: a solver that only one checkout has, a scene that has no file, or none at all.
    """
    named = [_named(solver) for solver in solvers]
    with ExitStack() as stack:
        file = Path(stack.enter_context(tempfile.TemporaryDirectory())) / "problem.npz"
        write_problem(problem, file, "npz", "duel")
        racers = []
        for folder in (HERE, against):
            tree = Tree(folder, stack.enter_context(tempfile.TemporaryFile()))
            stack.callback(tree.close)
            found = tree.ask("start", str(file), named, rules.tolerance, rules.time_limit)
            if Path(found).resolve() != folder:
                raise ValueError(f"--against {folder}: its Python imports strainbench from {found}")
            racers += [There(tree, k, solver.label) for k, solver in enumerate(solvers)]
        yield racers


def _named(solver: Solver) -> tuple[str, dict[str, object]]:
    """Its name, and the parameters that differ from those of the name."""
    try:
        default = find_solver(solver.name).parameters
    except ValueError:
        raise ValueError(f"--against: {solver.label} is no solver of the suite's own") from None
    changed = {k: v for k, v in solver.parameters.items() if not same(v, default[k])}
    return solver.name, changed
