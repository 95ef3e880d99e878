"""Files and functions stay small."""

from __future__ import annotations

import ast

import numpy as np

from tests.imports import HERE, OURS

LONGEST_FILE, LONGEST_FUNCTION = 300, 45
"""Those that are longer still; a new one is not added here, but made shorter."""


def sources():
    for package in OURS:
        for path in sorted((HERE / package).rglob("*.py")):
            yield path.relative_to(HERE).as_posix(), path.read_text(encoding="utf-8")


def functions():
    """The name of each function, its lines, and those of its docstring."""
    for path, text in sources():
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.FunctionDef):
                first = node.body[0]
                said = first.end_lineno - first.lineno + 1 if ast.get_docstring(node) else 0
                yield f"{path}: {node.name}", node.end_lineno - node.lineno + 1, said


def test_no_file_is_longer_than_300_lines():
    long = {path for path, text in sources() if len(text.splitlines()) > LONGEST_FILE}
    assert not long


def test_functions_are_short():
    lines = [count for _, count, _ in functions()]
    assert np.percentile(lines, 90) < 25
    assert np.median(lines) <= 10


def test_no_function_goes_on_for_more_than_45_lines_its_docstring_apart():
    long = {name for name, count, said in functions() if count - said > LONGEST_FUNCTION}
    assert not long
