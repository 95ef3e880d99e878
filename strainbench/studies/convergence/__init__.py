"""Solvers followed on projections: violation, gap and distance against time."""
