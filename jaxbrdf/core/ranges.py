"""Which values a parameter may take: declared once beside the field, and used to refuse, to clamp and to fit.

A record declares `alpha: Annotated[jax.Array, Range(1e-4, 1.0)]`. Where a record is made from a user's numbers
`check_ranges` refuses what lies outside; traced code cannot refuse, and works with the nearest values that are valid
(`clamp`), so that its result is that of stated parameters.

A record whose fields are valid only together, such as the entries of a positive matrix, has a method `fault`, which
says what is wrong with its (concrete) values or gives None, and a method `nearest_valid`, which gives a valid record.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Any, NamedTuple, get_args, get_type_hints

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer


class Range(NamedTuple):
    """The closed interval of a parameter's valid values; either end may be infinite, which itself is not valid."""

    low: float
    high: float


SHARE = Range(0.0, 1.0)
"""Of albedos, colours, metalness and everything else that is a part of a whole."""

ANY = Range(-np.inf, np.inf)
"""Every finite number."""


def check_ranges(params: Any) -> None:
    """Passes where every declared parameter lies in its range.

    Args:
        params: records of concrete arrays; fields that declare no range are not looked at, traced ones are taken.

    Raises:
        ValueError: naming record, field, value and valid range.
    """
    for place, leaf, valid in _leaves(params, type(params).__name__, None):
        if valid is not None and not isinstance(leaf, Tracer):
            _check(place, np.asarray(leaf, np.float64), valid)
    for place, record in _joint(params, type(params).__name__):
        leaves = jax.tree.leaves(record)
        fault = None if any(isinstance(leaf, Tracer) for leaf in leaves) else record.fault()
        if fault is not None:
            raise ValueError(f"{place} {fault}")


def clamp(params: Any) -> Any:
    """The records with each parameter put to the nearest valid value; NaN stays, and the result is NaN then.

    The gradient is that of the parameter up to and including the ends of its range, zero outside.
    """
    if not _is_record(params):
        return tuple(map(clamp, params)) if isinstance(params, tuple) else params
    ranges = _ranges(type(params))
    changed = {
        name: _clip(value, ranges[name]) if name in ranges and value is not None else clamp(value)
        for name, value in params._asdict().items()
    }
    record = params._replace(**changed)
    return record.nearest_valid() if hasattr(record, "nearest_valid") else record


def ranges_of(params: Any) -> list[Range]:
    """The range of each leaf in flattening order, `ANY` where none is declared."""
    return [valid or ANY for _, _, valid in _leaves(params, "", None)]


def _check(place: str, values: np.ndarray, valid: Range) -> None:
    wrong = ~(np.isfinite(values) & (values >= _lenient(valid.low)) & (values <= _lenient(valid.high)))
    if wrong.any():
        raise ValueError(f"{place} is {values[wrong].flat[0]:g}; it must be {_described(valid)}")


def _lenient(end: float) -> float:
    """The end as float32 has it, in which parameters are given: 1e-4 rounds to a smaller number."""
    return float(np.float32(end))


def _described(valid: Range) -> str:
    if np.isinf(valid.low) and np.isinf(valid.high):
        return "a finite number"
    return f"from {valid.low:g} to {valid.high:g}" if np.isfinite(valid.high) else f"finite and at least {valid.low:g}"


def _clip(value: jax.Array, valid: Range) -> jax.Array:
    # not jnp.clip, whose gradient at the ends themselves is a half
    value = jnp.asarray(value)
    raised = jnp.where(value < valid.low, jnp.asarray(valid.low, value.dtype), value) if valid.low > -np.inf else value
    return (
        jnp.where(raised > valid.high, jnp.asarray(valid.high, value.dtype), raised) if valid.high < np.inf else raised
    )


def _is_record(value: Any) -> bool:
    return isinstance(value, tuple) and hasattr(value, "_fields")


@lru_cache
def _ranges(record: type) -> dict[str, Range]:
    """The fields of a record that declare a range."""
    hints = get_type_hints(record, include_extras=True)
    found = {name: _range(hint) for name, hint in hints.items()}
    return {name: valid for name, valid in found.items() if valid is not None}


def _range(hint: Any) -> Range | None:
    """The range in an annotation, which may be that of an optional field."""
    own = [mark for mark in getattr(hint, "__metadata__", ()) if isinstance(mark, Range)]
    within = [valid for part in get_args(hint) if (valid := _range(part)) is not None]
    return next(iter(own + within), None)


def _leaves(params: Any, place: str, valid: Range | None) -> Iterator[tuple[str, Any, Range | None]]:
    """Every array in flattening order with its place, such as `GgxParams.fresnel.eta`, and its range."""
    ranges = _ranges(type(params)) if _is_record(params) else {}
    if isinstance(params, tuple):
        for name, value, own in _parts(params, place):
            yield from _leaves(value, own, ranges.get(name, valid))
    elif jax.tree_util.all_leaves([params]):
        yield place, params, valid


def _joint(params: Any, place: str) -> list[tuple[str, Any]]:
    """Every record with a condition on its fields together, and its place."""
    here = [(place, params)] if hasattr(params, "fault") else []
    return here + [found for _, value, own in _parts(params, place) for found in _joint(value, own)]


def _parts(params: Any, place: str) -> list[tuple[str, Any, str]]:
    """Name, value and place of what a record or a tuple holds."""
    if _is_record(params):
        return [(name, value, f"{place}.{name}") for name, value in params._asdict().items()]
    if isinstance(params, tuple):
        return [(str(i), value, f"{place}[{i}]") for i, value in enumerate(params)]
    return []
