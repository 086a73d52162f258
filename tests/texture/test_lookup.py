"""Spatial lookups against scipy, against the slow ones of slow.py, and against what holds for any texels."""

from __future__ import annotations

from collections.abc import Callable
from typing import get_args

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from jaxbrdf.texture import lookup
from jaxbrdf.texture.pyramid import Layout, Wrap, build_pyramid, level
from tests.texture import slow

# compiled once for each shape, where operation by operation takes far longer
bilinear = jax.jit(lookup.bilinear, static_argnames="level")
trilinear = jax.jit(lookup.trilinear)
stochastic = jax.jit(lookup.stochastic)
anisotropic = jax.jit(lookup.anisotropic, static_argnames="probes")

SCIPY = {"repeat": "grid-wrap", "clamp": "nearest", "mirror": "reflect"}
COUNT = 60
LAYOUT = Layout(10, 16)


def table(layout: Layout, channels: int = 2) -> jax.Array:
    """Levels of which none is made from another, so that a wrong one is seen."""
    return jnp.asarray(np.random.default_rng(1).uniform(-1, 1, (layout.texels, channels)), jnp.float32)


def places() -> np.ndarray:
    """Texture coordinates in and about one period, `(n, 2)`, seams among them."""
    hard = [(0, 0), (1, 1), (-1e-9, 0.5), (0.5, 1 - 6e-8)]
    rng = np.random.default_rng(2)
    return np.concatenate([hard, rng.uniform(-2, 3, (COUNT - len(hard), 2))]).astype(np.float32)


def lods() -> np.ndarray:
    return np.resize([-1, 0, 1e-7, 0.3, 1, 1.999, 2.5, 3, 7], COUNT).astype(np.float32)


def footprints() -> np.ndarray:
    """Random ones, and of size zero, lines, beyond the pyramid, infinite."""
    hard = [(0, 0, 0, 0), (1e-30,) * 4, (0.25, 0, 0.25, 0), (1e30, 0, 0, 1e-3), (0, np.inf, 0, 0)]
    found = slow.footprints(COUNT, 10)
    found[: len(hard)] = np.array(hard).reshape(-1, 2, 2)
    return found


Lookup = Callable[[Layout, jax.Array, jax.Array], jax.Array]
LOOKUPS: dict[str, Lookup] = {
    "bilinear": lambda layout, texels, uv: bilinear(layout, texels, uv, level=1),
    "trilinear": lambda layout, texels, uv: trilinear(layout, texels, uv, jnp.asarray(lods(), uv.dtype)),
    "anisotropic": lambda layout, texels, uv: anisotropic(layout, texels, uv, jnp.asarray(footprints(), uv.dtype)),
}
every_lookup = pytest.mark.parametrize("name", LOOKUPS)


@pytest.mark.parametrize("wrap", get_args(Wrap))
@pytest.mark.parametrize("number", [0, 1])
def test_bilinear_is_scipys(wrap: Wrap, number: int):
    layout, uv = Layout(7, 12, wrap), places()
    texels = table(layout)
    image = np.asarray(level(layout, texels, number), np.float64)
    at = uv.T[::-1].astype(np.float64) * np.array(image.shape[:2])[:, None] - 0.5
    wanted = [map_coordinates(image[:, :, c], at, order=1, mode=SCIPY[wrap]) for c in range(2)]
    np.testing.assert_allclose(bilinear(layout, texels, jnp.asarray(uv), level=number), np.transpose(wanted), atol=1e-5)


def test_trilinear_is_two_lookups():
    layout, uv, lod = Layout(7, 12, "mirror"), places(), lods()
    texels = table(layout)
    images = slow.levels(layout, np.asarray(texels))
    wanted = [
        slow.trilinear(layout, images, *at) for at in np.concatenate([uv, lod[:, None]], axis=1).astype(np.float64)
    ]
    np.testing.assert_allclose(trilinear(layout, texels, jnp.asarray(uv), jnp.asarray(lod)), wanted, atol=1e-5)


@pytest.mark.parametrize(
    ("layout", "most"), [(LAYOUT, 16), (Layout(20, 7, "clamp"), 5), (LAYOUT, 1), (Layout(1, 1), 16)]
)
def test_anisotropic_is_the_slow_one(layout: Layout, most: int):
    texels, uv, footprint = table(layout), places(), footprints()
    found = anisotropic(layout, texels, jnp.asarray(uv), jnp.asarray(footprint), probes=most)
    images = slow.levels(layout, np.asarray(texels))
    asked = zip(uv.astype(np.float64), footprint, strict=True)
    np.testing.assert_allclose(found, [slow.anisotropic(layout, images, at, j, most) for at, j in asked], atol=1e-5)


