"""The results folder: what is written is read back, and what is damaged is said to be."""

from __future__ import annotations

import json

import pytest

from strainbench.records import (
    LONGEST_TEXT,
    MACHINES,
    RUN_COLUMNS,
    RUNS,
    SCHEMA,
    STEP_COLUMNS,
    STEPS,
    RecordsError,
    append_rows,
    latest_runs,
    open_folder,
    read_machines,
    read_rows,
    remember_machine,
)

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


def run_row(cell="a", **values):
    return {c: f"some {c}" for c in RUN_COLUMNS} | {"schema": SCHEMA, "cell": cell} | values


def step_row(**values):
    return {c: f"some {c}" for c in STEP_COLUMNS} | values


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


# --- damage is named, in one line, and the file is left as it is


def damages(text):
    header, first, *rest = text.splitlines(keepends=True)
    unknown = first.replace(f"{SCHEMA},", f"{SCHEMA + 1},", 1)
    yield "wrong header", r"line 1: .*header", text.replace("schema,cell", "cell,schema", 1)
    yield "older header", r"line 1: .*header", text.replace(",machine\n", "\n", 1)
    yield "no header", r"line 1: .*header", first + "".join(rest)
    yield "other text", r"line 1: .*header", "hello\n"
    count = len(RUN_COLUMNS)
    yield "short record", rf"record 3 has 2 fields where {count}", "".join([header, first, "1,b\n"])
    yield (
        "long record",
        rf"record 2 has {count + 1} fields where {count}",
        header + first.strip() + ",more\n",
    )
    yield "blank line", r"record 3 has 0 fields", "".join([header, first, "\n", *rest])
    yield "cut-off field", r"record 4 has \d+ fields", text[: len(text) - len(rest[-1]) + 30]
    yield "cut-off end", r"last line is cut off", text[:-1]
    yield "cut within the last field", r"last line is cut off", text[:-5]
    yield "other schema", r"record 2: schema '2' where 1 is valid", "".join([header, unknown])
    yield "open quote", r"record 3 has \d+ fields", "".join([header, first, '1,"b,', *rest])


@pytest.mark.parametrize("case", range(12))
def test_a_damaged_file_is_named_and_left_alone(runs, case):
    _, words, text = list(damages(runs.read_text()))[case]
    runs.write_text(text)
    with pytest.raises(RecordsError, match=words) as caught:
        latest_runs(runs.parent)
    message = str(caught.value)
    assert message.startswith(str(runs))
    assert "nothing was changed" in message
    assert "\n" not in message
    assert runs.read_text() == text


def test_bytes_that_are_not_text_are_named(runs):
    runs.write_bytes(b"\x89PNG\r\n\x1a\n\x00\xff\xfe")
    with pytest.raises(RecordsError, match=RUNS):
        latest_runs(runs.parent)


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


def test_machines_are_remembered_beside_each_other(tmp_path):
    remember_machine(tmp_path, "one", {"cores": 2})
    remember_machine(tmp_path, "two", {"cores": 64})
    remember_machine(tmp_path, "one", {"cores": 4})
    assert read_machines(tmp_path) == {"one": {"cores": 4}, "two": {"cores": 64}}
    assert [f.name for f in tmp_path.iterdir()] == [MACHINES]


@pytest.mark.parametrize(
    "content",
    [b"", b"{", b'{"one": }', b"[]", b'"one"', b"null", b"\xff\xfe{"],
    ids=["empty", "cut off", "no value", "a list", "a word", "null", "not text"],
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
