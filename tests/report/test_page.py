"""The page in a browser: it says what the records say, and everything on it can be read."""

from __future__ import annotations

import csv
import json
import random
import re
import shutil
import statistics
from itertools import chain
from math import floor, log10

import numpy as np
import pytest

from strainbench.bench.columns import RUN_COLUMNS, STEP_COLUMNS
from strainbench.bench.records import RUNS, STEPS, append_rows, latest_runs, latest_steps
from strainbench.report import write_report
from strainbench.report.measures import cut_off_by_clock
from tests.browser import Browser, chromium
from tests.imports import HERE
from tests.report.test_report import row

LARGEST = 5_000_000  # bytes
SMALLEST = 9.5  # pixels of text
NASTY = 'a|b & 50% _c_ <b>x</b> </script><script>alert("x")</script>'


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    chromium()
    started = Browser(tmp_path_factory.mktemp("profile"))
    yield started
    started.close()


@pytest.fixture(scope="module")
def field(tmp_path_factory):
    """The report of records that stay as they are: two sizes, 18 methods."""
    folder = tmp_path_factory.mktemp("field") / "field"
    shutil.copytree(HERE / "tests/report/records/field", folder)
    write_report(folder)
    return folder


@pytest.fixture(scope="module")
def page(browser, field):
    shown = browser.open(field / "index.html")
    shown.until(DRAWN)
    return shown


def report_of(folder, *rows, steps=()):
    append_rows(folder / RUNS, RUN_COLUMNS, rows)
    append_rows(folder / STEPS, STEP_COLUMNS, steps)
    write_report(folder)
    return folder / "index.html"


def read(folder, name):
    with (folder / name).open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


# --- what it says


def shown_number(text):
    """Two significant digits with a unit, as a number in SI units."""
    number, unit = re.fullmatch(r"([\d.]+) (\S+)", text).groups()
    return float(number) * {"s": 1, "ms": 1e-3, "µs": 1e-6}[unit]


def two_digits(value):
    return round(value, 1 - floor(log10(abs(value))))


def test_the_headline_is_what_the_records_say(page, field):
    """Worked out anew from the files alone."""
    active = {}
    for step in read(field, "steps.csv"):
        if float(step["active_constraints"] or 0) > 0:
            active.setdefault(step["cell"], []).append(float(step["seconds"]))
    race = {}
    for run in read(field, "runs.csv"):
        if run["outcome"] == "optimal":
            time = statistics.median(active[run["cell"]])
            race.setdefault(int(run["resolution"]), []).append((time, run["solver"]))
    ranked = [sorted(race[size]) for size in sorted(race)]
    said = page.run("document.querySelector('h1').textContent.trim().replace(/\\s+/g, ' ')")
    pattern = (
        r"(\S+) reaches the optimum first: (.+) a projection at 20×20 and (.+) at 40×40, "
        r"(\S+) and (\S+) times sooner than (\S+), the next\."
    )
    winner, *times, one, two, second = re.fullmatch(pattern, said).groups()
    assert [(first[1], next_[1]) for first, next_, *_ in ranked] == [(winner, second)] * 2
    for text, (first, *_) in zip(times, ranked, strict=True):
        assert shown_number(text) == pytest.approx(two_digits(first[0]))
    for text, (first, next_, *_) in zip((one, two), ranked, strict=True):
        assert float(text) == pytest.approx(two_digits(next_[0] / first[0]))


def each(page, selector, expression):
    """What an expression in `e` comes to for each element."""
    return page.run(
        f"[...document.querySelectorAll({json.dumps(selector)})].map((e) => {expression})"
    )


def test_every_row_is_in_the_page(page, field):
    cells = {run["cell"] for run in read(field, "runs.csv")}
    assert set(page.run("data.cells.map((cell) => cell.id)")) == cells
    assert set(each(page, "#cells tr[data-cell]", "e.dataset.cell")) == cells


def test_every_entry_of_a_row_is_in_its_record(page, field):
    for run in read(field, "runs.csv")[::7]:
        found = page.run(f"record({json.dumps(run['cell'])})")
        for name, value in run.items():
            if name == "solver" and value != found[name]:
                continue  # what tells it apart is added
            same = found[name] in (value, None) or float(found[name]) == float(value)
            assert same, (name, value, found[name])


UNITS = {"s": 1, "ms": 1e-3, "µs": 1e-6, "m": 1e3, "cm": 10, "mm": 1, "µm": 1e-3, "nm": 1e-6}
TWO_DIGITS, POWER, DRAWN_TO = 0.06, 0.5, 1e-4  # relative


