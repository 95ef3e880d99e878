"""What is measured in the process of a verb or a study runs on one thread."""

from __future__ import annotations

import os
import sys

import pytest
from threadpoolctl import threadpool_info, threadpool_limits
from typer.testing import CliRunner

from strainbench.cli.app import app
from strainbench.studies import drapes, euler, looks
from strainbench.studies.program import start
from strainbench.studies.volumes import written


class Looked(Exception):  # noqa: N818
    """Ends what is watched: with the threads of the libraries loaded, and of those to come."""


def look(*_, **__):
    raise Looked({p["num_threads"] for p in threadpool_info()}, os.environ["OMP_NUM_THREADS"])


@pytest.fixture(autouse=True)
def _three(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    with threadpool_limits(3):
        yield


@pytest.mark.parametrize(
    ("timed", "words"),
    [
        ("bench.recording.record_all", "duel swing --frame 2 --solver none --units"),
        ("bench.recording.record_all", "profile swing --frame 2 --solver clarabel"),
        ("studies.ledger.write_ledger", "ledger swing"),
        ("studies.ledger.write_enough", "ledger swing --enough"),
        ("studies.step.measure", "step swing --solver none"),
    ],
)
def test_a_verb_measures_on_one_thread(timed, words, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(f"strainbench.{timed}", look)
    found = CliRunner().invoke(app, words.split())
    assert isinstance(found.exception, Looked), found.output
    assert found.exception.args == ({1}, "1")


@pytest.mark.parametrize(
    ("study", "timed", "words"),
    [
        (euler.run, "euler.profile", "swing --resolution 2"),
        (drapes.run, "drapes.distances", "-o there"),
        (looks.run, "looks.play", "swing --solver none --steps 4"),
        (written.main, "volumes.written.measured", "-o there --part growth"),
    ],
)
def test_a_study_measures_on_one_thread(study, timed, words, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["study", *words.split()])
    monkeypatch.setattr(f"strainbench.studies.{timed}", look)
    with pytest.raises(Looked) as found:
        start(study)
    assert found.value.args == ({1}, "1")
    assert os.environ["OMP_NUM_THREADS"] == "3"
