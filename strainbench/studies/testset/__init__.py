"""Projections as instances in a folder, each with its certified optimum or why it has none.

    NAME.npz, NAME.cbf   the problem: `strainbench.problem.export`
    optima/NAME.npz      the certificate: positions (n, 3), multipliers (rows, 3)
    index.csv            a line an instance: COLUMNS
    README.md, LICENSE, CITATION.cff

A certificate needs no trust in who made it: the positions are within the limits, the bound
D(Y) = <Y, G target> - 1/2 ||G^T Y||^2_{M^-1} - sum b_i |Y_i| of the multipliers holds for any
positions within them (`strainbench.referee.certificate`), and the optimum lies between.
Solvers are run on NAME.npz, which has no answer in it.
"""
