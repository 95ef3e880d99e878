"""Measurements beside the cells: convergence, ratios of times, what parts of a scene change."""
