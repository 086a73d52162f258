"""The ABC model: another implementation's values, measured materials, and what every lobe is tested for."""

from __future__ import annotations

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.brdf import measured
from jaxbrdf.brdf.abc import ABC, AbcParams
from jaxbrdf.checks.chi_square import significance_of_each
from jaxbrdf.core.directions import spherical
from jaxbrdf.sampling.hemisphere import square_to_cosine
from jaxbrdf.types import Query
from tests.brdf import lobes


def abc(diffuse: tuple, a: tuple, b: float, c: float, eta: float) -> AbcParams:
    return AbcParams(*(jnp.asarray(value, jnp.float32) for value in (diffuse, a, np.log(b), c, eta)))


# the authors' fits to MERL (Low et al. 2012), as dj_brdf (Dupuy 2015) lists them
FITTED = {
    "red-plastic": abc((0.268, 0.044432, 0.010675), (1.081538, 1.045352, 1.037089), 34.117554, 1.529797, 1.66645),
    "alum-bronze": abc(
        (0.024514, 0.022346, 0.01622), (51.714554, 37.932693, 27.373095), 10482.133789, 0.816737, 2.236525
    ),
    "red-fabric": abc((0.185341, 0.020015, 0.003522), (0.934393, 0.314632, 0.273278), 130451.1875, 0.287254, 3.335066),
}
EXTREME = {
    "logarithmic": abc((0.1, 0.1, 0.1), (1.0, 2.0, 3.0), 1e3, 1.0, 1.5),
    "sharpest": abc((0.0, 0.0, 0.0), (5000.0, 5000.0, 5000.0), 2e7, 10.0, 1e3),
    "flattest": abc((0.0, 0.5, 1.0), (0.0, 1.0, 1.0), 0.02, 0.01, 1.0),
    "black": abc((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1e4, 1.0, 1.0),
}
ANGLES = (((0.3, 0.0), (0.5, 1.0)), ((1.2, 0.2), (1.1, 3.0)), ((0.8, 0.0), (0.8, 3.1)), ((1.5, 0.0), (0.2, 2.0)))
QUERY = Query(*(spherical(*jnp.array(ANGLES)[:, side].T) for side in (0, 1)))
# what dj_brdf gives in double precision for light and viewer at these polar angles and azimuths
OTHERS = {
    "red-plastic": (
        (0.089715307, 0.018403911, 0.0076250454),
        (0.13363889, 0.060857898, 0.049743454),
        (0.13795567, 0.065030251, 0.053882827),
        (0.087059392, 0.015836858, 0.0050782828),
    ),
    "alum-bronze": (
        (0.021978372, 0.017510571, 0.012666144),
        (0.10861073, 0.081055517, 0.058521624),
        (1.9696748, 1.4461484, 1.0436038),
        (0.016792229, 0.013706528, 0.0099210604),
    ),
}


@pytest.mark.parametrize("name", OTHERS)
def test_agrees_with_another_implementation(name: str):
    np.testing.assert_allclose(lobes.EVAL(ABC, FITTED[name], QUERY), OTHERS[name], rtol=5e-6)


@pytest.mark.parametrize("name", ["red-plastic", "red-fabric"])
def test_is_near_the_measured_material(data_dir: Path, name: str):
    """MERL's own measurement by the published network: half of the pairs, in each channel, within a sixth."""
    material = measured.load(data_dir / "nbrdf" / "merl_nbrdf.zip" / f"{name}.h5")
    query = Query(*square_to_cosine(jax.random.uniform(jax.random.key(0), (2, 4000, 2), maxval=0.95)))
    want = jax.jit(material.brdf.eval)(material.params, query)
    deviation = np.abs(np.log((lobes.EVAL(ABC, FITTED[name], query) + 1e-3) / (want + 1e-3)))
    assert np.all(np.median(deviation, axis=0) < 0.18)


@pytest.mark.parametrize("params", [*FITTED.values(), *EXTREME.values()], ids=[*FITTED, *EXTREME])
def test_finite_reciprocal_and_precise(params: AbcParams):
    lobes.assert_finite_and_reciprocal(ABC, params)
    # c log(1 + b t) is the logarithm of what is left, up to 170 for the sharpest: so much more of its rounding is seen
    lobes.assert_float32_is_enough(ABC, params, relative=2e-6 + 4e-6 * float(params.c))


@pytest.mark.parametrize(
    ("params", "width"),
    [(FITTED["red-plastic"], None), (FITTED["alum-bronze"], 0.1), (EXTREME["logarithmic"], 0.1)],
    ids=["red-plastic", "alum-bronze", "logarithmic"],
)
def test_sampler(params: AbcParams, width: float | None):
    level = significance_of_each(0.01, 3 * len(lobes.VIEWERS))
    lobes.assert_sampler_is_exact(ABC, params, level, width=width, within=2e-3)


@pytest.mark.parametrize("name", ["red-plastic", "red-fabric"])
def test_draws_carry_the_albedo(name: str):
    lobes.assert_draws_carry_the_albedo(ABC, FITTED[name], least=2e-3)


def test_gradients():
    lobes.assert_gradients_are_right(ABC, FITTED["red-plastic"])
