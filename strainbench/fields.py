"""Fields of plug-ins: from words to values, and to what JSON and another process can take.

`--set` gives numbers, true and false, text, none, paths, the members of an Enum (by name or value),
the options of a Literal, and tuples and lists of these with a colon between entries: 1:2:3.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, Field, fields
from enum import Enum
from pathlib import PurePath
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np

SEPARATOR = ":"  # between entries; commas are between values
SETTABLE = (
    "int, float, bool, str, none, Path, Enum, Literal, and tuples and lists of these, as in 1:2"
)
ADDRESS = re.compile(r" at 0x[0-9a-fA-F]+")
LISTS = (tuple, list, Sequence)


class NotSettableError(TypeError):
    """A type whose values no word can give."""


def default_of(field: Field[Any]) -> Any:
    """A field's default, MISSING without one."""
    if field.default_factory is not MISSING:
        return field.default_factory()
    return field.default


def hints(kind: type) -> dict[str, Any]:
    """The type of each field; its default's, where the annotation does not say."""
    return {f.name: _hint(kind, f) for f in fields(kind)}


def _hint(kind: type, field: Field[Any]) -> Any:
    def stub() -> None: ...

    stub.__annotations__ = {"it": field.type}
    owner = next(c for c in kind.__mro__ if field.name in vars(c).get("__annotations__", {}))
    names = getattr(owner.__init__, "__globals__", vars(sys.modules[owner.__module__]))  # type: ignore[misc]
    try:
        hint = get_type_hints(stub, names)["it"]
    except Exception:  # such as a name under `if TYPE_CHECKING`, which no run has
        hint = Any
    default = default_of(field)
    if hint in (Any, object) and default is not None and default is not MISSING:
        hint = type(default)
    if hint in LISTS and default:
        hint = hint[type(default[0]), ...] if hint is tuple else hint[type(default[0])]
    return hint


def kinds(hint: Any) -> list[Any]:
    """The types that a hint allows, those first that take the fewest words."""
    while hasattr(hint, "__supertype__") or hasattr(hint, "__value__"):  # NewType, `type X = ...`
        hint = getattr(hint, "__supertype__", None) or hint.__value__
    if get_origin(hint) in (UnionType, Union):
        return sorted((k for h in get_args(hint) for k in kinds(h)), key=_breadth)
    return [hint]


def _breadth(kind: Any) -> int:
    tests: list[Callable[[Any], bool]] = [
        lambda k: k is NoneType,
        lambda k: k is bool,
        lambda k: _is(k, Enum) or get_origin(k) is Literal,
        lambda k: _is(k, int, np.integer),
        lambda k: _is(k, float, np.floating),
        lambda k: k is not str and not _is(k, PurePath),
        lambda k: k is not str,
    ]
    return next((i for i, test in enumerate(tests) if test(kind)), len(tests))


def _is(kind: Any, *bases: type) -> bool:
    return isinstance(kind, type) and get_origin(kind) is None and issubclass(kind, bases)


def read(hint: Any, text: str) -> Any:
    """The value that a word gives; percentages are numbers too: 1% is 0.01.

    Raises
    ------
    ValueError
        If it gives none.
    NotSettableError
        If no word does.
    """
    allowed = kinds(hint)
    for kind in allowed:
        try:
            value = _read(kind, text)
        except ValueError:
            continue
        whole = isinstance(value, float) and int in allowed and value.is_integer()
        return int(value) if whole else value
    raise ValueError


def _read(kind: Any, text: str) -> Any:
    origin = get_origin(kind) or kind
    if kind is NoneType:
        return _chosen({"none": None}, text.lower())
    if _is(kind, bool, np.bool_):
        return _chosen({"true": kind(True), "false": kind(False)}, text.lower())
    if _is(kind, Enum):
        return _chosen({str(m.value): m for m in kind} | dict(kind.__members__), text)
    if origin is Literal:
        return _chosen({_option(o): o for o in get_args(kind)}, text)
    if _is(kind, int, np.integer):
        return kind(int(text))
    if _is(kind, float, np.floating):
        return kind(float(text[:-1]) / 100 if text.endswith("%") else float(text))
    if kind is str or _is(kind, PurePath):
        return kind(text)
    if origin in LISTS:
        return _read_list(origin, get_args(kind), text)
    raise NotSettableError


def _chosen(options: Mapping[str, Any], text: str) -> Any:
    if text not in options:
        raise ValueError
    return options[text]


def _option(value: object) -> str:
    """How an option of a Literal is written."""
    return str(value).lower() if value is None or isinstance(value, bool) else str(plain(value))


