"""The columns of runs.csv and steps.csv, and what may stand in them."""

from __future__ import annotations

RUN_COLUMNS = (
    "schema",
    "cell",
    "finished_at",
    "scenario",
    "resolution",
    "limit",
    "directions",
    "integrator",
    "solver",
    "tolerance",
    "mode",
    "steps_asked",
    "steps_done",
    "outcome",
    "reason",
    "solve_seconds_mean",
    "solve_seconds_median",
    "setup_seconds",
    "ie_seconds_mean",
    "iterations_mean",
    "details_mean",
    "max_violation",
    "max_principal_stretch",
    "relative_gap_max",
    "distance_max",
    "distance_bound_max",
    "reference_error_max",
    "projections",
    "projections_violated",
    "projections_optimal",
    "newton_failures",
    "variables",
    "constraints",
    "nonzeros",
    "needs",
    "active_constraints_max",
    "peak_memory_mb",
    "blas_threads",
    "time_limit",
    "violation_threshold",
    "gap_threshold",
    "start_seconds",
    "play_seconds",
    "judge_seconds",
    "scenario_parameters",
    "solver_parameters",
    "machine",
    "threads",
    "solver_source",
    "scenario_source",
    "content",
    "suite",
    "repeats",
    "load",
    "stolen_seconds",
    "failure",
    "failure_step",
)
"""Of `repeats`: `solve_seconds_mean` and `_median` are over the projections' medians; of `failure`:
one of `strainbench.bench.failure`, and the first step of that kind."""
STEP_COLUMNS = (
    "cell",
    "step",
    "projection",
    "outcome",
    "status",
    "seconds",
    "iterations",
    "max_violation",
    "max_principal_stretch",
    "objective",
    "lower_bound",
    "relative_gap",
    "distance",
    "distance_bound",
    "reference_error",
    "active_constraints",
    "details",
    "time",
    "ie_seconds",
    "newton_iterations",
    "newton_converged",
    "assembly_seconds",
    "factorisation_seconds",
    "line_search_seconds",
    "kinetic_energy",
    "gravity_energy",
    "membrane_energy",
    "bending_energy",
    "momentum_x",
    "momentum_y",
    "momentum_z",
    "pin_work",
    "contact_energy",
    "penetration",
    "equilibrium_residual",
    "equilibrium_distance",
    "seconds_low",
    "seconds_high",
    "seconds_each",
    "failure",
    "inverted",
    "momentum_error",
    "energy_rise",
)
"""With repeats, `seconds` is their median, low and high their quartiles, each all as measured."""

WORDS = {
    *("cell", "finished_at", "scenario", "integrator", "solver", "mode", "outcome", "reason"),
    "directions",  # a number, or exact
    *("details_mean", "needs", "scenario_parameters", "solver_parameters", "machine"),
    *("status", "details", "newton_converged"),
    "seconds_each",
    *("problem", "sampled_by", "ending"),
    *("solver_source", "scenario_source", "content", "suite"),
    "failure",
}
"""Columns of runs.csv, steps.csv and convergence.csv that are not numbers."""
COUNTS = {
    *("step", "projection", "steps_asked", "steps_done", "failure_step", "inverted"),
    *("projections", "projections_violated", "projections_optimal", "newton_failures"),
    *("variables", "constraints", "threads", "repeats"),
}
"""Numbers that the suite itself counts."""
SEVERAL = {"seconds_each"}
"""Words that are numbers with spaces between."""
SETTINGS = {"scenario_parameters", "solver_parameters", "details_mean", "details"}
"""Words that are JSON."""
PROSE = {"reason", "status", "ending"}
"""Words that are brought onto one line, of sane length."""
FACTS = ("memory_gb", "system", "python", "threads_per_solver")
"""What is known of every machine."""
