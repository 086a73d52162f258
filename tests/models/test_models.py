from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.checks.finite import find_faults
from jaxbrdf.checks.parity import with_isotropy
from jaxbrdf.checks.reciprocity import asymmetry
from jaxbrdf.core.directions import from_half_difference
from jaxbrdf.models.table import MODELS
from jaxbrdf.types import Query
from tests.export.bundles import VARIANTS
from tests.models.variants import COUNT, FEW, GENERAL, TEXTURED, angles, case, pairs, unit


def count(tree: object) -> int:
    return sum(leaf.size for leaf in jax.tree.leaves(tree))


@pytest.mark.parametrize(
    ("model", "numbers"),
    [
        # H and D of 32 x 32 x 6 each; a decoder of 351 or 437; two warps of two terms
        ("gated", 2 * 32 * 32 * 6 + 351 + 8),
        ("tripleplane", 2 * 32 * 32 * 6 + 437),
        ("nbrdf", 563),
        ("naive-mlp", 675),
    ],
)
def test_sizes_are_the_papers(model: str, numbers: int):
    entry = MODELS[model]
    built = entry.build(with_isotropy(entry.config(), False))
    assert count(jax.eval_shape(built.init, jax.random.key(0))) == numbers


@pytest.mark.parametrize("model", ["gated", "tripleplane"])
def test_an_isotropic_material_has_no_azimuth_of_the_half_vector(model: str):
    built = MODELS[model].build(MODELS[model].config())
    assert jax.eval_shape(built.init, jax.random.key(0)).h.shape == (6, 32, 1)


@pytest.mark.parametrize("variant", ["gated horizon", "tripleplane odd sizes", "nbrdf linear", "naive-mlp general"])
def test_first_values_are_finite_and_differ_by_key(variant: str):
    name, config = VARIANTS[variant]
    model = MODELS[name].build(config)
    init = jax.jit(model.init)
    a, b = init(jax.random.key(0)), init(jax.random.key(1))
    assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(a))
    assert any(not np.array_equal(x, y) for x, y in zip(jax.tree.leaves(a), jax.tree.leaves(b), strict=True))


@pytest.mark.parametrize("variant", TEXTURED)
def test_reciprocal_by_construction(variant: str):
    _, brdf, params = case(variant)
    assert np.max(asymmetry(brdf, params, pairs(1))) < 1e-5


@pytest.mark.parametrize("variant", ["nbrdf general", "naive-mlp general"])
def test_the_networks_over_directions_are_not_reciprocal(variant: str):
    _, brdf, params = case(variant)
    assert np.max(asymmetry(brdf, params, pairs(1))) > 0.01


@pytest.mark.parametrize("variant", sorted(set(VARIANTS) - set(GENERAL)))
def test_turning_both_directions_changes_nothing(variant: str):
    _, brdf, params = case(variant)
    query = pairs(2)
    turned = Query(*(unit(turn(np.asarray(w, np.float64), 1.234)) for w in query[:2]))
    np.testing.assert_allclose(brdf.eval(params, turned), brdf.eval(params, query), rtol=3e-3)
    # rounding the turned directions moves only those that almost meet; the others agree much better
    apart = np.linalg.norm(query.wi - query.wo, axis=-1) > 0.1
    np.testing.assert_allclose(brdf.eval(params, turned)[apart], brdf.eval(params, query)[apart], rtol=3e-5)


@pytest.mark.parametrize("variant", GENERAL)
def test_the_general_variants_see_the_azimuth(variant: str):
    _, brdf, params = case(variant)
    query = pairs(2)
    turned = Query(*(unit(turn(np.asarray(w, np.float64), 1.234)) for w in query[:2]))
    assert np.max(np.abs(brdf.eval(params, turned) / brdf.eval(params, query) - 1)) > 0.1


def turn(w: np.ndarray, angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return w @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])


