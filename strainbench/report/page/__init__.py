"""The report as one page that needs no network: what was found, charts, tables, every record."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path

import pandas as pd
from jinja2 import Template
from markupsafe import Markup

from strainbench.document import Strong
from strainbench.document.html import templates
from strainbench.escape import plain
from strainbench.progress import Track, untracked
from strainbench.report.charts import Makers
from strainbench.report.identity import look
from strainbench.report.measures import OPTIMAL, PHYSICS, numbers
from strainbench.report.names import percent, played
from strainbench.report.page import data
from strainbench.report.page.drawn import Drawn
from strainbench.report.page.headline import headline
from strainbench.report.page.maps import map_of
from strainbench.report.page.races import CASE, with_cases
from strainbench.report.page.sections import Section, sections
from strainbench.report.page.tiles import tiles
from strainbench.report.page.vega import vega_script
from strainbench.report.rows import rows_of
from strainbench.report.steps import newest_steps
from strainbench.report.table import UNCONSTRAINED

HERE = Path(__file__).parent
READ = (
    *("cell", "step", "projection", "outcome", "status", "seconds", "active_constraints"),
    *("max_violation", "relative_gap", "distance", "contact_energy"),
    *("seconds_low", "seconds_high", "seconds_each", *PHYSICS),
)
"""Columns of steps that the page is about; further ones would cost time."""
BLOCK = list(CASE[:-1])
SCRIPTS = ("parts.js", "drawer.js", "answer.js", "tables.js", "charts.js", "page.js")
Machines = Mapping[str, Mapping[str, object]]


def report_page(
    folder: Path,
    runs: pd.DataFrame,
    failed: pd.DataFrame,
    machines: Machines,
    files: Sequence[str],
    make: Makers,
    track: Track = untracked,
) -> str:
    """The page of a results folder.

    Parameters
    ----------
    runs : as `strainbench.report.load_runs` has them
    failed : as `strainbench.report.failures.failures` has it
    files : names of what else was written, to be linked
    make : makes the charts
    """
    steps = newest_steps(folder, runs)
    steps = numbers(steps[[name for name in READ if name in steps]])
    found = with_cases(runs)
    mapped = map_of(folder, runs)
    parts = sections(folder, found, steps, failed, machines, make, bool(mapped), track)
    page: str = _template().render(
        title=folder.resolve().name,
        meta=_meta(found),
        headline=headline(found),
        tiles=[
            tile for tile in tiles(found, steps, failed) if tile.section in {p.name for p in parts}
        ],
        several=len(found.drop_duplicates(BLOCK)) > 1,
        sections=parts,
        files=files,
        style=Markup((HERE / "page.css").read_text(encoding="utf-8")),
        vega=Markup(vega_script()),
        script=Markup("\n".join((HERE / name).read_text(encoding="utf-8") for name in SCRIPTS)),
        packed=data.packed(
            {
                "cells": data.cells(found, steps),
                "failures": data.failed_lists(failed, found),
                "records": data.records(found),
                "map": mapped,
                "steps": data.step_lists(steps),
            }
        ),
        specs=_specs(chart for part in parts for chart in part.charts),
        records=Markup(data.as_json(_payload(folder, found, parts))),
    )
    return page


def _payload(
    folder: Path,
    runs: pd.DataFrame,
    parts: Iterable[Section],
) -> dict[str, object]:
    """What the script reads."""
    ordered = runs.sort_values(["resolution", "mesh"], kind="stable")
    limits = runs.sort_values(["limit", "bound"], kind="stable")
    methods = list(runs["solver"].unique())
    return {
        "folder": plain(folder),
        "alone": UNCONSTRAINED,
        "methods": {name: data.looks(name) for name in methods},
        "families": data.families(methods),
        "blocks": _blocks(runs),
        "scenes": list(runs["scene"].unique()),
        "modes": list(runs["mode"].unique()),
        "limits": list(limits["bound"].unique()),
        "aims": list(runs.sort_values("tolerance", ascending=False)["aim"].unique()),
        "sizes": list(ordered["mesh"].unique()),
        "grid": bool(runs["mesh"].str.contains("×").all()),
        "charts": {chart.name: chart.about for part in parts for chart in part.charts},
    }


def _specs(charts: Iterable[Drawn]) -> dict[str, str]:
    """Packed by accuracy, which a page needs at different times; a chart's targets side by side,
    as they share most of their data and gzip sees no further than 32 kB."""
    packs: dict[str, dict[str, object]] = {}
    for chart in charts:
        packs.setdefault(chart.about.get("against", ""), {})[chart.name] = chart.specs
    return {name: data.packed(specs, data.DRAWN) for name, specs in packs.items()}


def _blocks(runs: pd.DataFrame) -> list[list[str]]:
    """What a table is about, that with most cells and most optima first."""
    optima = (runs["ending"] == OPTIMAL).groupby([runs[name] for name in BLOCK], sort=False)
    order = optima.agg(["size", "sum"]).sort_values(["size", "sum"], ascending=False, kind="stable")
    return [list(block) for block in order.index]


def _meta(runs: pd.DataFrame) -> str:
    """What all cells share, in a line."""
    parts = [
        *_few(runs["scene"], "{} scenes"),
        *_few([played(row) for row in rows_of(runs)], ""),
        *_few([f"limit {percent(v)}" if v == v else "" for v in runs["limit"]], "{} limits"),
        *_few([f"directions {v}" if v else "" for v in runs["directions"].astype(str)], ""),
        *_few(runs["aim"], "{} tolerances"),
        *_few([f"{v:.0f} thread{'s' * (v > 1)}" for v in runs["threads"]], ""),
        *_few(runs["machine"], "{} machines"),
        str(max(runs["finished_at"].fillna("").astype(str)))[:10],
    ]
    return " · ".join(filter(None, parts))


def _few(values: Iterable[str], form: str) -> list[str]:
    """What all are, or how many there are."""
    found = list(dict.fromkeys(values))
    return found if len(found) == 1 else [form.format(len(found))]


@cache
def _template() -> Template:
    environment = templates("strainbench.report.page")
    environment.filters["plain"] = plain
    environment.tests["strong"] = lambda piece: isinstance(piece, Strong)
    environment.globals["mark"] = _mark
    return environment.get_template("page.html")


def _mark(method: str) -> Markup:
    """A method's mark as an inline drawing."""
    shown = look(plain(method))
    drawing = '<svg class="mark" viewBox="-1.1 -1.1 2.2 2.2"><path d="{}" fill="{}"/></svg> '
    return Markup(drawing).format(shown.shape, shown.colour)
