"""The results folder: what is written is read back, and what is damaged is said to be."""

from __future__ import annotations

import csv
import json
import os
import re
import resource
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from strainbench.bench.columns import (
    COUNTS,
    FACTS,
    RUN_COLUMNS,
    SETTINGS,
    SEVERAL,
    STEP_COLUMNS,
    WORDS,
)
from strainbench.bench.records import (
    LONGEST_TEXT,
    MACHINES,
    RUNS,
    SCHEMA,
    STEPS,
    DiskError,
    RecordsError,
    append_rows,
    latest_runs,
    latest_steps,
    mend,
    open_folder,
    read_machines,
    read_rows,
    remember_machine,
    write_cell,
    write_rows,
)
from strainbench.escape import quoted
from strainbench.files import check_held, locked, uninterrupted, write_whole

FIXED = [
    "scenario",
    "resolution",
    "limit",
    "directions",
    "integrator",
    "solver",
    "tolerance",
    "mode",
    "steps_asked",
    "steps_done",
    "outcome",
    "reason",
    "solve_seconds_mean",
    "solve_seconds_median",
    "setup_seconds",
    "ie_seconds_mean",
    "iterations_mean",
    "max_violation",
    "max_principal_stretch",
    "relative_gap_max",
    "distance_max",
    "variables",
    "constraints",
    "peak_memory_mb",
    "machine",
]


def some(column):
    """A value that fits."""
    if column in SETTINGS:
        return json.dumps({"of": column})
    if column in SEVERAL:
        return "0.5 1e-3"
    return f"some {column}" if column in WORDS else 3 if column in COUNTS else -0.25


def run_row(cell="a", **values):
    return {c: some(c) for c in RUN_COLUMNS} | {"schema": SCHEMA, "cell": cell} | values


def step_row(**values):
    return {c: some(c) for c in STEP_COLUMNS} | values


def step_rows(cell, count, **values):
    return [step_row(cell=cell, projection=k + 1, **values) for k in range(count)]


def as_text(row):
    return {name: str(value) for name, value in row.items()}


@pytest.fixture
def runs(tmp_path):
    """A sound runs.csv of three rows."""
    path = tmp_path / RUNS
    append_rows(path, RUN_COLUMNS, [run_row(c) for c in "abc"])
    return path


# --- what is written is read back


def test_the_columns_that_others_read_are_there():
    assert set(FIXED) <= set(RUN_COLUMNS)


def test_rows_are_read_back(tmp_path):
    path = tmp_path / RUNS
    rows = [run_row("a"), run_row("b")]
    for row in rows:
        append_rows(path, RUN_COLUMNS, [row])
    assert read_rows(path, RUN_COLUMNS) == [as_text(row) for row in rows]


def test_the_header_is_written_once(runs):
    append_rows(runs, RUN_COLUMNS, [run_row("d")])
    assert runs.read_text().count("schema,cell,") == 1
    assert len(read_rows(runs, RUN_COLUMNS)) == 4


def test_step_rows_are_read_back(tmp_path):
    path = tmp_path / STEPS
    rows = [step_row(step=k) for k in range(3)]
    append_rows(path, STEP_COLUMNS, rows)
    assert read_rows(path, STEP_COLUMNS) == [as_text(row) for row in rows]


def test_nan_is_an_empty_field(tmp_path):
    append_rows(tmp_path / RUNS, RUN_COLUMNS, [run_row(max_violation=float("nan"))])
    assert read_rows(tmp_path / RUNS, RUN_COLUMNS)[0]["max_violation"] == ""


@pytest.mark.parametrize("value", [0.1 + 0.2, 1e-300, 123456789.123456789])
def test_numbers_keep_all_their_digits(tmp_path, value):
    append_rows(tmp_path / RUNS, RUN_COLUMNS, [run_row(max_violation=value)])
    (row,) = read_rows(tmp_path / RUNS, RUN_COLUMNS)
    assert row["max_violation"] == repr(value)


