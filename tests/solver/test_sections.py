"""Named parts of a solver's work."""

from __future__ import annotations

import time

import pytest

from strainbench import section
from strainbench.solver.sections import listening


def test_nothing_is_kept_while_nobody_listens():
    with section("a"):
        pass
    with listening() as heard:
        pass
    assert heard.parts == {}
    assert section("a") is section("b")


def test_a_section_has_its_own_seconds_and_those_within_have_theirs():
    with listening() as heard:
        begin = time.perf_counter()
        for _ in range(3):
            with section("outer"):
                time.sleep(0.01)
                with section("inner"):
                    time.sleep(0.02)
        whole = time.perf_counter() - begin
    assert list(heard.parts) == ["outer", "inner"]
    assert [part.calls for part in heard.parts.values()] == [3, 3]
    outer, inner = (part.seconds for part in heard.parts.values())
    assert inner >= 0.06
    assert outer >= 0.03
    assert outer + inner <= whole


def test_a_section_that_raises_is_counted_and_listeners_do_not_mix():
    with listening() as outer:
        with pytest.raises(ValueError, match="no"), section("a"):
            raise ValueError("no")
        with listening() as inner, section("b"):
            pass
    assert outer.parts["a"].calls == 1
    assert list(inner.parts) == ["b"]
    assert "b" not in outer.parts
