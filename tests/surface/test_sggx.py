"""SGGX filtering: facets whose areas and normals are those of the mean ellipsoid."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.core.directions import untilt
from jaxbrdf.core.ggx import Ggx
from jaxbrdf.core.roughness import Isotropic
from jaxbrdf.sampling.hemisphere import square_to_cosine
from jaxbrdf.surface.sggx import facets_of, pack_sggx
from tests.surface.maps import metal, mixed, normals

ALPHA = 0.3
DIRECTIONS = square_to_cosine(jax.random.uniform(jax.random.key(0), (400, 2)))


def test_one_ellipsoid_has_the_normals_of_its_point():
    """D of the tilted facets, above both horizons, times the factor that makes it integrate to one over the surface."""
    normal = normals(np.broadcast_to([0.5, -0.3], (1, 1, 2)))
    matrix = pack_sggx(metal(ALPHA**0.5), normal)[0, 0, 4:]
    seen = untilt(DIRECTIONS, normal[0])
    want = np.where(seen[:, 2] > 0, Ggx(Isotropic(jnp.float32(ALPHA))).density(jnp.abs(seen)), np.nan)
    own = np.where(seen[:, 2] > 0, facets_of(matrix).density(DIRECTIONS) * jnp.sqrt(matrix[5]), np.nan)
    np.testing.assert_allclose(own, want, rtol=1e-4)


def test_projected_areas_are_those_of_the_mean_matrix():
    """sigma(w)^2 is linear in S: the mean over points of (w . n)^2 + alpha^2 (1 - (w . n)^2)."""
    rng = np.random.default_rng(0)
    normal, params = normals(rng.normal(0.2, 0.5, (8, 8, 2))), mixed(8)
    matrix = jnp.mean(pack_sggx(params, normal)[..., 4:].reshape(-1, 6), axis=0)
    squared = np.square(np.einsum("hwi,ni->nhw", np.asarray(normal, float), np.asarray(DIRECTIONS, float)))
    alpha_squared = np.asarray(params.roughness, float) ** 4
    want = np.mean(squared + alpha_squared * (1.0 - squared), axis=(1, 2))
    own = facets_of(matrix)
    # of both sides together, and per area of the surface
    area = own.projected_area(DIRECTIONS) + own.projected_area(-DIRECTIONS)
    np.testing.assert_allclose(jnp.square(area) * matrix[5], want, rtol=1e-5)


def test_a_smooth_tilted_point_keeps_a_valid_roughness():
    matrix = pack_sggx(metal(0.0), normals(np.broadcast_to([3.0, 40.0], (1, 1, 2))))[0, 0, 4:]
    own = facets_of(matrix)
    assert float(own.roughness.determinant()) > 0
    slopes = jax.jacrev(lambda m: facets_of(m).density(DIRECTIONS))(matrix)
    assert np.isfinite(slopes).all()