@pytest.mark.parametrize(
    "reason",
    [
        "",
        "a, b",
        'it said "no"',
        '"',
        "two\nlines",
        "a progress bar\rover itself",
        "two\r\nlines",
        "\r",
        "Thomaszewski, Straßer: ‖x‖ ≤ 1\u2028",
        "nul \x00",
        "' ; # \\ \t",
        "x" * 200_000,
        "a lone surrogate \udcff, as in a path that is not UTF-8",
    ],
    ids=lambda r: repr(r)[:20].encode("ascii", "replace").decode(),
)
def test_any_reason_is_read_back_and_leaves_the_file_sound(tmp_path, reason):
    path = tmp_path / RUNS
    append_rows(path, RUN_COLUMNS, [run_row("a", reason=reason), run_row("b")])
    first, second = read_rows(path, RUN_COLUMNS)
    assert second["cell"] == "b"
    expected = " ".join(reason.encode(errors="replace").decode().split())
    assert first["reason"] == expected[:LONGEST_TEXT]


def test_no_file_is_no_rows(tmp_path):
    assert read_rows(tmp_path / RUNS, RUN_COLUMNS) == []
    assert latest_runs(tmp_path) == {}
    assert read_machines(tmp_path) == {}


def test_an_empty_file_is_started_and_read_alike(tmp_path):
    """A run that is killed as it creates the file leaves one, which is then written to."""
    path = tmp_path / RUNS
    path.write_text("")
    assert read_rows(path, RUN_COLUMNS) == []
    append_rows(path, RUN_COLUMNS, [run_row()])
    assert len(read_rows(path, RUN_COLUMNS)) == 1


def test_only_a_header_is_no_rows(tmp_path):
    path = tmp_path / RUNS
    append_rows(path, RUN_COLUMNS, [])
    assert read_rows(path, RUN_COLUMNS) == []


def test_the_newest_row_of_a_cell_counts_in_the_order_of_the_first(runs):
    append_rows(runs, RUN_COLUMNS, [run_row("a", outcome="newest"), run_row("d")])
    latest = latest_runs(runs.parent)
    assert list(latest) == ["a", "b", "c", "d"]
    assert latest["a"]["outcome"] == "newest"
    assert latest["b"]["outcome"] == "some outcome"


def test_a_column_that_is_not_ours_is_refused(runs):
    before = runs.read_bytes()
    with pytest.raises(ValueError, match="colour"):
        append_rows(runs, RUN_COLUMNS, [run_row(colour="red")])
    assert runs.read_bytes() == before


# --- older and newer files


def older(path, columns, left_out, rows):
    """Write a file as a strainbench did that lacked some columns."""
    kept = [c for c in columns if c not in left_out]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, kept, extrasaction="ignore", lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    return path


@pytest.mark.parametrize("left_out", [["machine"], ["machine", "judge_seconds"], ["needs"]])
def test_columns_that_an_older_header_lacks_are_empty(tmp_path, left_out):
    rows = [run_row(c, schema=1) for c in "ab"]
    path = older(tmp_path / RUNS, RUN_COLUMNS, left_out, rows)
    before = path.read_bytes()
    expected = [as_text(row | dict.fromkeys(left_out, "")) for row in rows]
    assert read_rows(path, RUN_COLUMNS) == expected
    assert path.read_bytes() == before


def test_appending_to_an_older_header_makes_it_todays_and_loses_nothing(tmp_path):
    path = older(tmp_path / RUNS, RUN_COLUMNS, ["machine"], [run_row(c, schema=1) for c in "ab"])
    append_rows(path, RUN_COLUMNS, [run_row("c")])
    assert path.read_text(encoding="utf-8").splitlines()[0] == ",".join(RUN_COLUMNS)
    rows = read_rows(path, RUN_COLUMNS)
    assert [(r["cell"], r["schema"], r["machine"]) for r in rows] == [
        ("a", "1", ""),
        ("b", "1", ""),
        ("c", str(SCHEMA), "some machine"),
    ]
    assert [f.name for f in tmp_path.iterdir()] == [RUNS]


def test_an_older_file_is_kept_if_it_cannot_be_rewritten(tmp_path, full_disk):
    path = older(tmp_path / RUNS, RUN_COLUMNS, ["machine"], [run_row(c, schema=1) for c in "ab"])
    before = path.read_bytes()
    with full_disk(100), pytest.raises(DiskError):
        append_rows(path, RUN_COLUMNS, [run_row("c")])
    assert path.read_bytes() == before
    assert [f.name for f in tmp_path.iterdir()] == [RUNS]


