"""What every closed-form lobe is tested for, of one set of parameters."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.test_util import check_grads

from jaxbrdf.checks.chi_square import chi_square
from jaxbrdf.checks.compiled import values
from jaxbrdf.checks.finite import find_faults, hard_queries
from jaxbrdf.checks.furnace import directional_albedo
from jaxbrdf.checks.partition import half_vector, polar
from jaxbrdf.checks.reciprocity import asymmetry
from jaxbrdf.checks.sampler import sampler_mismatch
from jaxbrdf.core.directions import spherical
from jaxbrdf.sampling.pairs import draw_weighted
from jaxbrdf.types import Brdf, Query
from tests.compiling import jit_as_users

VIEWERS = (0.0, 0.9, 1.45)

EVAL = jax.jit(lambda brdf, params, query: brdf.eval(params, query), static_argnums=0)
EVAL_AS_USERS = jit_as_users(EVAL, static_argnums=0)
ALBEDO = jax.jit(lambda brdf, params, query: brdf.albedo(params, query), static_argnums=0)
PAIRS = jax.jit(draw_weighted, static_argnums=1)


def viewer(theta: float) -> jax.Array:
    return spherical(jnp.array(theta), jnp.array(0.7))


def pairs(count: int, seed: int) -> Query:
    """Pairs above the horizon, many of them in a highlight, and the hard queries."""
    drawn, hard = PAIRS(jax.random.key(seed), count)[0], hard_queries()
    return Query(jnp.concatenate([drawn.wi, hard.wi]), jnp.concatenate([drawn.wo, hard.wo]))


def in_float64(tree: Any) -> Any:
    """The same rounded numbers; only where 64 bits are enabled."""
    return jax.tree.map(lambda x: jnp.asarray(np.asarray(x), jnp.float64), tree)


def assert_finite_and_reciprocal(brdf: Brdf, params: Any, *, within: float = 2e-6) -> None:
    assert find_faults(brdf, params) == []
    assert float(jnp.max(asymmetry(brdf, params, pairs(4000, 0), evaluate=EVAL_AS_USERS))) < within


def assert_float32_is_enough(brdf: Brdf, params: Any, *, relative: float = 1e-5, above: float = 1.2e-7) -> None:
    """float32 against float64 of the same rounded parameters and directions, so that arithmetic alone differs.

    Args:
        above: least cosine; below float32's epsilon `lift` raises it in float32 alone.
    """
    query = pairs(6000, 1)
    kept = np.flatnonzero(np.all([(w[:, 2] <= 0) | (w[:, 2] > above) for w in map(np.asarray, query[:2])], axis=0))
    query = Query(query.wi[kept], query.wo[kept])
    single = np.asarray(values(brdf, params, query), float)
    with jax.enable_x64(True):
        double = values(brdf, in_float64(params), in_float64(query))
    np.testing.assert_allclose(single, double, rtol=relative, atol=1e-30)


def assert_gradients_are_right(brdf: Brdf, params: Any) -> None:
    """Against finite differences, by parameters and directions, away from the horizon and from the lobe's peak."""
    query = jax.tree.map(lambda x: x[:200], PAIRS(jax.random.key(2), 400)[0])
    inside = np.flatnonzero((query.wi[:, 2] > 0.1) & (query.wo[:, 2] > 0.1))[:20]
    with jax.enable_x64(True):
        wi, wo, own = in_float64((query.wi[inside], query.wo[inside], params))
        log_f = lambda p, i, o: jnp.log(EVAL(brdf, p, Query(i, o)))  # noqa: E731
        check_grads(log_f, (own, wi, wo), order=1, modes=["rev"], rtol=1e-4, eps=1e-6)


def assert_sampler_is_exact(
    brdf: Brdf, params: Any, level: float, *, width: float | None = None, within: float = 1e-5
) -> None:
    """Draws against the density by chi-square at every viewer, and against what pdf and eval tell of them.

    Args:
        width: the lobe's own about the half vector; None for a broad one, tested in rings of which none crosses the
            horizon, where a density may jump.
    """
    for index, theta in enumerate(VIEWERS):
        wo = viewer(theta)
        cells = polar(spread=100.0) if width is None else half_vector(tuple(np.asarray(wo, float)), width, width)
        result = chi_square(jax.random.key(index), brdf, params, wo, partition=cells, samples=100_000)
        assert result.p_value > level, (theta, result)
    wo = jnp.broadcast_to(spherical(jnp.array(VIEWERS), jnp.full(3, 0.7))[:, None], (3, 3000, 3))
    mismatch = sampler_mismatch(brdf, params, wo, jax.random.uniform(jax.random.key(9), (3, 3000, 3)))
    assert float(jnp.max(jnp.stack(mismatch))) < within


def albedo_by_quadrature(brdf: Brdf, params: Any, theta: float, *, nodes: int = 160) -> np.ndarray:
    """Integral of f cos over wi, `(3,)`, by Gauss and Legendre in cos^(1/3) and azimuth from the viewer's: eval alone.

    In float64, since nodes lie as near the horizon as 1e-15.
    """
    t, weights = np.polynomial.legendre.leggauss(nodes)
    t, weights = 0.5 * (t + 1.0), 0.5 * weights
    cos, phi = np.meshgrid(t**3, np.pi * t, indexing="ij")
    sin = np.sqrt((1.0 - cos) * (1.0 + cos))
    wi = np.stack([sin * np.cos(phi), sin * np.sin(phi), cos], axis=-1)
    wo = np.broadcast_to([np.sin(theta), 0.0, np.cos(theta)], wi.shape)
    with jax.enable_x64(True):
        f = np.asarray(EVAL(brdf, in_float64(params), Query(jnp.asarray(wi), jnp.asarray(wo))))
    return np.einsum("ijc,i,j->c", f, 6.0 * np.pi * weights * t**5, weights)


def assert_draws_carry_the_albedo(brdf: Brdf, params: Any, *, least: float = 2e-4) -> None:
    """The sampler's own mean weight is the integral of eval."""
    for index, theta in enumerate(VIEWERS):
        found = directional_albedo(jax.random.key(index), brdf, params, viewer(theta))
        want = albedo_by_quadrature(brdf, params, theta)
        assert np.all(np.abs(found.value - want) < 4 * found.standard_error + least), (theta, found, want)
