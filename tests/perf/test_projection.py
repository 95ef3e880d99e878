"""pytest-benchmark: every solver on a recorded frame of the swing; run by `make perf`."""

from __future__ import annotations

import pytest

from scenarios.swing import Swing
from strainbench import certify
from strainbench.referee.reference import REFERENCE_SOLVER
from strainbench.scenario.stage import Stage
from strainbench.solver.registry import find_solver, list_solvers
from strainbench.solver.solver import run_solver, warm_up

TOLERANCE = 1e-6
NAMES = [e.name for e in list_solvers() if not e.unavailable]


@pytest.fixture(scope="module", params=[(10, 0.01), (20, 0.01)], ids=["10 at 1%", "20 at 1%"])
def frame(request):
    """The candidate of the tenth step, as the reference solver's run reaches it, and its name."""
    resolution, limit = request.param
    scene = Swing(resolution=resolution, limit=limit)
    stage = Stage.opened(scene, find_solver(REFERENCE_SOLVER), TOLERANCE)
    list(stage.steps(10))
    return f"step 10 of swing at {resolution}x{resolution} squares, {limit:.0%}", stage.frame


@pytest.mark.parametrize("name", NAMES)
def test_projection(benchmark, frame, name):
    benchmark.group, frame = frame
    solver = find_solver(name)
    if refusal := solver.supports(frame):
        pytest.skip(refusal)
    warm_up(solver, frame, TOLERANCE)
    state = solver.prepare(frame)
    solution = benchmark.pedantic(
        run_solver, args=(solver, frame, state, TOLERANCE, 2.0), rounds=5, warmup_rounds=1
    )
    found = certify(frame, solution.positions)
    facts = {k: v for k, v in vars(found).items() if k != "reason"}
    benchmark.extra_info.update(facts | {"solver": name, "status": solution.status})