def expected_of(field):
    """What each cell comes to, in s and mm, worked out anew from the files alone."""
    active = {}
    for step in read(field, "steps.csv"):
        if float(step["active_constraints"] or 0) > 0:
            active.setdefault(step["cell"], []).append(float(step["seconds"]))
    found = {}
    for run in read(field, "runs.csv"):
        if run["cell"] not in active:  # without a step nothing is shown
            continue
        low, time, high = np.quantile(active[run["cell"]], [0.25, 0.5, 0.75])
        far = {"mm": "distance_max", "bound": "distance_bound_max", "error": "reference_error_max"}
        found[run["cell"]] = {
            **{"time": time, "low": low, "high": high, "mean": float(run["solve_seconds_mean"])},
            **{key: 1000 * float(run[name] or "nan") for key, name in far.items()},
            "gap": float(run["relative_gap_max"] or "nan"),
            "violation": float(run["max_violation"] or "nan"),
        }
    return found


def in_tables(page, expected):
    """(where, what is shown, what it should be, to what share of it) of Table 1, list of cells."""
    cell = "e.closest('[data-cell]').dataset.cell"
    every = each(
        page,
        "#table1 td[data-column], #cells td[data-column]",
        f"[e.dataset.cell ?? {cell}, e.dataset.column, e.textContent.trim()]",
    )
    for of, column, text in every:
        texts = text.split(" \N{EN DASH} ") if column == "quartiles" else [text]
        names = {"quartiles": ("low", "high"), "distance": ("mm",)}.get(column, (column,))
        for shown, name in zip(texts, names, strict=False):
            if not shown[-1:].isdigit():
                continue
            scale = 1000 if name in ("time", "mean", "low", "high") else 1
            right = expected[of]["error" if shown.startswith("<") else name]
            share = POWER if name in ("gap", "violation") else TWO_DIGITS
            yield (column, of), float(shown.lstrip("<")), scale * right, share


def with_unit(text):
    number, unit = text.split(" ")
    return float(number) * UNITS[unit]


def in_charts(page, expected):
    """The same of what is drawn, and of what hovering shows."""
    script = """(async () => (await specsOf('distance')))()"""
    for name, specs in page.run(script).items():
        points = [
            p for rows in specs["page"]["datasets"].values() for p in rows if "quartiles" in p
        ]
        assert points
        for point in points:
            right, where = expected[point["cell"]], (name, point["cell"])
            yield where, point["seconds"], right["time"], DRAWN_TO
            yield where, point["high"], right["high"], DRAWN_TO
            yield where, point["value"], right["mm"], DRAWN_TO
            yield where, with_unit(point["time"]), right["time"], TWO_DIGITS
            low, high = map(with_unit, point["quartiles"].split(" to "))
            yield where, low, right["low"], TWO_DIGITS
            yield where, high, right["high"], TWO_DIGITS
            yield where, with_unit(point["accuracy"]), right["mm"], TWO_DIGITS
            yield where, with_unit(point["certified"]), right["bound"], TWO_DIGITS
            yield where, float(point["violation"]), right["violation"], POWER


def in_steps(page, field):
    """The same of each step in a cell's record."""
    shown = page.run("data.steps.of")
    names = ("seconds", "max_violation", "relative_gap", "distance")
    for step in read(field, "steps.csv"):
        mine = next(s for s in shown[step["cell"]] if s[0] == int(step["step"]))
        for value, name in zip(mine[1:], names, strict=False):
            if step[name] and value is not None:
                yield (name, step["cell"]), float(value), float(step[name]), 1e-4


