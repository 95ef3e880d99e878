"""What lies beside the instances: README, licence, citation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.metadata import distribution

from strainbench import __version__
from strainbench.document import Column, Document, Items, Prose, Table
from strainbench.document.writers import markdown
from strainbench.report.numbers import power

WHAT = (
    "Each instance is one projection: minimise 1/2 ||x - target||_M^2 such that no limited "
    "direction of an element is stretched beyond its bound, pinned vertices staying where they "
    "are."
)
FILES = (
    "`NAME.npz`: all arrays, by name; `strainbench.problem.export` describes them, and "
    "`strainbench.export.load_problem` reads them",
    "`NAME.cbf`: the same as a cone program in the Conic Benchmark Format",
    "`optima/NAME.npz`: the certificate, `positions` (vertices, 3) and `multipliers` Y (rows, 3); "
    "kept apart, so that a solver is not given its answer",
    "`index.csv`: sizes, limits, optimum and bounds, and the sha256 of each file",
)
CERTAIN = (
    "The optimum lies between `lower_bound` and `optimum` of the index, in m^2, or kg m^2 where "
    "weights are masses. The positions are within the limits; the bound is D(Y) = <Y, G target> - "
    "1/2 ||G^T Y||^2_{M^-1} - sum b_i |Y_i| (free vertices alone in the norm; |Y_i| is the "
    "nuclear norm of an element's rows where limits are exact), which holds for any Y. `optimal` "
    "means a relative gap of at most 1e-9; `optimal to the gap`, what the column says; "
    "`infeasible`, that no positions meet the limits, for the reason that is given: either pins "
    "are farther apart than the limits let the shortest path between them become, or D(Y) exceeds "
    "the objective of any positions within reach of the pins; `local`, that limits on compression "
    "leave no bound."
)
AGAIN = (
    "Made again by the same version, packages and kind of processor, all files are the same bit "
    "for bit. Elsewhere the candidates of scenes with time steps differ in rounding, and by that "
    "of the projections before, which are solved to 1e-6: optima agree to a relative 1e-6. With "
    "another linear solver (SuperLU in place of Pardiso) those of six instances agreed to 3e-9."
)
CITATION = """cff-version: 1.2.0
message: If you use these instances in a publication, please cite them and strainbench.
title: "{title}"
type: dataset
version: {version}
license: BSD-3-Clause
authors:
  - name: The strainbench developers
"""


def papers(title: str, rows: Sequence[Mapping[str, object]], scaled: bool) -> dict[str, str]:
    """Texts by file name.

    Parameters
    ----------
    rows : of the index
    scaled : whether CBF has units of its own
    """
    licence = next(f for f in distribution("strainbench").files or [] if f.name == "LICENSE")
    citation = CITATION.format(title=title.replace('"', "'"), version=__version__)
    return {
        "README.md": markdown(_readme(title, rows, scaled)),
        "LICENSE": licence.read_binary().decode(),
        "CITATION.cff": citation,
    }


def _readme(title: str, rows: Sequence[Mapping[str, object]], scaled: bool) -> Document:
    units = "in scaled units, which its first lines name" if scaled else "in metres"
    run = "`strainbench run instance --set path=NAME.npz --solver ./mine.py` runs a solver on one."
    return Document(
        title,
        [
            Prose(f"{WHAT} {run} Made by strainbench {__version__}; CBF is {units}."),
            Items(list(map(Prose, FILES))),
            Document("What is certain", [Prose(CERTAIN)]),
            Document("Making them again", [Prose(AGAIN)]),
            Document("Instances", [_table(rows)]),
            Prose("BSD-3-Clause (LICENSE); please cite as in CITATION.cff."),
        ],
    )


def _table(rows: Sequence[Mapping[str, object]]) -> Table:
    header: list[str | Column] = [
        *("name", "scene", "limits"),
        *(Column(name, right=True) for name in ("variables", "constraints", "active")),
        "status",
        Column("gap", form=power, right=True),
    ]
    lines = [
        [
            *(row[c] for c in ("name", "scene", "limits", "variables", "constraints", "active")),
            row["status"],
            float(str(row["relative_gap"])) if row["relative_gap"] != "" else None,
        ]
        for row in rows
    ]
    return Table("", header, lines)
