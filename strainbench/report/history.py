"""Earlier states of the sources that give the numbers that they give now.

Known from the checkout's history; without one, only sources that are the same to the letter are.
Two kinds of edit change no number. One is of words: comments, docstrings, layout; the syntax tree
is the same. The other is of what watches cells from outside: beside counting what else the machine
did, it can change a cell by ending it alone, and one that it has ended says so.
"""

from __future__ import annotations

import ast
import subprocess
import tempfile
from collections.abc import Iterable
from functools import cache
from pathlib import Path

from strainbench.bench.failure import Failure
from strainbench.sources import PACKAGES, ROOT, SUITE, digest

WATCHING = (SUITE / "bench/isolation.py",)
"""Files that watch cells from outside, and end them at their limits."""
ENDED = (Failure.MEMORY, Failure.CRASHED, Failure.RECORDS, Failure.NO_VERDICT)
"""Failures that they can bring about. Time limits are not among them: limit and time stand in the
row."""


def git(folder: Path, *words: str) -> str:
    """What git says in a folder; nothing where there is no git, or no checkout."""
    return _git(folder, *words).decode().strip()


@cache
def alike(files: tuple[Path, ...], watched: bool) -> frozenset[str]:
    """Digests of `files`: as they are, and as they were before edits that change no number.

    Parameters
    ----------
    watched : whether the numbers depend on what ends cells from outside, too
    """
    found = {digest(files)}
    for commit in git(ROOT, "log", "--format=%H", "--", *PACKAGES).split():
        before = texts_before(commit, files, watched)
        if before is None:
            break
        with tempfile.TemporaryDirectory() as folder:
            there = {file: Path(folder, str(k)) for k, file in enumerate(before)}
            for file, text in before.items():
                there[file].write_bytes(text)
            found.add(digest(there.get(file, file) for file in files))
    return frozenset(found)


def texts_before(commit: str, files: Iterable[Path], watched: bool) -> dict[Path, bytes] | None:
    """Of the files that differ from those of a commit, what they were; None if numbers may differ,
    or if history does not know the commit."""
    changed = _git(ROOT, "diff", "--name-only", "--relative", "-z", commit, "--", *PACKAGES)
    before = {}
    if not changed and not _git(ROOT, "cat-file", "-t", commit):
        return None
    for file in {ROOT / name for name in changed.decode().split("\0") if name} & set(files):
        text = _git(ROOT, "show", f"{commit}:./{file.relative_to(ROOT).as_posix()}")
        if (watched or file not in WATCHING) and not _say_the_same(text, file.read_bytes()):
            return None
        before[file] = text
    return before


def _say_the_same(one: bytes, other: bytes) -> bool:
    """Whether two modules differ in comments, docstrings and layout at most."""
    try:
        return _code(one) == _code(other)
    except (SyntaxError, ValueError):
        return one == other


def _code(text: bytes) -> str:
    """The syntax tree without strings that stand alone."""
    return ast.dump(_Wordless().visit(ast.parse(text)))


class _Wordless(ast.NodeTransformer):
    def visit_Expr(self, node: ast.Expr) -> ast.Expr | None:
        words = isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
        return None if words else node


def _git(folder: Path, *words: str) -> bytes:
    try:
        done = subprocess.run(["git", *words], cwd=folder, capture_output=True, check=False)
    except FileNotFoundError:
        return b""
    return done.stdout if done.returncode == 0 else b""
