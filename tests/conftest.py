"""Fixtures and options shared by the tests."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from strainbench.bench.records import open_folder
from tests.tally import Tally

RUNNING = {
    *("test_runner", "test_cluster", "test_endings", "test_files"),
    *("test_debug", "test_instance", "test_testset", "test_cluster_faults", "test_explain"),
    *("test_cli", "test_converge", "test_duel", "test_readme"),
}
LONG = {
    *("test_every_solver", "test_every_scenario", "test_certificates", "test_random_problems"),
    *("test_isolated_vertices", "test_exact_limits", "test_directions", "test_export", "test_kkt"),
    *("test_verdicts", "test_threads", "test_claim", "test_scenes", "test_drape", "test_garment"),
    *("test_physics", "test_integrators", "test_equilibrium", "test_contact", "test_linear"),
    *("test_render", "test_report", "test_failures", "test_compare", "test_ledger", "test_escape"),
    *("test_examples", "test_docs", "test_compiled", "test_options", "test_identity"),
}
"""Files whose tests take more than some ten seconds together; all of solvers/ do."""
FAULTS = {
    "test_endings.py::test_a_run_ended_at_a_random_moment[kill]": "runs killed with -9 at random",
    "test_endings.py::test_a_run_ended": "runs ended by SIGTERM and Ctrl-C at random",
    "test_endings.py::test_what_a_process_starts": "runs killed beside what they have started",
    "test_records.py::test_rows_are_whole_wherever": "writers killed with -9 at random",
    "test_nursery.py::test_a_fork_whose_nursery_dies": "nurseries killed below their cells",
    "test_runner.py::test_a_failure_is_a_row": "solvers that crash, hang, hoard, lie, meddle",
    "test_runner.py::test_a_failing_referee": "referees that crash, hang, raise",
    "test_cluster_faults.py::test_a_worker_killed": "dask workers killed in a cell and replaced",
    "test_cluster_faults.py::test_a_lost_scheduler": "dask schedulers killed in a run",
    "test_cluster_faults.py::test_a_worker_of_several": "dask workers with several threads",
    "test_records.py::test_a_full_disk": "disks full in a row",
    "test_records.py::test_a_disk_that_fails": "disks that fail at the flush",
    "test_files.py::test_a_full_disk": "disks full in a run",
    "test_files.py::test_a_folder_that_is_removed": "results removed in a run",
    "test_files.py::test_a_report_that_cannot": "results that cannot be written to",
    "test_files.py::test_the_second_run": "two runs in one folder",
    "test_records.py::test_a_folder_is_held": "two writers in one folder",
    "test_records.py::test_a_damaged": "damaged records, notes and machines",
    "test_records.py::test_damaged_steps": "damaged steps",
    "test_records.py::test_an_unfinished": "records with a torn last line",
    "test_records.py::test_bytes_that": "records that are not text",
    "test_records.py::test_steps_without": "steps of a cell without its row",
    "test_judge.py::test_a_damaged_journal": "damaged journals",
}
"""What `make faults` does, by the beginnings of tests; of several the first counts."""
TALLY = pytest.StashKey[Tally]()


def pytest_addoption(parser):
    parser.addoption(
        "--problems",
        type=int,
        metavar="N",
        help="check certificates on N random problems with all solvers, and print what became of "
        "the answers; by default 50 problems with a third of the solvers each",
    )
    parser.addoption("--tally", type=Path, metavar="FILE", help="write it as Markdown, too")
    parser.addoption(
        "--kills",
        type=int,
        metavar="N",
        default=1,
        help="end runs at N random moments by each signal; by default one",
    )


def pytest_configure(config):
    config.stash[TALLY] = Tally()
    if file := config.getoption("tally"):
        if file.suffix != ".md":
            raise pytest.UsageError(f"--tally {file}: a name that ends in .md is valid")
        try:
            open_folder(file.parent, "--tally")  # before an hour's work, not after it
        except ValueError as error:
            raise pytest.UsageError(str(error)) from None


@pytest.hookimpl(tryfirst=True)  # xdist looks for groups after that
def pytest_collection_modifyitems(items):
    """Tests that start runs of their own go one after the other, in one of xdist's processes."""
    for item in items:
        if fault_of(item.nodeid):
            item.add_marker(pytest.mark.faults)
        if item.path.stem in RUNNING:
            item.add_marker(pytest.mark.xdist_group("runs"))
        if item.path.stem in RUNNING | LONG or item.path.parent.name == "solvers":
            item.add_marker(pytest.mark.slow)


def fault_of(name):
    """What a test does to a run, in words, or None."""
    name = name.rpartition("/")[2]
    return next((words for begin, words in FAULTS.items() if name.startswith(begin)), None)


def faults_table(stats, kills):
    """A line for each kind of fault: how many were tried, and how many came out whole."""
    came = {"passed": [], "failed": [], "skipped": []}
    for outcome, names in came.items():
        names += [r.nodeid for r in stats.get(outcome, []) if r.when == "call" or r.skipped]
    tried = Counter()
    whole = Counter()
    for outcome, names in came.items():
        for name in names:
            times = kills if "a_run_ended_at_a_random" in name else 1
            tried[fault_of(name)] += times * (outcome != "skipped")
            whole[fault_of(name)] += times * (outcome == "passed")
    width = max(map(len, FAULTS.values()))
    yield f"{'what was done':{width}}  times  whole"
    for words in dict.fromkeys(FAULTS.values()):
        if tried[words]:
            yield f"{words:{width}}  {tried[words]:5}  {whole[words]:5}"


def pytest_terminal_summary(terminalreporter, config):
    if config.getoption("markexpr") == "faults":
        terminalreporter.section("faults")
        for line in faults_table(terminalreporter.stats, config.getoption("kills")):
            terminalreporter.write_line(line)
    if config.getoption("problems") is not None:
        terminalreporter.section("certificates on random problems")
        for line in config.stash[TALLY].lines():
            terminalreporter.write_line(line)
    if config.getoption("tally"):
        config.stash[TALLY].write(config.getoption("tally"))


@pytest.fixture
def tally(request):
    return request.config.stash[TALLY]


@pytest.fixture
def rng():
    return np.random.default_rng(20220814)
