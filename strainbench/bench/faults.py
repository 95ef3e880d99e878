"""What is wrong with a line of runs.csv or steps.csv, in words."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence

from strainbench.bench.columns import COUNTS, SETTINGS, SEVERAL, WORDS

SCHEMA = 3
"""Counted up by a release that has more columns than the last, so that an older strainbench says
that a folder is newer. Folders of all before are read, with the columns that they lack empty."""
FIRST = 4  # columns that every header has had
NO_HEADER = f"it is no header of schema 1 to {SCHEMA}"


def header_fault(header: list[str], records: list[list[str]], columns: Sequence[str]) -> str | None:
    """What is wrong with a header, or None: it has today's columns, or fewer of them."""
    known = iter(columns)
    if header[:FIRST] == list(columns[:FIRST]) and all(name in known for name in header):
        return None
    schemas = [r[0] for r in records if r and header[:1] == ["schema"]]
    if newer := next(filter(_is_newer, schemas), None):
        return f"line 1: {_newer(newer)}"
    if header[: len(columns)] == list(columns):
        unknown = ", ".join(header[len(columns) :])
        return f"line 1: written by a newer strainbench, which also records {unknown}"
    return f"line 1: {NO_HEADER}"


def _is_newer(schema: str) -> bool:
    return _is_number(schema) and float(schema) > SCHEMA


def _newer(schema: str) -> str:
    return f"written by a newer strainbench (schema {schema}; this one reads up to {SCHEMA})"


def record_fault(header: list[str], record: list[str]) -> str | None:
    """What is wrong with a record as a whole."""
    if record == header:
        return ": the header once more"
    if len(record) != len(header):
        return f" has {len(record)} fields where {len(header)} are valid"
    if broken := next(
        (name for name, text in zip(header, record, strict=True) if "\n" in text), None
    ):
        return f", column {broken}: an end of line where text on one line is valid"
    return None


def value_fault(row: Mapping[str, str]) -> str | None:
    """What is wrong with a value, and the column it is in."""
    schema = row.get("schema", "1")
    if _is_newer(schema):
        return f": {_newer(schema)}"
    if schema not in map(str, range(1, SCHEMA + 1)):
        return f", column schema: {schema!r} where 1 to {SCHEMA} is valid"
    for name, text in row.items():
        if text and (valid := _valid(name, text)):
            return f", column {name}: {_short(text)} where {valid} is valid"
    return None


def _valid(name: str, text: str) -> str | None:
    """What would be valid in a column, or None where `text` is."""
    if name in COUNTS:
        return None if text.isdecimal() and text.isascii() else "a whole number from 0 on"
    if name in SEVERAL:
        return None if all(map(_is_number, text.split(" "))) else "numbers with spaces between"
    if name in SETTINGS:
        return None if _is_object(text) else "a JSON object"
    return None if name in WORDS or _is_number(text) else "a number"


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return text.isascii() and "_" not in text


def _is_object(text: str) -> bool:
    try:
        return isinstance(json.loads(text), dict)
    except (ValueError, RecursionError):
        return False


def _short(text: str) -> str:
    return repr(text if len(text) <= 40 else f"{text[:40]}...")