def test_a_newer_schema_is_refused_by_its_number(runs):
    text = runs.read_text().replace(f"\n{SCHEMA},", f"\n{SCHEMA + 1},", 1)
    words = f"written by a newer strainbench .schema {SCHEMA + 1}; this one reads up to {SCHEMA}"
    for content in (text, "".join(f"{line},more\n" for line in text.splitlines())):
        runs.write_text(content)
        with pytest.raises(RecordsError, match=words):
            latest_runs(runs.parent)
        with pytest.raises(RecordsError, match=words):
            mend(runs.parent)
        assert runs.read_text() == content


def test_newer_steps_are_refused_by_their_columns(tmp_path):
    path = tmp_path / STEPS
    path.write_text(",".join([*STEP_COLUMNS, "colour"]) + "\n")
    with pytest.raises(RecordsError, match="a newer strainbench, which also records colour"):
        read_rows(path, STEP_COLUMNS)


@pytest.mark.parametrize("change", [lambda t: "\ufeff" + t, lambda t: t.replace("\n", "\r\n")])
def test_what_a_spreadsheet_leaves_is_read_and_appended_to(runs, change):
    before = read_rows(runs, RUN_COLUMNS)
    runs.write_bytes(change(runs.read_text()).encode())
    assert read_rows(runs, RUN_COLUMNS) == before
    append_rows(runs, RUN_COLUMNS, [run_row("d")])
    assert read_rows(runs, RUN_COLUMNS) == [*before, as_text(run_row("d"))]


def test_fields_of_any_length_are_read(tmp_path):
    long = json.dumps({"path": "x" * 200_000})
    append_rows(
        tmp_path / RUNS, RUN_COLUMNS, [run_row(solver_parameters=long, needs="y" * 200_000)]
    )
    (row,) = read_rows(tmp_path / RUNS, RUN_COLUMNS)
    assert (row["solver_parameters"], row["needs"]) == (long, "y" * 200_000)


# --- damage is named, in one line, and the file is left as it is


def damages(text):
    header, first, *rest = text.splitlines(keepends=True)
    yield "wrong order", r"line 1: it is no header", text.replace("schema,cell", "cell,schema", 1)
    yield "no header", r"line 1: it is no header", first + "".join(rest)
    yield "other text", r"line 1: it is no header", "hello\n"
    yield "other text without an end", r"line 1: it is no header", "hello"
    yield "blank", r"line 1: it is no header", "\n\n"
    yield "a blank before", r"line 1: it is no header", "\n" + text
    yield "a mark alone", r"line 1: it is no header", "\ufeff"
    yield "ends of another system", r"line 1: it is no header", text.replace("\n", "\r")[:-5]
    yield (
        "a column of another",
        r"line 1: it is no header",
        text.replace(",machine,", ",engine,", 1),
    )
    count = len(RUN_COLUMNS)
    yield "short record", rf"record 3 has 2 fields where {count}", "".join([header, first, "1,b\n"])
    yield "long record", rf"record 2 has {count + 1} fields", header + first.strip() + ",more\n"
    yield "blank line", r"record 3 has 0 fields", "".join([header, first, "\n", *rest])
    yield "header twice", r"record 3: the header once more", "".join([header, first, header, *rest])
    yield "open quote", r"record 3 has \d+ fields", "".join([header, first, '1,"b,', *rest])
    name = RUN_COLUMNS[-1]
    last = text[: text.rindex(",") + 1] + f'"{some(name)}\n'
    yield "open quote at the end", rf"record 4, column {name}: an end of line", last
    for name, wrong, valid in [
        ("schema", "two", f"1 to {SCHEMA} is"),
        ("schema", "0", f"1 to {SCHEMA} is"),
        ("schema", "", f"1 to {SCHEMA} is"),
        ("solve_seconds_mean", "abc", "a number is"),
        ("solve_seconds_mean", "1_000", "a number is"),
        ("solve_seconds_mean", "0,5", "a number is"),
        ("max_violation", "1\0", "a number is"),
        ("max_violation", "9" * 200_000 + "x", "a number is"),
        ("steps_done", "-3", "a whole number from 0 on is"),
        ("steps_asked", "2.5", "a whole number from 0 on is"),
        ("scenario_parameters", '{"limit": ', "a JSON object is"),
        ("solver_parameters", "[" * 100_000, "a JSON object is"),
        ("details_mean", "[1]", "a JSON object is"),
    ]:
        values = {n: str(v) for n, v in run_row("b").items()} | {name: wrong}
        quoted = ",".join('"' + v.replace('"', '""') + '"' for v in values.values())
        words = rf"record 3, column {name}: '.*' where {valid} valid"
        yield f"{name} {wrong[:9]}", words, "".join([header, first, quoted, "\n", *rest])


