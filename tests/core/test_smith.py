"""Smith's masking and shadowing for both distributions: textbook forms, bounds, and densities that integrate to one."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.core.beckmann import Beckmann
from jaxbrdf.core.directions import spherical
from jaxbrdf.core.ggx import Ggx
from jaxbrdf.core.roughness import Axes, Isotropic
from jaxbrdf.core.smith import (
    LEAST_COSINE,
    correlated_visibility,
    lift,
    masked_area,
    reflected_density,
    separable_visibility,
)
from tests.core.facets import CASES, directions, facets, in_double, slope_of

KINDS = {"ggx": Ggx, "beckmann": Beckmann}


def cosines() -> tuple[np.ndarray, np.ndarray]:
    return directions(500, 3), directions(500, 4)


@pytest.mark.parametrize("kind", KINDS)
def test_height_correlation_lies_between_its_bounds_and_is_heitzs(kind: str):
    wi, wo = cosines()
    surface = KINDS[kind](Axes(jnp.float32(0.3), jnp.float32(0.6)))
    four = 4.0 * wi[:, 2].astype(float) * wo[:, 2]
    correlated = four * np.asarray(correlated_visibility(surface, jnp.asarray(wi), jnp.asarray(wo)), float)
    separable = four * np.asarray(separable_visibility(surface, jnp.asarray(wi), jnp.asarray(wo)), float)
    one, other = (w[:, 2] / np.asarray(masked_area(surface, jnp.asarray(w)), float) for w in (wi, wo))
    np.testing.assert_allclose(separable, one * other, rtol=1e-6)
    # G2 = 1 / (1 + Lambda_i + Lambda_o), G1 = 1 / (1 + Lambda) (Heitz 2014, Eqs. 43 and 99)
    np.testing.assert_allclose(correlated, 1 / (1 / one + 1 / other - 1), rtol=1e-6)
    assert np.all(correlated >= separable * (1 - 1e-6))
    assert np.all(correlated <= np.minimum(one, other) * (1 + 1e-6))


@pytest.mark.parametrize("kind", KINDS)
def test_a_mirror_masks_nothing_and_digits_are_kept_at_grazing(kind: str):
    wi, wo = (lift(jnp.asarray(w)) for w in cosines())
    grazing = jnp.array([[1.0, 0.0, 1e-7], [0.6, 0.8, 1e-5], [0.0, 0.0, 1.0], [0.8, -0.6, 1e-3]])
    wi, wo = jnp.concatenate([wi, grazing, grazing]), jnp.concatenate([wo, grazing, grazing[::-1]])
    surface = KINDS[kind](Isotropic(jnp.float32(1e-4)))
    single = [f(surface, wi, wo) for f in (correlated_visibility, separable_visibility)]
    with jax.enable_x64(True):
        double = [f(*in_double((surface, wi, wo))) for f in (correlated_visibility, separable_visibility)]
    np.testing.assert_allclose(single, double, rtol=3e-6)
    upright = np.asarray(wi[:, 2] * wo[:, 2]) > 1e-2
    np.testing.assert_allclose((4 * wi[:, 2] * wo[:, 2] * single[0])[upright], 1.0, rtol=1e-4)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", CASES)
def test_mirrored_visible_normals_integrate_to_one(kind: str, name: str):
    """d wi = 4 (wo . wh) d wh over the facets that face the viewer; with a mean slope too, whatever masking is."""
    grid = facets(CASES[name], 800)
    wo = np.asarray(spherical(jnp.array([0.0, 0.8, 1.5]), jnp.array(0.7)), float)
    with jax.enable_x64(True):
        surface = in_double(KINDS[kind](CASES[name].roughness, slope_of(CASES[name])))
        for w in wo:
            density = np.asarray(reflected_density(surface, jnp.asarray(grid.wh), jnp.asarray(w)))
            if float(surface.projected_area(jnp.asarray(w))) < 1e-6:
                continue
            mass = density * 4 * np.maximum(grid.wh @ w, 0.0) * grid.wh[:, 2] ** 3 * grid.area
            np.testing.assert_allclose(mass.sum(), 1.0, rtol=3e-3)


@pytest.mark.parametrize("kind", KINDS)
def test_facets_that_lean_away_gain_nothing(kind: str):
    surface = KINDS[kind](Isotropic(jnp.float32(0.05)), jnp.float32([2.0, 0.0]))
    away, towards = spherical(jnp.array(0.8), jnp.array(0.0)), spherical(jnp.array(0.8), jnp.array(jnp.pi))
    assert float(surface.projected_area(away)) < 0.1 * float(away[2])
    assert float(masked_area(surface, away)) == float(away[2])
    assert float(masked_area(surface, towards)) == float(surface.projected_area(towards)) > float(towards[2])


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_lifting_raises_only_what_is_below_the_least_cosine(dtype: type):
    with jax.enable_x64(dtype is np.float64):
        w = jnp.array([[1.0, 0.0, -0.3], [1.0, 0.0, 0.0], [0.6, 0.0, 0.8], [1.0, 0.0, 1e-7]], dtype)
        lifted = lift(w)
        assert lifted.dtype == dtype
        np.testing.assert_array_equal(lifted[:2, 2], LEAST_COSINE)
        np.testing.assert_array_equal(lifted[2:], w[2:])
