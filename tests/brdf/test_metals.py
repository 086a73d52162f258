"""The metals' numbers against their derivation, and their reflectance against wavelength by wavelength."""

from __future__ import annotations

from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

from experiments.derive_metals import derive, read
from jaxbrdf.brdf.metals import INDICES, METALS
from jaxbrdf.core.fresnel import Conductor
from jaxbrdf.core.ranges import check_ranges
from jaxbrdf.core.thin_film import film_reflectance, integrated_reflectance
from jaxbrdf.data.conductor import rgb_reflectance
from jaxbrdf.data.ior import interpolate
from jaxbrdf.data.spectrum import VISIBLE, visible_response

COSINES = np.linspace(0.0, 1.0, 51)
FARTHEST = {"gold": 0.009, "copper": 0.004}
"""From the spectral reflectance, as `jaxbrdf.brdf.metals` states it; 0.001 of the others."""


def test_every_metal_is_valid_and_new_each_time():
    for make in METALS.values():
        metal = make()
        assert isinstance(metal, Conductor)
        check_ranges(metal)
        assert make() is not metal


@pytest.mark.parametrize("name", INDICES)
def test_numbers_are_what_the_tables_give(name: str, data_dir: Path):
    derived, metal = derive(INDICES[name], data_dir), INDICES[name]
    np.testing.assert_allclose((derived.eta, derived.k), (metal.eta, metal.k), rtol=2e-4)


@pytest.mark.parametrize("name", INDICES)
def test_reflectance_is_the_spectral_one(name: str, data_dir: Path):
    want = np.clip(rgb_reflectance(read(INDICES[name], data_dir), COSINES), 0.0, 1.0)
    got = METALS[name]().reflectance(jnp.asarray(COSINES, jnp.float32))
    np.testing.assert_allclose(got, want, rtol=0, atol=FARTHEST.get(name, 0.001))


def test_known_colours():
    """Gold is yellow, copper red, silver and aluminium nearly white: linear Rec.709 at normal incidence."""
    normal = {name: METALS[name]().reflectance(jnp.array(1.0)) for name in METALS}
    np.testing.assert_allclose(normal["gold"], [0.999, 0.728, 0.365], atol=2e-3)
    np.testing.assert_allclose(normal["copper"], [0.932, 0.623, 0.522], atol=2e-3)
    np.testing.assert_allclose(normal["silver"], [0.989, 0.984, 0.978], atol=2e-3)
    np.testing.assert_allclose(normal["aluminium"], [0.907, 0.916, 0.922], atol=2e-3)


@pytest.mark.parametrize(("name", "worst"), [("titanium", 0.05), ("gold", 0.23)])
def test_a_film_on_a_metal_keeps_its_colour_without_dispersion(name: str, worst: float, data_dir: Path):
    """The film on one index a channel against the film on the metal's whole spectrum."""
    cos, thickness = (x.ravel() for x in np.meshgrid([0.1, 0.5, 1.0], np.linspace(0.0, 1000.0, 26), indexing="ij"))
    cos, thickness = jnp.asarray(cos, jnp.float32), jnp.asarray(thickness, jnp.float32)
    index = interpolate(read(INDICES[name], data_dir), VISIBLE)
    spectral = tuple(jnp.asarray(x, jnp.float32) for x in (index.real, index.imag))
    response = tuple(jnp.asarray(x, jnp.float32) for x in (VISIBLE, visible_response()))
    want = integrated_reflectance(cos, thickness, jnp.float32(1.5), spectral, response)
    metal = METALS[name]()
    got = film_reflectance(cos[:, None], thickness[:, None], jnp.full((1, 1), 1.5), metal.eta[None], metal.k[None])
    np.testing.assert_allclose(np.clip(got, 0, 1), np.clip(want, 0, 1), rtol=0, atol=worst)
