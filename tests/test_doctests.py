"""Examples in the docstrings of the public face are true."""

from __future__ import annotations

import doctest

import pytest

import strainbench

FACE = {name: getattr(strainbench, name) for name in strainbench.__all__}
OURS = [(n, t) for n, t in FACE.items() if getattr(t, "__module__", "").startswith("strainbench")]
FOUND = [
    test
    for name, thing in OURS
    for test in doctest.DocTestFinder().find(thing, name, globs=dict(FACE))
    if test.examples
]


def test_the_first_things_that_one_needs_have_an_example():
    assert {"Problem", "StretchLimits", "solve", "certify"} <= {test.name for test in FOUND}


@pytest.mark.parametrize("found", FOUND, ids=lambda test: test.name)
def test_examples_in_docstrings(found):
    failed, tried = doctest.DocTestRunner().run(found)
    assert failed == 0
    assert tried > 0