@pytest.mark.parametrize("variant", TEXTURED)
@pytest.mark.parametrize("seam", ["phi_h", "phi_d", "phi_d at its other end", "centre of H", "centre of D"])
def test_no_jump_where_coordinates_wrap(variant: str, seam: str):
    _, brdf, params = case(variant)
    query = Query(*(jnp.asarray(w.reshape(COUNT, 3), jnp.float32) for w in across(seam)))
    one, other = np.log(brdf.eval(params, query)).reshape(2, -1)
    # the two sides are 1e-5 apart; a texel's whole difference, which a jump would show, is of the order of one
    assert np.abs(one - other).max() < 5e-3


def across(seam: str) -> tuple[np.ndarray, np.ndarray]:
    """Pairs on both sides of a seam, `(2, n, 3)`."""
    step = np.array([-1e-5, 1e-5])[:, None]
    free = np.linspace(0.1, 0.6, COUNT // 2)
    azimuths = np.linspace(0.05, 3.0, COUNT // 2)
    wh, wd = {
        "phi_h": lambda: (angles(free, np.pi + step), angles(0.7 - free, 0.3 + 0 * step)),
        "phi_d": lambda: (angles(free, 0.4 + 0 * step), angles(0.7 - free, step)),
        "phi_d at its other end": lambda: (angles(free, 0.4 + 0 * step), angles(0.7 - free, np.pi + step)),
        "centre of H": lambda: opposite(azimuths, step),
        "centre of D": lambda: (angles(free, 0.3 + 0 * step), angles(1e-10 + 0 * step, azimuths * np.sign(step))),
    }[seam]()
    with jax.enable_x64(True):
        wi, wo = from_half_difference(jnp.asarray(wh), jnp.asarray(wd))
    return np.asarray(wi), np.asarray(wo)


def opposite(azimuths: np.ndarray, step: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Half vectors on both sides of the normal; wd turns with phi_h, so that the directions stay where they are."""
    turned = azimuths + np.pi * (step > 0)
    return angles(1e-10 + 0 * step, turned), angles(0.6 + 0 * step, 0.3 - turned)


@pytest.mark.parametrize("variant", FEW)
def test_values_and_gradients_hold_on_hard_queries(variant: str):
    _, brdf, params = case(variant)
    assert not find_faults(brdf, jax.tree.map(jnp.asarray, params))


@pytest.mark.parametrize(
    "variant", ["gated general", "tripleplane isotropic", "nbrdf isotropic", "naive-mlp isotropic"]
)
def test_gradients_by_parameters_are_slopes(variant: str):
    with jax.enable_x64(True):
        model, _, params = case(variant)
        params = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float64), params)
        query = Query(*(jnp.asarray(w, jnp.float64) for w in pairs(3, count=16)[:2]))
        direction = jax.tree.map(lambda leaf: jnp.asarray(np.random.default_rng(4).normal(size=leaf.shape)), params)

        @jax.jit
        def along(t: jax.Array) -> jax.Array:
            return jnp.log(model.eval(jax.tree.map(lambda p, d: p + t * d, params, direction), query)).sum()

        step = 1e-5
        slope = (along(jnp.asarray(step)) - along(jnp.asarray(-step))) / (2 * step)
        np.testing.assert_allclose(jax.jit(jax.grad(along))(jnp.asarray(0.0)), slope, rtol=1e-6)


@pytest.mark.parametrize("variant", FEW)
def test_eval_is_decode_of_encode(variant: str):
    model, brdf, params = case(variant)
    query = pairs(5, count=6)
    rows = jax.jit(model.decode)(params, jax.jit(model.encode)(query))
    assert rows.shape == (3, 6)
    f = brdf.eval(params, Query(query.wi.reshape(2, 3, 3), query.wo.reshape(2, 3, 3)))
    np.testing.assert_allclose(f.reshape(6, 3), np.exp(rows.T), rtol=1e-5)


def test_no_query_gives_no_value():
    _, brdf, params = case("gated isotropic")
    assert brdf.eval(params, pairs(6, count=0)).shape == (0, 3)