def _read_list(origin: Any, entries: tuple[Any, ...], text: str) -> Any:
    words = text.split(SEPARATOR)
    types = _entry_types(origin, entries, len(words))
    if any((get_origin(k) or k) in LISTS for t in types for k in kinds(t)):
        raise NotSettableError
    values = [read(t, w) for t, w in zip(types, words, strict=True)]
    return values if origin is list else tuple(values)


def _entry_types(origin: Any, entries: tuple[Any, ...], count: int) -> list[Any]:
    """The type of each of `count` entries; ValueError for another number than the hint's."""
    if not entries:
        return [str] * count
    if origin is tuple and entries[-1] is not Ellipsis:
        if len(entries) != count:
            raise ValueError
        return list(entries)
    return [entries[0]] * count


def words(hint: Any) -> str:
    """What a hint allows, in words."""
    return " or ".join(_words(kind) for kind in sorted(kinds(hint), key=lambda k: k is NoneType))


def _words(kind: Any) -> str:
    origin, entries = get_origin(kind) or kind, get_args(kind)
    if kind is NoneType:
        return "none"
    if kind is Any:
        return "value of a type that is not known here"
    if _is(kind, Enum):
        return "one of " + ", ".join(kind.__members__)
    if origin is Literal:
        return "one of " + ", ".join(_option(o) for o in entries)
    if origin is tuple and entries and entries[-1] is not Ellipsis:
        return SEPARATOR.join(words(e) for e in entries)
    if origin in LISTS:
        return f"{words(entries[0]) if entries else 'str'} with {SEPARATOR} between entries"
    return str(getattr(kind, "__name__", kind))


def plain(value: Any) -> Any:
    """A value as JSON has it; what JSON has no form for, as Python shows it."""
    if isinstance(value, Enum):
        return value.name
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, PurePath):
        return str(value)
    if isinstance(value, Mapping):
        return {str(plain(k)): plain(v) for k, v in value.items()}
    if isinstance(value, set | frozenset):
        return sorted((plain(v) for v in value), key=repr)
    if isinstance(value, tuple | list):
        return [plain(v) for v in value]
    if value is None or type(value) in (bool, int, float, str):
        return value
    for base in (int, float, str):
        if isinstance(value, base):
            return base(value)
    return ADDRESS.sub("", repr(value))


def same(one: Any, other: Any) -> bool:
    """Whether two values are one for JSON."""
    return json.dumps(plain(one), sort_keys=True) == json.dumps(plain(other), sort_keys=True)


def spelled(value: Any) -> str:
    """A value as `--set` would take it."""
    value = plain(value)
    if isinstance(value, list):
        return SEPARATOR.join(map(spelled, value))
    return str(value).lower() if value is None or isinstance(value, bool) else str(value)


def restored(
    kind: type, parameters: Mapping[str, Any], known: Mapping[str, Sequence[Any]]
) -> dict[str, Any]:
    """Fields of `kind` from their plain values.

    Parameters
    ----------
    known : values that a field may have, such as its default, which are taken as they are

    Raises
    ------
    TypeError
        In one line, for a value that has no plain form.
    """
    types = hints(kind)
    settings = {}
    for name in (f.name for f in fields(kind) if f.init and f.name in parameters):
        alike = [v for v in known.get(name, ()) if same(v, parameters[name])]
        try:
            settings[name] = alike[0] if alike else _restored(types[name], parameters[name])
        except (KeyError, ValueError, TypeError):
            given = f"{parameters[name]!r} for the field {name} of {kind.__name__}"
            raise TypeError(f"{given} does not survive the way to another process") from None
    return settings


def _restored(hint: Any, value: Any) -> Any:
    allowed = kinds(hint)
    if value is None or (type(value) in allowed and type(value) is not list):
        return value
    for kind in allowed:
        origin = get_origin(kind) or kind
        if origin in LISTS and isinstance(value, list):
            types = _entry_types(origin, get_args(kind), len(value))
            entries = [_restored(t, v) if get_args(kind) else v for t, v in zip(types, value)]  # noqa: B905
            return entries if origin is list else tuple(entries)
        if _is(kind, Enum) and value in kind.__members__:
            return kind[value]
        if origin is Literal:
            return _chosen({_option(o): o for o in get_args(kind)}, _option(value))
        if origin is np.ndarray:
            return np.asarray(value)
        if _is(kind, int, float, np.generic, PurePath) and isinstance(value, int | float | str):
            return kind(value)
    if isinstance(value, int | float | dict) or Any in allowed:
        return value
    raise TypeError