def test_footprints_of_no_size_and_of_any_size():
    texels, uv = table(LAYOUT), jnp.asarray(places())
    nothing, all_of_it = jnp.zeros((COUNT, 2, 2)), jnp.full((COUNT, 2, 2), jnp.inf)
    np.testing.assert_allclose(anisotropic(LAYOUT, texels, uv, nothing), bilinear(LAYOUT, texels, uv), atol=1e-6)
    last = jnp.broadcast_to(texels[-1:], (COUNT, 2))
    np.testing.assert_allclose(anisotropic(LAYOUT, texels, uv, all_of_it), last, atol=1e-6)


def test_a_nan_is_one_of_its_own_place_alone():
    texels, uv, footprint = table(LAYOUT), jnp.asarray(places()), jnp.asarray(footprints())
    found = anisotropic(LAYOUT, texels, uv.at[3, 1].set(jnp.nan), footprint.at[5, 0, 1].set(jnp.nan))
    np.testing.assert_array_equal(np.isnan(found).all(axis=1), np.isin(np.arange(COUNT), [3, 5]))
    np.testing.assert_array_equal(np.isnan(found).any(axis=1), np.isin(np.arange(COUNT), [3, 5]))
    lod = jnp.asarray(lods()).at[4].set(jnp.nan)
    for value in (trilinear(LAYOUT, texels, uv, lod), stochastic(LAYOUT, texels, uv, lod, uv[:, 0])):
        np.testing.assert_array_equal(np.isnan(value).any(axis=1), np.arange(COUNT) == 4)


def test_far_coordinates_keep_their_digits():
    texels, uv = table(LAYOUT), np.array([[0.25, 0.625]], np.float32)
    for turns in (-4096.0, 4096.0):
        far = jnp.asarray(uv + np.float32(turns))
        np.testing.assert_array_equal(bilinear(LAYOUT, texels, far), bilinear(LAYOUT, texels, jnp.asarray(uv)))
    assert np.isfinite(bilinear(LAYOUT, texels, jnp.asarray([[1e30, -3e38]]))).all()


@every_lookup
def test_a_constant_comes_back_and_the_next_period_is_the_same(name: str):
    ask, uv = LOOKUPS[name], jnp.asarray(places())
    constant = jnp.full((LAYOUT.texels, 2), 3.0)
    np.testing.assert_allclose(ask(LAYOUT, constant, uv), 3.0, rtol=1e-6)
    here, there = ask(LAYOUT, table(LAYOUT), uv), ask(LAYOUT, table(LAYOUT), uv + jnp.asarray([[2.0, -1.0]]))
    np.testing.assert_allclose(there, here, atol=3e-5)


@every_lookup
def test_turning_the_texture_turns_the_lookup(name: str):
    """By a number of columns that every level can be turned by, but those of one texel, which are the same anyway."""
    layout = Layout(4, 16)
    image = jnp.asarray(np.random.default_rng(4).normal(size=(4, 16, 2)), jnp.float32)
    turned = build_pyramid(layout, jnp.roll(image, 8, axis=1))
    uv = jnp.asarray(places())
    here = LOOKUPS[name](layout, build_pyramid(layout, image), uv)
    np.testing.assert_allclose(LOOKUPS[name](layout, turned, uv + jnp.asarray([[0.5, 0.0]])), here, atol=3e-5)


def covariance(layout: Layout, footprint: np.ndarray, probes: int) -> np.ndarray:
    """Of a lookup, in texels, in the mean over places; read off a texture that holds the means of the products.

    Four places a texel and axis, over the texels of any level that is read: their mean of f (1 - f) over the fraction f
    between two texels is 1 / 192 off.
    """
    size = np.array([layout.width, layout.height])
    y, x = np.mgrid[: layout.height, : layout.width] + 0.5
    products = build_pyramid(layout, jnp.asarray(np.stack([x, y, x * x + 1 / 12, x * y, y * y + 1 / 12], axis=-1)))
    at = np.stack(np.meshgrid(*2 * [np.arange(0.125, 16, 0.25)]), axis=-1).reshape(-1, 2) + size / 2
    spread = jnp.asarray(np.tile(footprint, (len(at), 1, 1)))
    x, y, xx, xy, yy = np.asarray(anisotropic(layout, products, jnp.asarray(at / size), spread, probes=probes)).T
    np.testing.assert_allclose(np.stack([x, y], axis=1), at, rtol=1e-9)
    return np.mean([[xx - x * x, xy - x * y], [xy - x * y, yy - y * y]], axis=2)


