"""Ratios of times: solvers in turns on the same projections."""
