"""The tabulated albedo against closed forms and against quadrature of another kind."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np

from jaxbrdf.brdf.albedo_table import AlbedoTable, albedo_at, table_views, tabulate_albedo
from jaxbrdf.brdf.lambert import LAMBERT, LambertParams
from jaxbrdf.brdf.microfacet import MICROFACET, ggx
from jaxbrdf.checks.rings import albedo_by_rings
from jaxbrdf.core.directions import spherical
from jaxbrdf.core.fresnel import Conductor
from jaxbrdf.core.grazing import grazing, view_at


def test_a_lambertian_returns_its_albedo_to_every_viewer():
    colour = jnp.array([0.2, 0.5, 1.0])
    table = tabulate_albedo(LAMBERT.eval, LambertParams(colour), isotropic=True)
    np.testing.assert_allclose(table.values, jnp.broadcast_to(colour, table.values.shape), rtol=1e-3)


def test_a_narrow_anisotropic_lobe_as_rings_about_the_mirror_see_it():
    metal = Conductor(jnp.array([0.2, 0.4, 1.3]), jnp.array([3.2, 2.5, 1.9]))
    params = ggx(jnp.array(0.02), jnp.array(0.1), metal)
    table = tabulate_albedo(MICROFACET.eval, params, isotropic=False)
    for theta, phi in ((0.0, 0.3), (0.8, 0.0), (0.8, 1.4), (1.3, 2.0)):
        wo = spherical(jnp.array(theta), jnp.array(phi))
        expected = albedo_by_rings(MICROFACET.eval, params, np.asarray(wo, float))
        # the table is linear between azimuths 22.5 degrees apart
        np.testing.assert_allclose(albedo_at(table, wo), expected, atol=4e-3)


def test_lookups_meet_the_nodes_wrap_and_end_at_the_horizon():
    values = np.random.default_rng(0).uniform(size=(4, 6, 3)).astype(np.float32)
    table = AlbedoTable(jnp.asarray(values))
    # the first node has no azimuth, the last one's viewer is the least above the horizon
    np.testing.assert_allclose(albedo_at(table, table_views(6, 4))[:, 1:5], values[:, 1:5], atol=1e-5)
    before, after = (view_at(jnp.array(0.4), jnp.array(phi)) for phi in (-1e-6, 1e-6))
    np.testing.assert_allclose(albedo_at(table, before), albedo_at(table, after), atol=1e-5)
    assert not albedo_at(table, jnp.array([0.6, 0.0, -0.8])).any()
    assert np.isfinite(albedo_at(table, jnp.array([1.0, 0.0, 1e-30]))).all()


def test_the_elevations_coordinate_inverts():
    t = jnp.linspace(0.0, 0.98, 50)
    np.testing.assert_allclose(grazing(view_at(t, jnp.full(50, 2.0))), t, atol=2e-6)
    assert 0.98 < float(grazing(jnp.array([1.0, 0.0, 0.0]))) < 1.0