def in_scores(page, field):
    """The same of the scores: per cent solved, shifted geometric means, paired ratios."""
    runs = {run["cell"]: run for run in read(field, "runs.csv")}
    had = [s for s in read(field, "steps.csv") if float(s["active_constraints"] or 0) > 0]
    places = sorted({(runs[s["cell"]]["resolution"], s["step"]) for s in had})
    limits = {run["resolution"]: float(run["time_limit"]) for run in runs.values()}
    lines = each(page, "#profile tbody tr", "[...e.cells].map((c) => c.textContent.trim())")
    times = {method: {} for method, *_ in lines}
    for s in had:
        run = runs[s["cell"]]
        if s["outcome"] == "optimal" and run["solver"] in times:
            times[run["solver"]][run["resolution"], s["step"]] = float(s["seconds"])
    shift = statistics.median(min(of[p] for of in times.values() if p in of) for p in places)

    def mean(method, scale):
        charged = np.array([times[method].get(p, limits[p[0]]) for p in places])
        return np.exp(np.log(charged + scale * shift).mean()) - scale * shift

    best = lines[0][0]
    for method, share, *ratios, paired, pairs in lines:
        own, other = times[method], times[best]
        yield ("score", method), float(share), 100 * len(own) / len(places), 0.1
        if own:
            for scale, ratio in zip((0.1, 1.0, 10.0), ratios, strict=True):
                least = min(mean(each_, scale) for each_ in times)
                yield (
                    ("shift", scale, method),
                    float(ratio),
                    mean(method, scale) / least,
                    TWO_DIGITS,
                )
            both = [own[p] / other[p] for p in own if p in other]
            yield ("paired", method), float(paired), np.exp(np.log(both).mean()), TWO_DIGITS
            yield ("pairs", method), float(pairs), len(both), 0


@pytest.fixture(scope="module")
def failing(browser, tmp_path_factory):
    """The report of committed results: hard cases, energies, sweeps; some made warm."""
    folder = tmp_path_factory.mktemp("failing") / "failing"
    folder.mkdir()
    for source in (HERE / "results" / name for name in ("failures", "sweeps", "swing-short")):
        append_rows(folder / RUNS, RUN_COLUMNS, latest_runs(source).values())
        append_rows(folder / STEPS, STEP_COLUMNS, latest_steps(source))
    twins, steps = warm_twins(HERE / "results/swing-short")
    append_rows(folder / RUNS, RUN_COLUMNS, twins)
    append_rows(folder / STEPS, STEP_COLUMNS, steps)
    write_report(folder)
    shown = browser.open(folder / "index.html", hash_="#scene=*")
    shown.until("document.body.dataset.drawn !== undefined")
    yield folder, shown
    shown.close()


def warm_twins(source):
    """Cells of three methods as if they had started warm: sooner, nearer, in fewer iterations."""
    runs = [r for r in latest_runs(source).values() if r["solver"] in WARMED]
    twins = [
        run
        | {"cell": f"{run['cell']}-w", "solver": f"{run['solver']}-warm"}
        | {"solver_parameters": json.dumps({"warm": True})}
        | {k: float(run[k]) / 1.7 for k in ("iterations_mean", "distance_max")}
        for run in runs
    ]
    cells = {run["cell"]: k for k, run in enumerate(runs, start=2)}
    steps = [
        step
        | {"cell": f"{step['cell']}-w", "seconds": float(step["seconds"]) / cells[step["cell"]]}
        for step in latest_steps(source)
        if step["cell"] in cells
    ]
    return twins, steps


WARMED = ("newton-ipm", "clarabel", "gauss-seidel")


def in_warm(page, runs, steps):
    """The same of cold and warm starts beside each other."""
    table = "[...e.querySelectorAll('th')].some((h) => h.textContent.startsWith('cold over warm'))"
    rows = "[...e.tBodies[0].rows].map((r) => [...r.cells].map((c) => c.textContent))"
    lines = f"{table} ? {rows} : []"
    for scene, bound, method, ratio, *others in chain(*each(page, "#table table", lines)):
        limit, size = float(bound.rstrip("%")) / 100, re.search(r"(\d+)×", scene)[1]
        pair = [
            run
            for name in (method, f"{method}-warm")
            for run in runs.values()
            if run["solver"] == name and (run["scenario"], run["resolution"]) == ("swing", size)
            if float(run["limit"]) == limit
            and run["mode"] == "simulate"
            and run["steps_asked"] == "10"
            if f"{run['cell'].removesuffix('-w')}-w" in runs
        ]
        medians = [
            statistics.median(
                float(s["seconds"])
                for s in steps[run["cell"]]
                if float(s["active_constraints"]) > 0
            )
            for run in pair
        ]
        where = (scene, bound, method)
        yield where, float(ratio), medians[0] / medians[1], 5e-3
        for run, iterations, distance in zip(pair, others[:2], others[2:], strict=True):
            yield where, float(iterations), float(run["iterations_mean"]), 1e-3
            column = "reference_error_max" if distance.startswith("<") else "distance_max"
            yield where, float(distance.lstrip("<")), 1000 * float(run[column]), TWO_DIGITS


