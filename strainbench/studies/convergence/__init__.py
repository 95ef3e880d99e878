"""Solvers followed on one projection: violation, gap and distance against time."""
