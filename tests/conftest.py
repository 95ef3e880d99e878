"""Fixtures and options shared by the tests."""

from __future__ import annotations

import numpy as np
import pytest

from tests.tally import Tally

RUNNING = {
    *("test_runner", "test_cluster", "test_endings", "test_files"),
    *("test_cli", "test_converge", "test_duel", "test_readme"),
}
TALLY = pytest.StashKey[Tally]()


def pytest_addoption(parser):
    parser.addoption(
        "--problems",
        type=int,
        metavar="N",
        help="check certificates on N random problems with all solvers, and print what became of "
        "the answers; by default 50 problems with a third of the solvers each",
    )
    parser.addoption(
        "--kills",
        type=int,
        metavar="N",
        default=1,
        help="end runs at N random moments by each signal; by default one",
    )


def pytest_configure(config):
    config.stash[TALLY] = Tally()


@pytest.hookimpl(tryfirst=True)  # xdist looks for groups after that
def pytest_collection_modifyitems(items):
    """Tests that start runs of their own are slow, and go one after the other in one process."""
    for item in items:
        if item.path.stem in RUNNING:
            item.add_marker(pytest.mark.xdist_group("runs"))
            item.add_marker(pytest.mark.slow)


def pytest_terminal_summary(terminalreporter, config):
    if config.getoption("problems") is not None:
        terminalreporter.section("certificates on random problems")
        for line in config.stash[TALLY].lines():
            terminalreporter.write_line(line)


@pytest.fixture
def tally(request):
    return request.config.stash[TALLY]


@pytest.fixture
def rng():
    return np.random.default_rng(20220814)
