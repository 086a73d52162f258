"""Where float64 has no digits to judge by: densities and reflectances against fifty digits."""

from __future__ import annotations

import jax.numpy as jnp
import mpmath
import numpy as np
import pytest
from mpmath import mpf

from jaxbrdf.core.beckmann import Beckmann
from jaxbrdf.core.fresnel import dielectric
from jaxbrdf.core.ggx import Ggx
from jaxbrdf.core.roughness import Isotropic
from jaxbrdf.core.smith import Distribution

mpmath.mp.dps = 50

COSINES = np.array([1e-30, 1e-7, 1e-4, 0.3, 1.0], np.float32)


def reflectance(cos: mpf, eta: mpf) -> mpf:
    """Fresnel's amplitudes with the cosine beyond by Snell's law; all is reflected where it is imaginary."""
    squared = 1 - (1 - cos * cos) / (eta * eta)
    if squared <= 0:
        return mpf(1)
    beyond = mpmath.sqrt(squared)
    across = (cos - eta * beyond) / (cos + eta * beyond)
    along = (eta * cos - beyond) / (eta * cos + beyond)
    return (across**2 + along**2) / 2


@pytest.mark.parametrize("eta", [1e-3, 0.999, 1.0001, 1.5, 1e3])
def test_dielectric(eta: float):
    index = np.float32(eta)
    want = [float(reflectance(mpf(float(cos)), mpf(float(index)))) for cos in COSINES]
    np.testing.assert_allclose(dielectric(jnp.asarray(COSINES), jnp.asarray(index)), want, rtol=2e-5, atol=1e-12)


def ggx(tan_squared: mpf, cos: mpf, alpha: mpf) -> mpf:
    """Walter et al. 2007, Eq. 33."""
    return alpha**2 / (mpmath.pi * cos**4 * (alpha**2 + tan_squared) ** 2)


def beckmann(tan_squared: mpf, cos: mpf, alpha: mpf) -> mpf:
    """Walter et al. 2007, Eq. 25."""
    return mpmath.exp(-tan_squared / alpha**2) / (mpmath.pi * alpha**2 * cos**4)


@pytest.mark.parametrize(("kind", "formula"), [(Ggx, ggx), (Beckmann, beckmann)])
@pytest.mark.parametrize("alpha", [1e-4, 0.03, 1.0])
def test_density_of_normals(kind: type[Distribution], formula, alpha: float):
    """At normals tilted by multiples of alpha from 1e-3 to 3, of the rounded vectors taken as they are."""
    tilt = alpha * np.array([0.0, 1e-3, 0.3, 1.0, 3.0])
    wh = np.stack([np.sin(np.arctan(tilt)), np.zeros(5), np.cos(np.arctan(tilt))], axis=-1).astype(np.float32)
    rough = np.float32(alpha)
    want = []
    for x, _, z in wh.astype(float):
        # of length one but for a rounding, by which densities of small roughness must not be thrown
        length = mpmath.sqrt(mpf(x) ** 2 + mpf(z) ** 2)
        want.append(float(formula((mpf(x) / mpf(z)) ** 2, mpf(z) / length, mpf(float(rough)))))
    got = kind(Isotropic(jnp.asarray(rough))).density(jnp.asarray(wh))
    np.testing.assert_allclose(got, want, rtol=1e-5)