@pytest.mark.parametrize(
    ("long", "short", "angle"), [(8, 8, 0.3), (3, 3, 0), (16, 1, 0.7), (10, 2, 2.5), (11, 3, 1), (15, 0.2, 0)]
)
def test_a_lookup_has_the_footprints_covariance(long: float, short: float, angle: float):
    layout = Layout(128, 128, "clamp")
    c, s = np.cos(angle), np.sin(angle)
    axes, twist = np.array([[c, -s], [s, c]]), np.array([[0.6, 0.8], [-0.8, 0.6]])
    with jax.enable_x64(True):
        found = covariance(layout, axes @ np.diag([long, short]) @ twist / 128, 16)
    wanted = axes @ np.diag([long**2, max(short, 1.0) ** 2]) @ axes.T / 4
    np.testing.assert_allclose(found, wanted, atol=1 / 192 + 1e-4)


def test_one_probe_is_as_wide_as_the_footprint_is_long():
    with jax.enable_x64(True):
        found = covariance(Layout(128, 128, "clamp"), np.array([[0.0, 0.1], [12.0, 0.0]]) / 128, 1)
    np.testing.assert_allclose(found, 36 * np.eye(2), atol=1 / 192 + 1e-4)


def test_stochastic_is_trilinear_in_the_mean():
    """Exactly, over numbers of which as many are below any share as it says, to a hundredth."""
    layout, texels = LAYOUT, table(LAYOUT)
    uv, lod = (jnp.asarray(np.repeat(x, 100, axis=0)) for x in (places(), lods()))
    u = jnp.asarray(np.tile((np.arange(100) + 0.5) / 100, COUNT), jnp.float32)
    found = np.asarray(stochastic(layout, texels, uv, lod, u)).reshape(COUNT, 100, 2)
    wanted = np.asarray(trilinear(layout, texels, uv[::100], lod[::100]))
    np.testing.assert_allclose(found.mean(axis=1), wanted, atol=0.011)
    both = [np.asarray(trilinear(layout, texels, uv[::100], end(lod[::100]))) for end in (jnp.floor, jnp.ceil)]
    away = np.min([np.abs(found - level[:, None]) for level in both], axis=0)
    assert away.max() < 1e-5


@every_lookup
def test_the_gradient_by_texels_is_the_transpose(name: str):
    """<g, L t> = <L^T g, t>: with linearity, which the gradient does not depend on the texels for, all there is."""
    with jax.enable_x64(True):
        rng = np.random.default_rng(5)
        uv, g = jnp.asarray(places(), jnp.float64), jnp.asarray(rng.normal(size=(COUNT, 2)))
        texels, others = (jnp.asarray(rng.normal(size=(LAYOUT.texels, 2))) for _ in range(2))
        value, transpose = jax.vjp(lambda texels: LOOKUPS[name](LAYOUT, texels, uv), texels)
        (back,) = transpose(g)
        assert float(jnp.sum(g * value)) == pytest.approx(float(jnp.sum(back * texels)), rel=1e-10)
        of_others = LOOKUPS[name](LAYOUT, others, uv)
        assert float(jnp.sum(g * of_others)) == pytest.approx(float(jnp.sum(back * others)), rel=1e-10)
        np.testing.assert_allclose(LOOKUPS[name](LAYOUT, texels - 3 * others, uv), value - 3 * of_others, atol=1e-12)


