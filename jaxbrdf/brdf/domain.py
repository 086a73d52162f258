"""Where a BRDF's parameters are valid: what is asked outside of it is answered as at the nearest valid parameters."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any

from jaxbrdf.core.ranges import check_ranges, clamp
from jaxbrdf.types import Brdf, Material, Params


def within_ranges(brdf: Brdf) -> Brdf:
    """The BRDF with its parameters clamped to the ranges that their records declare (`jaxbrdf.core.ranges`).

    So traced code, which cannot refuse a value, has a stated result: that of the clamped parameters, NaN for NaN.
    """
    rest = (None if function is None else _clamped(function) for function in brdf[1:])
    return Brdf(_clamped(brdf.eval), *rest)


def checked_material(name: str, brdf: Brdf, params: Params, *, isotropic: bool) -> Material:
    """A material whose parameters have been looked at.

    Raises:
        ValueError: naming the first parameter outside its range, its value and the range.
    """
    check_ranges(params)
    return Material(name, brdf, params, isotropic)


def _clamped(function: Callable) -> Callable:
    @wraps(function)
    def of_valid(params: Params, *rest: Any) -> Any:
        return function(clamp(params), *rest)

    return of_valid
