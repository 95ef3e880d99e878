"""One self-contained HTML page: the chart, the tables, the reasons, the machine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd
from jinja2 import Environment, PackageLoader
from markupsafe import Markup

from strainbench import escape
from strainbench.report import warm
from strainbench.report.numbers import seconds_text
from strainbench.report.table import (
    OLDER,
    REASONS,
    accuracy_text,
    details,
    explanation,
    groups,
    ledger_lines,
    older,
    reasons,
    time_text,
)


def write_page(
    path: Path,
    runs: pd.DataFrame,
    machines: Mapping[str, Mapping[str, object]],
    charts: Sequence[Path],
) -> None:
    """Write the page; the charts are inlined, nothing is fetched."""
    environment = Environment(
        loader=PackageLoader("strainbench.report", "."),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    drawings = [c.read_text(encoding="utf-8") for c in charts if c.suffix == ".svg"]
    page = environment.get_template("page.html").render(
        charts=[Markup(svg[svg.index("<svg") :]) for svg in drawings],
        explanation=explanation(runs).replace("`", "").replace("**", ""),
        older_title=OLDER.replace("`", ""),
        older=[escape.plain(line) for line in older(runs)],
        groups=list(groups(runs)),
        twins=[pair.line() for pair in warm.pairs(runs)],
        twins_header=warm.HEADER,
        twins_explanation=warm.EXPLANATION.replace("`", ""),
        time_text=time_text,
        accuracy_text=accuracy_text,
        seconds_text=seconds_text,
        reasons_title=REASONS,
        reasons=[escape.plain(reason) for reason in reasons(runs)],
        details=details(runs),
        ledger=ledger_lines(runs),
        machines=machines,
    )
    path.write_text(page, encoding="utf-8")