@every_lookup
@pytest.mark.parametrize("wrap", ["repeat", "mirror"])
def test_gradients_by_coordinates_are_slopes(name: str, wrap: Wrap):
    layout = Layout(10, 16, wrap)
    with jax.enable_x64(True):
        texels, uv = table(layout).astype(jnp.float64), jnp.asarray(places(), jnp.float64)[4:]
        uv = jnp.concatenate([uv, uv[:4]])
        ask = jax.jit(lambda uv: LOOKUPS[name](layout, texels, uv))
        g = jnp.asarray(np.random.default_rng(6).normal(size=(COUNT, 2)))
        (found,) = jax.vjp(ask, uv)[1](g)
        for axis, step in enumerate(1e-7 * np.eye(2)):
            ends = [ask(uv + s * jnp.asarray(step)[None]) for s in (1, -1)]
            slope = jnp.sum(g * (ends[0] - ends[1]), axis=1) / 2e-7
            # a difference across the border between two cells is the slope of neither
            wrong = np.abs(found[:, axis] - slope) > 1e-5
            assert np.count_nonzero(wrong) <= 1, np.flatnonzero(wrong)


def test_the_gradient_by_lod_is_the_difference_of_levels():
    texels, uv = table(LAYOUT), jnp.asarray(places())
    lod = jnp.full(COUNT, 1.25)
    (found,) = jax.vjp(lambda lod: trilinear(LAYOUT, texels, uv, lod), lod)[1](jnp.ones((COUNT, 2)))
    difference = bilinear(LAYOUT, texels, uv, level=2) - bilinear(LAYOUT, texels, uv, level=1)
    np.testing.assert_allclose(found, difference.sum(axis=1), atol=1e-5)


def test_the_gradient_by_a_footprint_is_zero_even_where_it_is_singular():
    def total(footprint: jax.Array) -> jax.Array:
        return jnp.sum(anisotropic(LAYOUT, table(LAYOUT), jnp.asarray(places()), footprint))

    np.testing.assert_array_equal(jax.grad(total)(jnp.asarray(footprints())), 0)


@every_lookup
def test_jit_vmap_and_any_batch_shape_agree(name: str):
    texels, uv = table(LAYOUT), jnp.asarray(places())
    lod, footprint = jnp.asarray(lods()), jnp.asarray(footprints())
    one = {
        "bilinear": lambda uv, lod, j: bilinear(LAYOUT, texels, uv, level=1),
        "trilinear": lambda uv, lod, j: trilinear(LAYOUT, texels, uv, lod),
        "anisotropic": lambda uv, lod, j: anisotropic(LAYOUT, texels, uv, j),
    }[name]
    wanted = one(uv, lod, footprint)
    np.testing.assert_allclose(jax.jit(jax.vmap(one))(uv, lod, footprint), wanted, atol=1e-6)
    square = one(uv.reshape(6, 10, 2), lod.reshape(6, 10), footprint.reshape(6, 10, 2, 2))
    np.testing.assert_allclose(square.reshape(COUNT, 2), wanted, atol=1e-6)
    assert one(uv[:0], lod[:0], footprint[:0]).shape == (0, 2)


def test_what_is_not_asked_for_is_not_compiled():
    texels, uv, j = table(LAYOUT), jnp.asarray(places()), jnp.asarray(footprints())

    def loops(*asked: int) -> int:
        def back(texels: jax.Array, uv: jax.Array) -> list[jax.Array]:
            gradients = jax.vjp(lambda t, uv: anisotropic(LAYOUT, t, uv, j), texels, uv)[1](jnp.ones((COUNT, 2)))
            return [gradients[k] for k in asked]

        return jax.jit(back).lower(texels, uv).compile().as_text().count(" while(")

    assert max(loops(0), loops(1)) < loops(0, 1)
    isotropic = jax.make_jaxpr(lambda t, uv: anisotropic(LAYOUT, t, uv, j, probes=1))(texels, uv)
    assert "cumsum" not in str(isotropic)


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda t, uv: bilinear(LAYOUT, t, uv, level=5), "0 to 4, not 5"),
        (lambda t, uv: bilinear(LAYOUT, t[:-1], uv), "texels are"),
        (lambda t, uv: trilinear(LAYOUT, t[:-1], uv, uv[:, 0]), "texels are"),
        (lambda t, uv: anisotropic(LAYOUT, t[:-1], uv, jnp.zeros((COUNT, 2, 2))), "texels are"),
        (lambda t, uv: anisotropic(LAYOUT, t, uv, jnp.zeros((COUNT, 2, 2)), probes=0), "at least 1, not 0"),
    ],
)
def test_mistakes_are_named(ask, message: str):
    with pytest.raises(ValueError, match=message):
        ask(table(LAYOUT), jnp.asarray(places()))