def in_matrix(page, runs):
    """(where, what is shown, what it should be, to what share of it) of the hard cases."""
    for line in page.run("data.failures"):
        found = re.search(r"(gap|violated by) ([\d.e-]+)", line["found"])
        if found:
            name = "relative_gap_max" if found[1] == "gap" else "max_violation"
            right = float(runs[line["cell"]][name])
            yield (line["case"], line["method"]), float(found[2]), right, POWER


def in_sweeps(page, runs):
    """The same of the points of the sweeps' charts."""
    specs = page.run("(async () => (await specsOf('')))()")
    for name, chart in specs.items():
        if not name.startswith("sweep-"):
            continue
        column = "distance_max" if "-distance" in name else "max_principal_stretch"
        for point in (p for rows in chart["page"]["datasets"].values() for p in rows):
            if "cell" in point and "-time" not in name:
                run = runs[point["cell"]]
                value, limit = float(run[column]), float(run["limit"])
                far = column == "distance_max"
                right, floor = (1000 * value, 1e-6) if far else (100 * (value - 1 - limit), 1e-7)
                yield (name, point["cell"]), point["y"], max(right, floor), DRAWN_TO


def in_energies(folder, steps):
    """The same of the energies in numbers: of each run's first step and last one done, in mJ."""
    firsts, lasts = set(), set()
    for of in steps.values():
        told = [s for s in of if s["kinetic_energy"] and not cut_off_by_clock(s["status"])]
        if told:
            sums = [sum(float(s[f"{part}_energy"]) for part in PARTS) for s in (told[0], told[-1])]
            firsts.add(1000 * sums[0])
            lasts.add(1000 * sums[1])
    for line in (folder / "energy.md").read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip("|").split(" | ")]
        if len(cells) > 7 and cells[2].isdigit():
            for shown, known in ((cells[4], firsts), (cells[6], lasts)):
                right = min(known, key=lambda value: abs(value - float(shown)))
                yield line, float(shown), right, 1e-3


PARTS = ("kinetic", "gravity", "membrane", "bending", "contact")


@pytest.mark.slow
def test_numbers_of_hard_cases_sweeps_energies_and_warm_starts_trace_to_rows(failing):
    folder, page = failing
    runs = {run["cell"]: run for run in read(folder, "runs.csv")}
    steps, chosen = {}, random.Random(0)
    for step in read(folder, "steps.csv"):
        steps.setdefault(step["cell"], []).append(step)
    kinds = (in_matrix(page, runs), in_sweeps(page, runs), in_energies(folder, steps))
    for found in (*kinds, in_warm(page, runs, steps)):
        every = list(found)
        assert every
        for where, shown, right, share in chosen.sample(every, min(50, len(every))):
            assert shown == pytest.approx(right, rel=share), where


def test_numbers_trace_to_rows(page, field):
    """Fifty at random of each kind: tables, charts with what hovering shows, steps, scores."""
    expected, chosen = expected_of(field), random.Random(0)
    kinds = [in_tables(page, expected), in_charts(page, expected), in_steps(page, field)]
    for found in [*map(list, kinds), list(in_scores(page, field))]:
        for where, shown, right, share in chosen.sample(found, min(50, len(found))):
            assert shown == pytest.approx(right, rel=share), where


def ask(page, mm, ms, size):
    page.run(
        f"byId('asked-mm').value = '{mm}'; byId('asked-ms').value = '{ms}';"
        f"byId('asked-size').value = '{size}';"
        "byId('question').dispatchEvent(new Event('change'))"
    )
    return page.run("byId('answer').textContent")


def test_the_question_is_answered_from_the_records(page):
    said = ask(page, 0.1, 20, "20×20")
    assert said.startswith("newton-ipm: 11 ms, 2.0 µm.")
    assert "clarabel takes 3.5× the time" in said
    assert ask(page, 0.1, 20, "40×40").startswith(
        "None of those measured. Nearest misses: newton-ipm"
    )
    said = ask(page, 0.1, 20, "60×60")
    assert said.startswith("Not measured at 60×60.")
    assert "strainbench recommend swing --set resolution=60" in said
    assert "--measure" in said


# --- how it behaves


def rows_of(page):
    return each(page, "#cells tbody tr", "[...e.cells].map((c) => c.textContent.trim())")


