"""Shifted gamma microfacets: the published normaliser, another implementation's values, measured materials, and what
every lobe is tested for."""

from __future__ import annotations

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import integrate, special

from jaxbrdf.brdf import measured
from jaxbrdf.brdf.sgd import SGD, SgdParams, _gamma, published
from jaxbrdf.checks.chi_square import significance_of_each
from jaxbrdf.core.directions import spherical
from jaxbrdf.sampling.hemisphere import square_to_cosine
from jaxbrdf.types import Query
from tests.brdf import lobes

# the authors' fits to MERL (Bagher et al. 2012), as dj_brdf (Dupuy 2015) lists them
TABLE = {
    "red-plastic": (
        (0.247569, 0.049382, 0.0175621),
        (0.406976, 0.151478, 0.176348),
        (0.28723, 0.0572489, 0.0624682),
        (0.939617, 0.0851973, 0.0701483),
        (0.10036, 0.178468, 0.149441),
        (0.0512697, 0.13191, 0.102958),
        (3.80564, 17.8374, 16.5631),
        (4.37031, 4.96092, 4.75924),
        (1.03822e-07, 0.0236845, 0.0321546),
        (18.6088, 16.1371, 15.1243),
        (-0.609047, 0.43547, 0.445882),
    ),
    "alum-bronze": (
        (0.0478786, 0.0313514, 0.0200638),
        (0.0364976, 0.664975, 0.268836),
        (0.014832, 0.0300126, 0.0490339),
        (0.459076, 0.450056, 0.529272),
        (6.05524, 0.235756, 0.580647),
        (5.05524, 0.182842, 0.476088),
        (46.3841, 24.5961, 14.8261),
        (2.60672, 2.97371, 2.7827),
        (1.12717e-07, 1.06401e-07, 5.27952e-08),
        (47.783, 36.2767, 31.6066),
        (0.205635, 0.066289, -0.0661091),
    ),
    "chrome-steel": (
        (0.0206718, 0.0240818, 0.024351),
        (0.129782, 0.109032, 0.0524555),
        (5.51292e-05, 3.13288e-05, 4.51944e-05),
        (0.207979, 0.152758, 0.325431),
        (1.18818e-12, 2.06813e-11, 0.580895),
        (-0.316807, -0.265326, -0.419105),
        (15466.8, 28628.9, 16531.2),
        (12.8988, 68.7898, 4.68237),
        (1e10, 1e10, 44.7025),
        (510.0, 665.0, 618.155),
        (1.20035, 1.2003, 0.579562),
    ),
}
FITTED = {name: published(columns) for name, columns in TABLE.items()}


def sgd(*columns: tuple[float, float, float]) -> SgdParams:
    return SgdParams(*(jnp.asarray(column, jnp.float32) for column in columns))


EXTREME = {
    "ends": sgd(
        (0, 0, 0),
        (10, 10, 10),
        (1e-5, 1e-3, 1),
        (2, 1, 0),
        (10, 0, 1),
        (10, -1, 0),
        (18, -18, 0),
        (4, -30, 0),
        (1000, 1, 100),
        (1.5, -1, 0),
    ),
    "black": sgd(*[(0, 0, 0)] * 2, *[(0.1, 0.1, 0.1)] * 2, *[(0, 0, 0)] * 4, (1, 10, 100), (0, 0, 0)),
}
ANGLES = (((0.3, 0.0), (0.5, 1.0)), ((1.2, 0.2), (1.1, 3.0)), ((0.8, 0.0), (0.8, 3.1)), ((1.5, 0.0), (0.2, 2.0)))
QUERY = Query(*(spherical(*jnp.array(ANGLES)[:, side].T) for side in (0, 1)))
# what dj_brdf gives in double precision for light and viewer at these polar angles and azimuths
OTHERS = {
    "red-plastic": (
        (0.085957254, 0.017306197, 0.0076955419),
        (0.16550672, 0.040277488, 0.036015466),
        (0.13089581, 0.074874169, 0.060377073),
        (0.082780479, 0.015719371, 0.0055920321),
    ),
    "alum-bronze": (
        (0.015248481, 0.010645578, 0.008626929),
        (0.015325464, 0.019417068, 0.040374872),
        (3.5235637, 1.460239, 0.88942637),
        (0.015240232, 0.0099794606, 0.0063865891),
    ),
}


