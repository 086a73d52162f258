"""What a bundle may hold beside its model's parameters, and how each part is read from a file."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from jaxbrdf.brdf.albedo_table import AlbedoTable
from jaxbrdf.brdf.energy_scale import TERMS, EnergyScale
from jaxbrdf.core.tree import named_leaves
from jaxbrdf.sampling.view_proxy import ViewProxy

LARGEST_GRID = 4096
"""No grid of viewers has more azimuths, or more elevations."""


class Parts(NamedTuple):
    """The effects and lookups that a bundle has; one that is None is not there, and costs nothing.

    Attributes:
        scale: a factor that keeps the albedo at most one.
        sampler: draws light, in place of what the model may have of its own.
        albedo: measured when the bundle was made.
    """

    scale: EnergyScale | None = None
    sampler: ViewProxy | None = None
    albedo: AlbedoTable | None = None


class _Form(NamedTuple):
    """A part's record, which has one array, and what shapes that may have."""

    record: Callable[..., Any]
    tensor: str
    says: str
    fits: Callable[[tuple[int, ...]], bool]


def _is_grid(channels: int) -> Callable[[tuple[int, ...]], bool]:
    def fits(shape: tuple[int, ...]) -> bool:
        return (
            len(shape) == 3 and shape[2] == channels and 1 <= shape[0] <= LARGEST_GRID and 2 <= shape[1] <= LARGEST_GRID
        )

    return fits


FORMS = {
    "scale": _Form(EnergyScale, "scale.weights", f"({TERMS}, 3)", lambda shape: shape == (TERMS, 3)),
    "sampler": _Form(ViewProxy, "sampler.nodes", "(azimuths, elevations, 9)", _is_grid(9)),
    "albedo": _Form(AlbedoTable, "albedo.values", "(azimuths, elevations, 3)", _is_grid(3)),
}


def part_arrays(parts: Parts) -> dict[str, np.ndarray]:
    """The arrays by their names in a file.

    Raises:
        ValueError: naming one of a wrong shape or with a number that is not finite.
    """
    arrays = {name: np.asarray(leaf, np.float32) for name, leaf in named_leaves(parts).items()}
    for form in FORMS.values():
        if form.tensor in arrays:
            _check(form, arrays[form.tensor])
    return arrays


def parts_of(arrays: dict[str, np.ndarray]) -> Parts:
    """The parts that the arrays of a file are of; inverse of `part_arrays`.

    Raises:
        ValueError: as `part_arrays`.
    """
    present = {name: form for name, form in FORMS.items() if form.tensor in arrays}
    for form in present.values():
        _check(form, arrays[form.tensor])
    return Parts(**{name: form.record(arrays[form.tensor]) for name, form in present.items()})


def _check(form: _Form, array: np.ndarray) -> None:
    if not form.fits(array.shape):
        raise ValueError(f"tensor {form.tensor} is {array.shape}, not {form.says}")
    if not np.isfinite(array).all():
        raise ValueError(f"tensor {form.tensor} is not finite")
