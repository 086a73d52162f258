"""LEAN mapping: no change where there is nothing to filter, and the lobe that a rough field has from afar."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.core.beckmann import Beckmann
from jaxbrdf.core.directions import spherical
from jaxbrdf.surface.lean import lean
from jaxbrdf.surface.prefilter import prefiltered
from jaxbrdf.surface.slopes import pack_slopes
from jaxbrdf.surface.textured import mip_mapped, pack, textured
from jaxbrdf.texture.pyramid import Layout, build_pyramid
from jaxbrdf.types import Query
from tests.surface.maps import gaussian_slopes, metal, mixed, normals, pairs, whole

SIZE = 128
LAYOUT = Layout(SIZE, SIZE)


@pytest.mark.parametrize("slope", [(0.0, 0.0), (0.4, -0.7)])
def test_a_map_that_is_the_same_everywhere_is_the_material_of_its_points(slope: tuple[float, float]):
    layout, normal = Layout(4, 4), normals(np.broadcast_to(slope, (4, 4, 2)))
    params = jax.tree.map(lambda field: jnp.broadcast_to(field[:1, :1], (4, 4, *field.shape[2:])), mixed(4))
    texels = build_pyramid(layout, pack_slopes(params, normal))
    query = pairs(500)
    points = textured(layout).eval(build_pyramid(layout, pack(params, normal)), query._replace(footprint=None))
    for footprint in (0.0, 0.3, 100.0):
        own = lean(layout).eval(texels, query._replace(footprint=footprint + query.footprint))
        np.testing.assert_allclose(own, points, rtol=1e-3, atol=1e-6)


def mean_error(own: jax.Array, truth: jax.Array) -> float:
    return float(jnp.sum(jnp.abs(own - truth)) / jnp.sum(truth))


def test_a_gaussian_field_from_afar():
    """Facets of alpha 0.04 on slopes of deviations 0.2 and 0.12, seen from 0.4 radians: the mean of points."""
    normal, own = normals(gaussian_slopes(SIZE, (0.2, 0.12))), metal(0.2)
    theta, phi = jnp.meshgrid(jnp.linspace(0.0, 0.9, 6), jnp.linspace(0.0, 3.1, 6))
    query = whole(spherical(theta.ravel(), phi.ravel()), spherical(jnp.float32(0.4), jnp.float32(0.5)))
    maps, slopes = (build_pyramid(LAYOUT, make(own, normal)) for make in (pack, pack_slopes))
    truth = jax.jit(prefiltered(textured(LAYOUT).eval, samples=32_768))(jax.random.key(0), maps, query)
    plain = mean_error(mip_mapped(LAYOUT).eval(maps, query), truth)
    beckmann = mean_error(lean(LAYOUT, facets=Beckmann).eval(slopes, query), truth)
    assert beckmann < plain / 8.0


def test_a_query_without_its_place_is_refused():
    texels = build_pyramid(Layout(1, 1), pack_slopes(metal(0.3), normals(np.zeros((1, 1, 2)))))
    with pytest.raises(ValueError, match="uv and a footprint"):
        lean(Layout(1, 1)).eval(texels, Query(jnp.zeros((1, 3)), jnp.zeros((1, 3))))