SOUND = ",".join(RUN_COLUMNS) + "\n"


@pytest.mark.parametrize("case", range(28))
@pytest.mark.parametrize("touch", [latest_runs, mend])
def test_a_damaged_file_is_named_and_left_alone(runs, case, touch):
    _, words, text = list(damages(runs.read_text()))[case]
    runs.write_text(text, newline="")
    with pytest.raises(RecordsError, match=words) as caught:
        touch(runs.parent)
    message = str(caught.value)
    assert message.startswith(str(runs))
    assert "nothing was changed" in message
    assert "\n" not in message
    assert len(message) < 400 + len(str(runs))
    assert runs.read_bytes() == text.encode()


def test_all_damages_are_tried(runs):
    assert len(list(damages(runs.read_text()))) == 28


def test_damaged_steps_are_named(tmp_path):
    append_rows(tmp_path / STEPS, STEP_COLUMNS, step_rows("a", 2))
    text = (tmp_path / STEPS).read_text().replace("a,3,2,", "a,-1,2,")
    (tmp_path / STEPS).write_text(text)
    with pytest.raises(RecordsError, match=r"steps\.csv, record 3, column step: '-1' where"):
        read_rows(tmp_path / STEPS, STEP_COLUMNS)


@pytest.mark.parametrize(
    "content", [b"\x89PNG\r\n\x1a\n\x00\xff\xfe", "schema,ä\n".encode("latin-1")]
)
def test_bytes_that_are_not_text_are_named(runs, content):
    runs.write_bytes(content)
    with pytest.raises(RecordsError, match=rf"{RUNS}, line 1: not text"):
        latest_runs(runs.parent)


def test_a_folder_in_place_of_a_file_is_named(tmp_path):
    (tmp_path / RUNS).mkdir()
    with pytest.raises(RecordsError, match=rf"{RUNS} cannot be read .Is a directory"):
        latest_runs(tmp_path)


@given(st.binary(max_size=80))
@settings(deadline=None)
def test_any_bytes_are_rows_or_one_line(content):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / RUNS
        for whole in (content, SOUND.encode() + content, SOUND.encode() + content + b"\n"):
            path.write_bytes(whole)
            try:
                read_rows(path, RUN_COLUMNS)
            except RecordsError as error:
                assert len(str(error).splitlines()) == 1  # noqa: PT017


def test_a_value_that_could_not_be_read_back_is_not_written(runs):
    before = runs.read_bytes()
    with pytest.raises(RecordsError, match="column max_violation: 'much' where a number is valid"):
        append_rows(runs, RUN_COLUMNS, [run_row("d"), run_row("e", max_violation="much")])
    assert runs.read_bytes() == before


# --- an unfinished last line


def torn(text):
    """The file of three rows, cut at every kind of place in the last one."""
    last = text.rstrip("\n").rfind("\n") + 1
    return [text[:-1], text[:-5], text[:-40], text[: last + 30], text[: last + 1], text + "\0\0\0"]


@pytest.mark.parametrize("case", range(6))
def test_an_unfinished_last_line_is_left_out_and_then_cut_away(runs, case, caplog):
    content = torn(runs.read_text())[case]
    kept = list("abc") if content.endswith("\0") else list("ab")
    runs.write_text(content)
    assert list(latest_runs(runs.parent)) == kept
    assert runs.read_text() == content
    mend(runs.parent)
    assert runs.read_text() == content[: content.rfind("\n") + 1]
    append_rows(runs, RUN_COLUMNS, [run_row("d")])
    assert list(latest_runs(runs.parent)) == [*kept, "d"]
    assert [r.getMessage() for r in caplog.records] == [
        f"{runs}: its last line is unfinished and left out",
        f"{runs}: its last line was unfinished and is cut away",
    ]


