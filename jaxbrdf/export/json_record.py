"""Records (NamedTuples and frozen dataclasses) as plain JSON values and back, every type checked on the way back."""

from __future__ import annotations

import dataclasses
import math
from types import UnionType
from typing import Any, Literal, get_args, get_origin, get_type_hints

LONGEST_TUPLE = 32


def to_plain(value: Any) -> Any:
    """What `json.dumps` takes: records become objects, tuples lists; the rest stays."""
    if _is_record(type(value)):
        return {name: to_plain(getattr(value, name)) for name in get_type_hints(type(value))}
    if isinstance(value, tuple):
        return [to_plain(item) for item in value]
    return value


def from_plain(kind: Any, value: Any, at: str) -> Any:
    """The value of type `kind` that a JSON value says; inverse of `to_plain`.

    Args:
        kind: a record, `tuple[X, ...]`, `dict[str, X]`, a `Literal` of strings, bool, int, float or str, or one of
            these or None.
        value: what `json.loads` gave.
        at: the value's name, for the message.

    Raises:
        ValueError: naming what is missing, unknown or of the wrong type.
    """
    if _is_record(kind):
        return _record(kind, value, at)
    if get_origin(kind) is tuple:
        items = _expect(list, value, at)
        if len(items) > LONGEST_TUPLE:
            raise ValueError(f"{at} has {len(items)} entries, at most {LONGEST_TUPLE} are allowed")
        return tuple(from_plain(get_args(kind)[0], item, f"{at}[{i}]") for i, item in enumerate(items))
    if get_origin(kind) is dict:
        items = _expect(dict, value, at).items()
        return {name: from_plain(get_args(kind)[1], item, f"{at}.{name}") for name, item in items}
    if get_origin(kind) is Literal:
        return _choice(get_args(kind), value, at)
    if get_origin(kind) is UnionType:
        kind, _ = get_args(kind)
        return None if value is None else from_plain(kind, value, at)
    return _scalar(kind, value, at)


def _is_record(kind: Any) -> bool:
    return isinstance(kind, type) and (dataclasses.is_dataclass(kind) or hasattr(kind, "_fields"))


def _record(kind: type, value: Any, at: str) -> Any:
    fields = get_type_hints(kind)
    found = _expect(dict, value, at)
    for name in sorted(fields.keys() - found.keys()):
        raise ValueError(f"{at}.{name} is missing")
    for name in sorted(found.keys() - fields.keys()):
        raise ValueError(f"{at} has an unknown entry {name!r:.40}")
    return kind(**{name: from_plain(hint, found[name], f"{at}.{name}") for name, hint in fields.items()})


def _choice(names: tuple[str, ...], value: Any, at: str) -> str:
    if type(value) is not str or value not in names:
        raise ValueError(f"{at} is {value!r:.40}, not one of {', '.join(names)}")
    return value


def _scalar(kind: type, value: Any, at: str) -> Any:
    if kind is float and type(value) is int and abs(value) < 2**53:
        return float(value)
    value = _expect(kind, value, at)
    if kind is float and not math.isfinite(value):
        raise ValueError(f"{at} is {value}")
    return value


def _expect(kind: type, value: Any, at: str) -> Any:
    # type, not isinstance: True is no integer here
    if type(value) is not kind:
        raise ValueError(f"{at} is {value!r:.40}, not a {kind.__name__}")
    return value
