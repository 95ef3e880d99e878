"""Settings of plug-ins from the words of a command line: `--set KEY=V1,V2`."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import fields
from itertools import product
from pathlib import Path
from typing import Any

from strainbench.bench.cell import file_named
from strainbench.fields import SETTABLE, NotSettableError, default_of, hints, read
from strainbench.fields import words as words_of
from strainbench.options import shown
from strainbench.plugins import nearest, told
from strainbench.scenario.scenario import Scenario
from strainbench.solver.solver import Solver

Choices = dict[str, dict[str, list[str]]]
"""Values by owner ("" where none was named) and key."""


def is_file(word: str) -> bool:
    """Whether a word means a file rather than a name."""
    return word.endswith(".py") or "/" in word


def parse_settings(words: Iterable[str]) -> Choices:
    """`key=v1,v2` and `owner.key=v1,v2`, where the owner is a scenario or a solver."""
    choices: Choices = {}
    for word in words:
        key, equals, values = word.partition("=")
        owner, _, name = key.rpartition(".")
        if not equals or not name or not values:
            raise ValueError(f"--set {shown(word)}: KEY=VALUE or KEY=VALUE1,VALUE2 is valid")
        choices.setdefault(owner, {}).setdefault(name, []).extend(split_values(values))
    return choices


def split_values(text: str) -> list[str]:
    """Values between commas; one in double quotes, or that is a file as it stands, keeps its own.

    >>> split_values('"a,b.obj",c.obj')
    ['a,b.obj', 'c.obj']
    """
    if "," in text and file_named(text):
        return [text]
    try:
        return next(csv.reader([text], strict=True))
    except csv.Error as error:
        valid = 'V1,V2 or "V1,V2" for one value with a comma is valid'
        raise ValueError(f"--set ...={text!r}: {valid} ({error})") from None


def parse_value(owner: str, key: str, hint: Any, text: str, file: str = "") -> object:
    """A value of a field's type; one line for what is none, which names the field and the file."""
    try:
        return read(hint, text)
    except ValueError:
        valid = f"the value must be {words_of(hint)}"
        raise ValueError(f"--set {owner}.{key}={text}: {valid}") from None
    except NotSettableError:
        what = f"{key} of {owner}{f' in {file}' if file else ''} is a {words_of(hint)}"
        raise ValueError(f"--set {owner}.{key}: {what}; valid are {SETTABLE}") from None


def combinations(
    kind: type[Scenario] | type[Solver], choices: Choices, shared: bool, file: str = ""
) -> Iterator[tuple[dict[str, Any], dict[str, str]]]:
    """Every combination of the values chosen for a plug-in's fields, and the words for them."""
    chosen = (dict(choices.get("", {})) if shared else {}) | choices.get(kind.name, {})
    types = hints(kind)
    for key in chosen:
        if key not in types:
            raise ValueError(_no_setting(kind, key, list(types), file))
    defaults = {f.name: default_of(f) for f in fields(kind)}
    values = [
        [(_as_default(parse_value(kind.name, k, types[k], w, file), defaults[k]), w) for w in ws]
        for k, ws in chosen.items()
    ]
    for combination in product(*values):
        pairs = dict(zip(chosen, combination, strict=True))
        yield {k: value for k, (value, _) in pairs.items()}, {k: w for k, (_, w) in pairs.items()}


def _no_setting(kind: type, key: str, valid: list[str], file: str) -> str:
    name = getattr(kind, "name", kind.__name__)
    if any(key in vars(c).get("__annotations__", {}) for c in kind.__mro__):
        return f"{name} has no setting {key!r}: {kind.__name__} in {file} is no @dataclass"
    found = f"valid are {', '.join(valid)}{nearest(key, valid)}" if valid else "it has none at all"
    return f"{name} has no setting {key!r}; {found}"


def _as_default(value: object, default: object) -> object:
    """The default itself where it is the same number, so that 1 and 1.0 are one cell."""
    numbers = all(type(v) in (int, float) for v in (value, default))
    return default if numbers and value == default else value


@contextmanager
def blaming(name: str, file: str | None) -> Iterator[None]:
    """Name the plug-in whose values are not valid, and the file whose code raises anything else."""
    try:
        yield
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None
    except Exception as error:
        if file is None:  # a fault of ours
            raise
        raise ValueError(f"{file}: {name}: {told(error, str(Path(file).resolve()))}") from None