def test_an_unfinished_header_is_begun_again(tmp_path):
    for length in (1, 40, len(SOUND) - 1):
        (tmp_path / RUNS).write_text(SOUND[:length])
        assert latest_runs(tmp_path) == {}
        append_rows(tmp_path / RUNS, RUN_COLUMNS, [run_row()])
        assert list(latest_runs(tmp_path)) == ["a"]


# --- text that a spreadsheet would run


DANGEROUS = ["=1+1", "+1", "-1", "@SUM(A1)", "\t=1", "\r=1", "'=1", "''@x", "'", "''", "'a", ""]


@given(st.text() | st.sampled_from(DANGEROUS))
@settings(deadline=None)
def test_no_text_is_a_formula(text):
    cell = quoted(text)
    assert str(cell)[:1] not in tuple("=+-@\t\r\uff1d\uff0b\uff0d\uff20")
    assert cell in (text, "'" + text)


@given(st.text() | st.sampled_from(DANGEROUS))
@settings(deadline=None, max_examples=40)
def test_all_text_is_read_back(text):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / RUNS
        row = dict.fromkeys(("solver", "scenario", "reason"), text)
        append_rows(path, RUN_COLUMNS, [run_row("a", **row), run_row("b")])
        first, second = read_rows(path, RUN_COLUMNS)
        append_rows(path, RUN_COLUMNS, [first])  # as what has come from another machine is
        assert read_rows(path, RUN_COLUMNS) == [first, second, first]
    assert first["solver"] == first["scenario"] == re.sub(r"[\r\n]+", " ", text)
    assert first["reason"] == " ".join(text.split())[:LONGEST_TEXT]
    assert second == as_text(run_row("b"))


@pytest.mark.parametrize("text", DANGEROUS[:4])
def test_formulas_are_quoted_in_the_file(tmp_path, text):
    append_rows(tmp_path / RUNS, RUN_COLUMNS, [run_row(reason=text, max_violation=-0.5)])
    with (tmp_path / RUNS).open(encoding="utf-8", newline="") as file:
        (row,) = csv.DictReader(file)
    assert row["reason"] == "'" + text
    assert row["max_violation"] == "-0.5"


# --- a cell's rows: all of them, or none


@pytest.fixture
def held(tmp_path):
    """A locked folder with the rows of one cell."""
    with locked(tmp_path):
        write_cell(tmp_path, run_row("a", projections=3), step_rows("a", 3))
        yield tmp_path


@pytest.fixture
def full_disk():
    """Within this, no file grows beyond a size."""

    class Limit:
        def __init__(self, size):
            self.size = size

        def __enter__(self):
            self.before = resource.getrlimit(resource.RLIMIT_FSIZE)
            resource.setrlimit(resource.RLIMIT_FSIZE, (self.size, self.before[1]))

        def __exit__(self, *_):
            resource.setrlimit(resource.RLIMIT_FSIZE, self.before)

    return Limit


def state(folder):
    return {f.name: f.read_bytes() for f in folder.iterdir()}


@pytest.mark.parametrize("room", [0, 1, 100, 5000])
@pytest.mark.parametrize("name", [RUNS, STEPS])
def test_a_full_disk_tears_no_row(held, full_disk, name, room):
    before = state(held)
    row, steps = run_row("b", projections=40, reason="x" * 9000), step_rows("b", 40)
    if name == RUNS:
        steps = []
    with full_disk((held / name).stat().st_size + room), pytest.raises(DiskError) as caught:
        write_cell(held, row, steps)
    assert f"{held / name}: File too large" in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1
    assert state(held) == before
    write_cell(held, row, steps)  # once there is room
    assert list(latest_runs(held)) == ["a", "b"]
    assert len(latest_steps(held)) == 3 + len(steps)