def test_filters_hold_together_and_stay_in_the_hash(page, browser, field):
    page.run(
        "for (const [name, value] of [['size', '20×20'], ['ending', 'feasible']]) {"
        " const s = document.querySelector(`#filters select[name=${name}]`);"
        " s.value = value; s.dispatchEvent(new Event('change')); }"
    )
    left = each(page, "#cells tbody tr", "cellOf.get(e.dataset.cell)")
    assert {(cell["size"], cell["ending"]) for cell in left} == {("20×20", "feasible")}
    hash_ = page.run("location.hash")
    again = browser.open(field / "index.html", hash_=hash_)
    again.until(DRAWN)
    assert rows_of(again) == rows_of(page)
    again.close()
    page.run("document.querySelector('#filters button').click()")
    assert len(rows_of(page)) == 36


def test_a_chip_dims_all_others_and_again_undoes_it(page):
    bright = ("#table1 tr[data-method]:not(.dim)", "e.dataset.method")
    for expected in (["clarabel"], None):
        page.run("document.querySelector('.chip[data-method=clarabel]').click()")
        left = each(page, *bright)
        assert left == expected if expected else len(left) == 17


def test_heads_sort(page):
    head = "document.querySelectorAll('#table1 thead tr:last-child th')[2]"
    for direction, reverse in (("ascending", False), ("descending", True)):
        page.run(f"{head}.querySelector('button').click()")
        assert page.run(f"{head}.getAttribute('aria-sort')") == direction
        keys = each(page, "#table1 tbody tr", "e.cells[2].dataset.sort")
        times = [float(key) for key in keys if key]
        assert times == sorted(times, reverse=reverse)
        assert len(times) == 17


def test_the_drawer_has_a_cells_record_and_steps(page):
    page.run("document.querySelector('#table1 tr[data-method=dykstra]').click()")
    said = page.run("byId('drawer').innerText")
    for words in ("dykstra", "time limit", "strainbench run swing --mode replay --solver dykstra"):
        assert words in said
    assert page.run("document.querySelectorAll('#drawer tbody tr').length") == 8
    assert "cell=" in page.run("location.hash")
    page.run("document.dispatchEvent(new KeyboardEvent('keydown', {key: 'Escape'}))")
    assert page.run("byId('drawer').hidden")


def test_it_opens_without_a_network_or_a_fault_and_is_small(page, field):
    assert page.faults() == []
    assert page.requests() == []
    assert (field / "index.html").stat().st_size < LARGEST


SHOWN = "[...document.querySelectorAll('body *')].filter((e) => e.getClientRects().length)"
WIDER = """.filter((e) => !e.closest('.scroll, #matrix, #chips')
  && e.getBoundingClientRect().right > innerWidth + 1).map((e) => e.outerHTML.slice(0, 120))"""
TINY = f""".filter((e) => [...e.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim())
  && parseFloat(getComputedStyle(e).fontSize) < {SMALLEST}).map((e) => e.outerHTML.slice(0, 120))"""
DRAWN = """document.body.dataset.drawn
  === String(document.querySelectorAll('figure.chart:not([hidden])').length)"""


@pytest.mark.parametrize("width", [1280, 390])
def test_nothing_is_wider_than_the_window_and_no_text_too_small(browser, field, width):
    shown = browser.open(field / "index.html", width)
    shown.until(DRAWN)
    assert shown.run("innerWidth") == width
    assert shown.run("document.documentElement.scrollWidth") <= width
    assert shown.run(SHOWN + WIDER) == []
    assert shown.run(SHOWN + TINY) == []
    shown.close()


# --- folders that are hardly any


def opened(browser, path):
    shown = browser.open(path)
    shown.until("document.body.dataset.drawn !== undefined")
    assert shown.faults() == []
    return shown, " ".join(shown.run("document.querySelector('main').innerText").split())


def test_one_single_row(browser, tmp_path):
    shown, text = opened(browser, report_of(tmp_path, row("newton-ipm")))
    assert "newton-ipm reaches the optimum on every step: 20 ms a projection at 10×10." in text
    shown.close()


def test_failures_alone(browser, tmp_path):
    failed = {"outcome": "no answer", "steps_done": 0, "distance_max": "", "max_violation": ""}
    rows = [row(name, reason="crashed: of itself", **failed) for name in ("admm", "xpbd")]
    shown, text = opened(browser, report_of(tmp_path, *rows))
    assert "No method keeps the limits on every step." in text
    assert "None of those measured." in text
    shown.close()


