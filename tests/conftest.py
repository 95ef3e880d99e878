"""Fixtures and options shared by the tests."""

from __future__ import annotations

import numpy as np
import pytest

from tests.tally import Tally

RUNNING = {
    *("test_runner", "test_cluster", "test_endings", "test_files"),
    *("test_debug", "test_instance", "test_testset"),
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
    """Tests that start runs of their own go one after the other, in one of xdist's processes."""
    for item in items:
        if item.path.stem in RUNNING:
            item.add_marker(pytest.mark.xdist_group("runs"))
        if item.path.stem in RUNNING | LONG or item.path.parent.name == "solvers":
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