def test_a_disk_that_fails_at_the_flush_tears_no_row(held, monkeypatch):
    before = state(held)
    calls = []

    def fail(_):
        calls.append(1)
        if len(calls) == 4:  # the note, its folder, the steps, then the row
            raise OSError(5, "Input/output error")

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", fail)
        with pytest.raises(DiskError, match="Input/output error"):
            write_cell(held, run_row("b"), step_rows("b", 2))
    assert state(held) == before


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_within_a_write_comes_after_it_and_once(held, monkeypatch, number):
    class Stopped(Exception):  # noqa: N818
        pass

    def stop(*_):
        raise Stopped

    fsync = os.fsync
    handler = signal.signal(number, stop)
    try:
        with monkeypatch.context() as patch:
            patch.setattr(os, "fsync", lambda f: (signal.raise_signal(number), fsync(f)))
            with pytest.raises(Stopped):
                write_cell(held, run_row("b", projections=2), step_rows("b", 2))
        assert signal.getsignal(number) is stop
    finally:
        signal.signal(number, handler)
    assert [r["cell"] for r in read_rows(held / RUNS, RUN_COLUMNS)] == ["a", "b"]
    assert len(read_rows(held / STEPS, STEP_COLUMNS)) == 5


def test_an_interrupt_is_put_off_through_all_levels():
    done = []

    def work():
        with uninterrupted():
            with uninterrupted():
                signal.raise_signal(signal.SIGINT)
                done.append("inner")
            done.append("outer")

    with pytest.raises(KeyboardInterrupt):
        work()
    assert done == ["inner", "outer"]


DYING = """
import os, signal, sys
from pathlib import Path
from strainbench.files import locked
from strainbench.bench.records import mend, write_cell
from tests.bench.test_records import run_row, step_rows
top = Path(sys.argv[1])
fsync = os.fsync
for last in range(1, 9):
    folder = top / str(last)
    folder.mkdir()
    child = os.fork()
    if child == 0:
        with locked(folder):
            write_cell(folder, run_row("a", projections=3), step_rows("a", 3))
            left = last
            def flush(file):
                global left
                left -= 1
                if left == 0:
                    os.kill(os.getpid(), signal.SIGKILL)
                fsync(file)
            os.fsync = flush
            write_cell(folder, run_row("b", projections=2), step_rows("b", 2))
            os._exit(0)
    os.waitpid(child, 0)
"""


def test_rows_are_whole_wherever_a_run_is_killed(tmp_path):
    root = Path(__file__).parents[2]
    subprocess.run([sys.executable, "-c", DYING, str(tmp_path)], check=True, cwd=root, timeout=120)
    found = set()
    for folder in tmp_path.iterdir():
        cells = list(latest_runs(folder))
        found.add("".join(cells))
        steps = [(r["cell"], r["projection"]) for r in latest_steps(folder)]
        expected = [("a", "1"), ("a", "2"), ("a", "3"), ("b", "1"), ("b", "2")]
        assert steps == [s for s in expected if s[0] in cells]
        with locked(folder):
            mend(folder)
            assert len(read_rows(folder / STEPS, STEP_COLUMNS)) == len(steps)
            if "b" not in cells:
                write_cell(folder, run_row("b", projections=2), step_rows("b", 2))
        assert list(latest_runs(folder)) == ["a", "b"]
        rows = read_rows(folder / STEPS, STEP_COLUMNS)
        assert [(r["cell"], r["projection"]) for r in rows] == expected
        assert sorted(f.name for f in folder.iterdir()) == [".lock", RUNS, STEPS]
    assert found == {"a", "ab"}


@pytest.mark.parametrize("row", [b"", b"2,b,half"])
def test_steps_without_their_row_do_not_count_and_are_taken_back(held, row):
    before = state(held)
    sizes = {name: (held / name).stat().st_size for name in (RUNS, STEPS)}
    write_whole(held / ".pending", json.dumps(sizes).encode())
    append_rows(held / STEPS, STEP_COLUMNS, step_rows("a", 2, outcome="of a dead run"))
    with (held / RUNS).open("ab") as file:
        file.write(row)
    assert [r["outcome"] for r in latest_steps(held)] == ["some outcome"] * 3
    mend(held)
    assert state(held) == before


