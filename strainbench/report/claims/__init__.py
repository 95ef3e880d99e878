"""What papers claim, beside what was measured: an experiment, a command and a verdict each.

`claim` has what a claim is, `evidence` where its numbers come from; the other modules hold those of
Tang et al. (2022) and Hernandez et al. (2013) by subject, `written` sets them out.
"""