@pytest.mark.parametrize("name", OTHERS)
def test_agrees_with_another_implementation(name: str):
    """K, which that one reads, has six digits."""
    np.testing.assert_allclose(lobes.EVAL(SGD, FITTED[name], QUERY), OTHERS[name], rtol=3e-5)


@pytest.mark.parametrize("name", TABLE)
def test_the_normaliser_is_the_published_one(name: str):
    own = FITTED[name]
    np.testing.assert_allclose(1.0 / (own.alpha * _gamma(own)), TABLE[name][6], rtol=2e-5)


def test_the_normaliser_is_an_incomplete_gamma_function():
    """Against SciPy's for p < 1, where it has one, and against quadrature."""
    alpha, p = (x.ravel() for x in np.meshgrid([1e-5, 1e-2, 0.5, 1.0], [0.0, 0.5, 0.999, 1.0, 1.5, 2.0]))
    with jax.enable_x64(True):
        own = FITTED["red-plastic"]._replace(alpha=jnp.asarray(alpha), p=jnp.asarray(p))
        found = np.asarray(_gamma(own))
    want = [
        integrate.quad(lambda s, q=q: np.exp((1 - q) * s - np.exp(s)), np.log(x), 5)[0]
        for x, q in zip(alpha, p, strict=True)
    ]
    np.testing.assert_allclose(found, want, rtol=1e-7)
    below = p < 1
    exact = special.gammaincc(1 - p[below], alpha[below]) * special.gamma(1 - p[below])
    np.testing.assert_allclose(found[below], exact, rtol=1e-7)


@pytest.mark.parametrize("name", ["red-plastic"])
def test_is_near_the_measured_material(data_dir: Path, name: str):
    """MERL's own measurement by the published network: half of the pairs, in each channel, within a sixth."""
    material = measured.load(data_dir / "nbrdf" / "merl_nbrdf.zip" / f"{name}.h5")
    query = Query(*square_to_cosine(jax.random.uniform(jax.random.key(0), (2, 4000, 2), maxval=0.95)))
    want = jax.jit(material.brdf.eval)(material.params, query)
    deviation = np.abs(np.log((lobes.EVAL(SGD, FITTED[name], query) + 1e-3) / (want + 1e-3)))
    assert np.all(np.median(deviation, axis=0) < 0.18)


@pytest.mark.parametrize("params", [*FITTED.values(), *EXTREME.values()], ids=[*FITTED, *EXTREME])
def test_finite_reciprocal_and_precise(params: SgdParams):
    lobes.assert_finite_and_reciprocal(SGD, params)
    lobes.assert_float32_is_enough(SGD, params, relative=1e-4, above=1e-2)
    # G1 is a difference from one: the closer it is to zero, towards the horizon, the fewer digits it has left
    lobes.assert_float32_is_enough(SGD, params, relative=3e-3)


@pytest.mark.parametrize(("name", "width"), [("red-plastic", None), ("alum-bronze", 0.1)])
def test_sampler(name: str, width: float | None):
    level = significance_of_each(0.01, 2 * len(lobes.VIEWERS))
    lobes.assert_sampler_is_exact(SGD, FITTED[name], level, width=width, within=2e-3)


def test_draws_carry_the_albedo():
    lobes.assert_draws_carry_the_albedo(SGD, FITTED["red-plastic"], least=2e-3)


def test_gradients():
    lobes.assert_gradients_are_right(SGD, FITTED["red-plastic"])