def test_a_damaged_note_is_named(held):
    (held / ".pending").write_text("[1]")
    with pytest.raises(RecordsError, match=r"\.pending: not a note of ours"):
        latest_runs(held)


def test_a_cells_steps_are_those_of_its_newest_row(held):
    write_cell(held, run_row("b", projections=1), step_rows("b", 1))
    write_cell(held, run_row("a", projections=2), step_rows("a", 2, outcome="newest"))
    assert [(r["cell"], r["outcome"]) for r in latest_steps(held)] == [
        ("a", "newest"),
        ("a", "newest"),
        ("b", "some outcome"),
    ]
    write_cell(held, run_row("a", projections=0), [])
    assert [r["cell"] for r in latest_steps(held)] == ["b"]


def test_steps_that_an_older_strainbench_left_without_a_row_do_not_count(tmp_path):
    append_rows(tmp_path / STEPS, STEP_COLUMNS, step_rows("a", 5) + step_rows("b", 4))
    append_rows(tmp_path / STEPS, STEP_COLUMNS, step_rows("a", 3))
    append_rows(tmp_path / RUNS, RUN_COLUMNS, [run_row("a", projections=3)])
    assert [(r["cell"], r["projection"]) for r in latest_steps(tmp_path)] == [
        ("a", "1"),
        ("a", "2"),
        ("a", "3"),
    ]


# --- two processes in one folder


HOLDING = """
import sys, time
from pathlib import Path
from strainbench.files import locked
with locked(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(60)
"""


def test_a_folder_is_held_by_one_process_until_it_dies(tmp_path):
    command = [sys.executable, "-c", HOLDING, str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as other:
        try:
            assert other.stdout.readline() == "held\n"
            words = f"in use by process {other.pid} on {socket.gethostname()}: wait"
            with pytest.raises(RecordsError, match=words) as caught, locked(tmp_path):
                pass
            assert len(str(caught.value).splitlines()) == 1
        finally:
            other.kill()
    with locked(tmp_path):
        check_held(tmp_path)
    assert [f.name for f in tmp_path.iterdir()] == [".lock"]


def test_reading_needs_no_lock(held):
    assert list(latest_runs(held)) == ["a"]
    assert len(latest_steps(held)) == 3


@pytest.mark.parametrize("after", ["nothing", "another folder", "a file"])
def test_a_folder_that_vanishes_is_said_in_one_line(tmp_path, after):
    folder = tmp_path / "results"
    folder.mkdir()
    with locked(folder):
        shutil.rmtree(folder)
        if after == "another folder":
            folder.mkdir()
        if after == "a file":
            folder.write_text("")
        with pytest.raises(DiskError, match="was removed or replaced") as caught:
            write_cell(folder, run_row(), [])
    assert len(str(caught.value).splitlines()) == 1
    assert after != "another folder" or list(folder.iterdir()) == []


def test_errors_that_are_not_of_the_folder_pass(tmp_path):
    with pytest.raises(FileNotFoundError), locked(tmp_path):
        Path("/nowhere/at/all").read_text(encoding="utf-8")
    with pytest.raises(BrokenPipeError), locked(tmp_path):
        raise BrokenPipeError(32, "Broken pipe")
    with pytest.raises(DiskError, match=r"lost: No such file"), locked(tmp_path):
        (tmp_path / "lost").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", ["[x]", "two words", "Ergebnisse ü", "结果", "a,b~"])
def test_a_folder_may_have_any_name(tmp_path, name):
    folder = tmp_path / name
    open_folder(folder)
    with locked(folder):
        write_cell(folder, run_row("a"), step_rows("a", 3))
        remember_machine(folder, "Großrechner", dict.fromkeys(FACTS, 1))
    assert list(latest_runs(folder)) == ["a"]
    assert len(latest_steps(folder)) == 3
    assert list(read_machines(folder)) == ["Großrechner"]


def test_an_ascii_locale_changes_nothing(tmp_path):
    script = (
        "import sys; from pathlib import Path; from strainbench.bench.records import *\n"
        "from strainbench.files import locked; from tests.bench.test_records import run_row\n"
        "folder = Path(sys.argv[1])\n"
        "with locked(folder): write_cell(folder, run_row('ü', reason='‖x‖ ≤ 1'), [])\n"
        "remember_machine(folder, 'Großrechner', {})\n"
    )
    plain = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    (tmp_path / "script.py").write_text(script, encoding="utf-8")
    command = [sys.executable, "-X", "utf8=0", str(tmp_path / "script.py"), str(tmp_path)]
    path = {"PYTHONPATH": str(Path(__file__).parents[2])}
    subprocess.run(command, check=True, env=os.environ | plain | path, timeout=120)
    assert latest_runs(tmp_path)["ü"]["reason"] == "‖x‖ ≤ 1"
    assert "Großrechner" in json.loads((tmp_path / MACHINES).read_text(encoding="utf-8"))


# --- the folder


def test_a_folder_is_made_with_its_parents(tmp_path):
    open_folder(tmp_path / "a" / "b")
    assert list((tmp_path / "a" / "b").iterdir()) == []
    open_folder(tmp_path / "a" / "b")


@pytest.mark.parametrize("inside", ["", "deeper"])
def test_a_file_in_place_of_the_folder_is_named(tmp_path, inside):
    (tmp_path / "taken").write_text("mine")
    with pytest.raises(RecordsError, match=r"taken.* cannot be written to .*--results") as caught:
        open_folder(tmp_path / "taken" / inside)
    assert "\n" not in str(caught.value)
    assert (tmp_path / "taken").read_text() == "mine"


# --- machines


def facts(cores):
    return {"memory_gb": 8, "system": "Linux", "python": "3.11", "threads_per_solver": 1} | {
        "cores": cores
    }


def test_machines_are_remembered_beside_each_other(tmp_path):
    remember_machine(tmp_path, "one", facts(2))
    remember_machine(tmp_path, "two", facts(64))
    remember_machine(tmp_path, "one", facts(4))
    assert read_machines(tmp_path) == {"one": facts(4), "two": facts(64)}
    assert [f.name for f in tmp_path.iterdir()] == [MACHINES]


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"{",
        b'{"one": }',
        b"[]",
        b'"one"',
        b"null",
        b"\xff\xfe{",
        b'{"one": 1}',
        b"[" * 100_000,
    ],
    ids=["empty", "cut off", "no value", "list", "word", "null", "bytes", "number", "deep"],
)
@pytest.mark.parametrize("touch", [read_machines, lambda d: remember_machine(d, "two", {})])
def test_a_damaged_machines_file_is_named_and_left_alone(tmp_path, content, touch):
    path = tmp_path / MACHINES
    path.write_bytes(content)
    with pytest.raises(RecordsError, match=MACHINES) as caught:
        touch(tmp_path)
    assert "\n" not in str(caught.value)
    assert path.read_bytes() == content