@pytest.mark.filterwarnings("ignore:constrained_layout")
def test_names_are_text_and_nothing_else(browser, tmp_path):
    rows = [row(NASTY, reason=NASTY), row("admm", scenario=NASTY)]
    shown, text = opened(browser, report_of(tmp_path, *rows))
    assert NASTY in text
    shown.run("document.querySelector('#table1 tr[data-cell]').click()")
    assert (
        shown.run("document.querySelectorAll('main b b, main b script, #drawer script').length")
        == 0
    )
    assert shown.run("document.querySelectorAll('script:not([data-specs])').length") == 4
    shown.close()


def test_a_kind_of_failure_is_told_and_chosen(browser, tmp_path):
    failed = {"outcome": "violated", "failure": "inverted", "failure_step": "3"}
    measured = {"min_principal_stretch": "0.25", "jitter": "0.125"}
    shown, _ = opened(browser, report_of(tmp_path, row("admm", **failed, **measured), row("cvxpy")))
    assert "inverted, first in step 3" in each(shown, "#cells .sign", "e.title")[0]
    select = "document.querySelector('#filters select[name=failure]')"
    shown.run(f"{select}.value = 'inverted'; {select}.dispatchEvent(new Event('change'))")
    assert [cells[0] for cells in rows_of(shown)] == ["admm"]
    shown.run("document.querySelector('#cells tr[data-cell]').click()")
    said = shown.run("byId('drawer').innerText").split("\n")
    for name, value in (
        ("failure", "inverted, first in step 3"),
        ("least principal stretch", "0.250"),
        ("jitter", "0.13"),
    ):
        assert said[said.index(name) + 1] == value
    shown.close()


def test_claims_of_a_folder_stand_on_its_page(browser, tmp_path):
    head = "claim,where,words,verdict,numbers,from another side\n"
    lines = "T2,5.1,It is <b>fast</b>.,holds,2 times,\nT1,5,It holds.,does not hold here,3 mm,\n"
    (tmp_path / "claims.csv").write_text(head + lines)
    shown, _ = opened(browser, report_of(tmp_path, row("admm")))
    verdicts = "#claims tbody td:nth-child(4)"
    assert each(shown, verdicts, "e.textContent") == ["✓ holds", "✗ does not hold here"]
    assert each(shown, "#claims tbody td:nth-child(3)", "e.textContent")[0] == "It is <b>fast</b>."
    shown.run("document.querySelector('#claims th button').click()")
    assert each(shown, verdicts, "e.textContent") == ["✗ does not hold here", "✓ holds"]
    shown.close()


def test_a_map_is_drawn_where_it_was_run(browser, tmp_path):
    limits = {"2%": "optimal", "1%": "violated"}
    rows = [
        row("admm", cell=word, outcome=outcome, scenario_parameters=f'{{"limit": 0.0{word[0]}}}')
        for word, outcome in limits.items()
    ]
    lines = [f"admm,{word},1/60,{outcome},,1,1,0.1,{word}" for word, outcome in limits.items()]
    head = "method,x,y,outcome,why,first failing step,share of steps,median,cell"
    (tmp_path / "map.csv").write_text("\n".join([head, *lines, "admm,3%,1/60,optimal,,,,,gone"]))
    shown, _ = opened(browser, report_of(tmp_path, *rows))
    assert each(shown, ".map tr:last-child th", "e.textContent") == ["y ↑ limit →", "1%", "2%"]
    signs = each(shown, ".map .square", "[e.textContent, e.title.split('; ')[0]]")
    assert signs == [["✗", "admm at limit 1%, y 1/60"], ["✓", "admm at limit 2%, y 1/60"]]
    shown.run("document.querySelector('.map .square').click()")
    assert "violates the limits" in shown.run("byId('drawer').innerText")
    shown.close()


def test_all_of_many_cases_are_drawn_when_they_come_into_view(browser, tmp_path):
    many = 30
    rows = [row("admm", cell=str(k), scenario_parameters=f'{{"step": {k}.5}}') for k in range(many)]
    shown = browser.open(report_of(tmp_path, *rows), hash_="#scene=*")
    shown.until("document.body.dataset.drawn !== undefined")
    figures = "[...document.querySelectorAll('#speed figure.chart:not([hidden])')]"
    assert shown.run(f"{figures}.length") == many
    last = f"{figures}.at(-1)"
    assert not shown.run(f"{last}.classList.contains('drawn')")
    shown.run(f"{last}.scrollIntoView()")
    shown.until(f"{last}.querySelector('svg') && {last}.classList.contains('drawn')")
    assert shown.faults() == []
    shown.close()
