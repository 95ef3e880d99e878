"""What README.md and results/README.md say was found stands in the records that they link to."""

from __future__ import annotations

import random
from dataclasses import replace
from functools import cache

import pytest

from tests.findings import RESULTS, ROOT, Finding, findings, precision, stands

TEXTS = {"README.md": 0.75, "results/README.md": 0.5}
"""Of how many numbers an alteration by hand is found out, at least."""
SOME = 50
TIMES = 5  # so often each of them is altered
HELD = RESULTS / "paper"
"""Line by line the same as its record: tests/test_readme.py."""


@cache
def told(name: str) -> list[Finding]:
    """The findings of a text."""
    return list(findings(ROOT / name))


def altered(finding: Finding, rng: random.Random) -> Finding:
    """The same with another digit in one place, as a slip of the hand leaves it."""
    mantissa, _, power = finding.text.partition("e")
    places = [k for k, c in enumerate(mantissa) if c in "123456789"] or [len(mantissa) - 1]
    k = rng.choice(places)
    digit = rng.choice([d for d in "123456789" if d != mantissa[k]])
    text = f"{mantissa[:k]}{digit}{mantissa[k + 1 :]}" + (f"e{power}" if power else "")
    line = tuple(text if other == finding.text else other for other in finding.line)
    return replace(finding, text=text, line=line)


@pytest.mark.slow
@pytest.mark.parametrize("name", TEXTS)
def test_every_number_that_was_found_stands_in_a_record(name):
    lost = [f"{f.text} in: {f.told[:100]}" for f in told(name) if not f.found]
    assert not lost, "\n".join(lost)
    assert len(told(name)) > SOME


@pytest.mark.slow
@pytest.mark.parametrize("name", TEXTS)
def test_most_numbers_that_are_altered_by_hand_are_found_out(name):
    rng = random.Random(0)
    free = [f for f in told(name) if HELD not in f.sources]
    wrong = [altered(f, rng) for f in free * TIMES]
    assert sum(not f.found for f in wrong) >= TEXTS[name] * len(wrong)


def test_precision_is_that_at_which_a_number_is_told():
    told_and_half = {"340": 5, "0.0091": 5e-5, "1,900": 50, "3e-7": 5e-8, "57": 0.5, "-44.4": 0.05}
    for text, half in told_and_half.items():
        assert precision(text) == pytest.approx(half, rel=1e-3)


def test_findings_are_numbers_that_are_no_settings_of_texts_that_link_to_records(tmp_path):
    text = tmp_path / "README.md"
    link = f"[table]({RESULTS / 'field/table1.md'})"
    text.write_text(
        f"# One\nAt 20 cells and 1% `newton-ipm` takes 0.0091 s, clarabel 12 iterations, {link};\n"
        "to 1e-6, and the paper's 3.1 s.\n\n"
        "`strainbench run swing` prints 7.5 mm.\n\n"
        "| method | 20 cells |\n|---|---|\n| `clarabel` | 0.067, <0.003 |\n"
        "# Two\nHere 9.9 s are linked to nothing.\n"
    )
    found = list(findings(text))
    assert [f.text for f in found] == ["0.0091", "12", "0.067", "0.003"]
    assert found[0].names == {"newton-ipm", "clarabel"}
    assert found[2].line == ("0.067", "0.003")


def test_a_number_stands_among_others_at_its_precision():
    import numpy as np

    values = np.array([0.00914, -44.36])
    assert stands("0.0091", values)
    assert not stands("0.0092", values)
    assert stands("-44.4", values)
    assert stands("44.4", values)
    assert not stands("-0.0091", values)