def test_machines_are_plain_json(tmp_path):
    remember_machine(tmp_path, "one", {"cores": 2})
    assert json.loads((tmp_path / MACHINES).read_text()) == {"one": {"cores": 2}}


@pytest.mark.parametrize("missing", FACTS)
def test_a_machine_without_a_fact_is_named_and_does_not_stop_a_run(tmp_path, missing):
    remember_machine(tmp_path, "one", {k: v for k, v in facts(2).items() if k != missing})
    remember_machine(tmp_path, "two", facts(2))
    with pytest.raises(RecordsError, match=rf"{MACHINES}: one lacks {missing}; mend"):
        read_machines(tmp_path)


def test_machines_are_written_whole_or_not_at_all(tmp_path, full_disk):
    remember_machine(tmp_path, "one", facts(2))
    with full_disk(150), pytest.raises(DiskError, match="File too large"):
        remember_machine(tmp_path, "two", facts(2))
    assert read_machines(tmp_path) == {"one": facts(2)}
    assert [f.name for f in tmp_path.iterdir()] == [MACHINES]


def test_rows_in_place_of_others_are_written_whole_or_not_at_all(runs, full_disk):
    before = runs.read_bytes()
    with full_disk(100), pytest.raises(DiskError):
        write_rows(runs, RUN_COLUMNS, [run_row("z")])
    assert runs.read_bytes() == before
    write_rows(runs, RUN_COLUMNS, [run_row("z")])
    assert list(latest_runs(runs.parent)) == ["z"]
