"""Materials along the plane of incidence, where their highlights lie."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

from jaxbrdf.core.colour import REC709_LUMINANCE
from jaxbrdf.core.directions import spherical
from jaxbrdf.report.figure import to_png
from jaxbrdf.types import Material, Query

STEPS = 721
"""Directions from horizon to horizon, a quarter of a degree apart."""

LEAST_SHOWN = 1e-5
THETAS = (0.0, 30.0, 60.0, 80.0)


class Slice(NamedTuple):
    """A material seen from one side, lit from everywhere in the plane of view and normal.

    Attributes:
        angle: of wi from the normal, degrees, `(steps,)`; the mirror direction is at +theta_o.
        luminance: of f, 1/sr, `(steps,)`.
    """

    angle: np.ndarray
    luminance: np.ndarray


def incidence_plane(material: Material, theta_o: float, *, steps: int = STEPS) -> Slice:
    """f over wi in the plane of wo and the normal.

    Args:
        material: is looked at from azimuth pi.
        theta_o: angle of wo from the normal, degrees.
        steps: directions between -90 and 90 degrees, at the middles of equal intervals.
    """
    angle = (np.arange(steps) + 0.5) * (180.0 / steps) - 90.0
    wi = spherical(jnp.asarray(np.radians(angle), jnp.float32), jnp.zeros(steps))
    wo = jnp.broadcast_to(spherical(jnp.float32(-np.radians(theta_o)), jnp.float32(0.0))[None], wi.shape)
    f = jax.jit(partial(material.brdf.eval, material.params))(Query(wi, wo))
    return Slice(angle, np.asarray(f, np.float64) @ np.asarray(REC709_LUMINANCE, np.float64))


def incidence_planes(materials: Mapping[str, Material], *, thetas: Sequence[float] = THETAS) -> bytes:
    """A PNG: for each view angle f on a logarithmic scale, and below it the polar lobe of (f cos)^(1/3).

    Args:
        materials: by the name in the legend; the first is the reference, drawn broadly below the others.
        thetas: of the views, degrees.
    """
    figure = Figure(figsize=(3.6 * len(thetas), 6.4), layout="constrained")
    count = len(thetas)
    for column, theta in enumerate(thetas, start=1):
        plain = figure.add_subplot(2, count, column, sharey=figure.axes[0] if figure.axes else None)
        polar = figure.add_subplot(2, count, count + column, projection="polar")
        for index, (name, material) in enumerate(materials.items()):
            style = {"label": name, "linewidth": 1.2 if index else 4.0, "alpha": 1.0 if index else 0.4}
            _draw(plain, polar, incidence_plane(material, theta), style)
        plain.set(title=f"seen at {theta:g} degrees", xlabel="angle of the light [degrees]", yscale="log")
        polar.set(theta_zero_location="N", theta_direction=-1, thetamin=-90, thetamax=90, yticklabels=[])
    figure.axes[0].set_ylabel("luminance of f [1/sr]")
    figure.axes[0].legend()
    return to_png(figure)


def _draw(plain, polar, found: Slice, style: dict) -> None:
    radians = np.radians(found.angle)
    plain.plot(found.angle, np.maximum(found.luminance, LEAST_SHOWN), **style)
    polar.plot(radians, np.cbrt(found.luminance * np.cos(radians)), **style)
