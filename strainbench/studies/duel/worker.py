"""Solves for a duel with the strainbench that its Python finds first; see `trees` beside it.

A script of this checkout that runs the code of another: it uses only what older versions have too.
Messages are pickles of a word and its arguments, answered in turn:

| word | arguments | answer |
|---|---|---|
| start | npz of a problem, solvers (name, parameters), tolerance, time limit | checkout's folder |
| prepare | which solver | [s] |
| solve | which, target | positions, status, iterations, [s], [s] of CPU |
"""

import os
import pickle
import sys
from time import perf_counter, process_time
from typing import Any


class Worker:
    """The solvers, each with its state."""

    def start(
        self,
        problem: str,
        solvers: list[tuple[str, dict[str, Any]]],
        tolerance: float,
        time_limit: float | None,
    ) -> str:
        """Find and compile the solvers."""
        from dataclasses import replace

        from threadpoolctl import threadpool_limits

        import strainbench
        from strainbench.export import load_problem
        from strainbench.solver.registry import find_solver
        from strainbench.solver.solver import warm_up

        threadpool_limits(1)
        self.problem, self.rules = load_problem(problem), (tolerance, time_limit)
        self.solvers = [replace(find_solver(name), **values) for name, values in solvers]
        self.states: dict[int, Any] = {}
        for solver in self.solvers:
            if refusal := solver.supports(self.problem):
                raise ValueError(f"{solver.label} cannot take this scene: {refusal}")
            warm_up(solver, self.problem, tolerance)
        return os.path.dirname(os.path.dirname(os.path.abspath(strainbench.__file__)))

    def prepare(self, which: int) -> float:
        """A state anew."""
        self.states.pop(which, None)
        begin = perf_counter()
        self.states[which] = self.solvers[which].prepare(self.problem)
        return perf_counter() - begin

    def solve(self, which: int, target: Any) -> tuple[Any, ...]:
        """One projection."""
        from strainbench.solver.solver import run_solver

        frame, cpu = self.problem.with_target(target), process_time()
        answer = run_solver(self.solvers[which], frame, self.states[which], *self.rules)
        cpu = process_time() - cpu
        return answer.positions, str(answer.status), answer.iterations, answer.seconds, cpu


def main() -> None:
    """Answer until there is nothing more to read; what is printed goes to stderr."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    worker = Worker()
    while True:
        try:
            word, *arguments = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        pickle.dump(getattr(worker, word)(*arguments), answers)
        answers.flush()


if __name__ == "__main__":
    main()
