from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from PIL import Image

from jaxbrdf.texture.pyramid import Layout, between_levels, build_pyramid, level


def image(rows: int, columns: int) -> np.ndarray:
    return np.random.default_rng(0).uniform(size=(rows, columns, 2)).astype(np.float32)


@pytest.mark.parametrize("size", [(8, 8), (7, 12), (1, 5), (1, 1)])
def test_texels_are_means_over_their_area(size: tuple[int, int]):
    """Pillow's box filter of the image itself, whose weights it rounds to 2^-22."""
    layout, texels = Layout(*size), image(*size)
    pyramid = build_pyramid(layout, jnp.asarray(texels))
    assert pyramid.shape == (layout.texels, 2)
    for number, (rows, columns) in enumerate(layout.sizes):
        found = level(layout, pyramid, number)
        channels = [Image.fromarray(texels[:, :, c]).resize((columns, rows), Image.Resampling.BOX) for c in range(2)]
        if (texels.shape[0] / rows).is_integer() and (texels.shape[1] / columns).is_integer():
            np.testing.assert_allclose(found, np.stack([np.asarray(c) for c in channels], axis=-1), atol=1e-6)
        np.testing.assert_allclose(found.mean(axis=(0, 1)), texels.mean(axis=(0, 1)), atol=1e-6)


def test_texels_that_cut_others_count_their_share():
    """Means of a ramp, integrated by hand: three columns in one and a half each."""
    ramp = np.array([0.0, 1.0, 4.0, 9.0, 25.0], np.float32)[None, :, None]
    layout = Layout(1, 5)
    halves = level(layout, build_pyramid(layout, jnp.asarray(ramp)), 1)[0, :, 0]
    np.testing.assert_allclose(halves, [(0 + 1 + 0.5 * 4) / 2.5, (0.5 * 4 + 9 + 25) / 2.5], rtol=1e-6)


def test_sizes_are_opengls():
    layout = Layout(5, 12)
    assert layout.sizes == ((5, 12), (2, 6), (1, 3), (1, 1))
    assert layout.offsets == (0, 60, 72, 75)
    assert layout.texels == 76
    assert layout.top == 3


def test_levels_may_be_left_out():
    layout, texels = Layout(5, 12, levels=2), image(5, 12)
    assert layout.sizes == ((5, 12), (2, 6))
    assert (layout.texels, layout.top) == (72, 1)
    whole = build_pyramid(Layout(5, 12), jnp.asarray(texels))
    np.testing.assert_array_equal(build_pyramid(layout, jnp.asarray(texels)), whole[:72])
    below, share = between_levels(layout, jnp.asarray([0.5, 1.0, 3.0]))
    np.testing.assert_array_equal(below + share, [0.5, 1.0, 1.0])


def test_levels_of_a_table_are_views():
    layout = Layout(2, 3)
    np.testing.assert_array_equal(level(layout, jnp.arange(7.0)[:, None], 0)[:, :, 0], [[0, 1, 2], [3, 4, 5]])
    np.testing.assert_array_equal(level(layout, jnp.arange(7.0)[:, None], 1)[:, :, 0], [[6]])


def test_levels_outside_are_the_first_or_the_last():
    lod = jnp.asarray([-jnp.inf, -1.0, 0.0, 0.25, 3.0, 7.5, jnp.inf, jnp.nan])
    below, share = jax.jit(lambda lod: between_levels(Layout(8, 8), lod))(lod)
    np.testing.assert_array_equal(below[:7], [0, 0, 0, 0, 3, 3, 3])
    np.testing.assert_array_equal(share, [0, 0, 0, 0.25, 0, 0, 0, np.nan])
    assert 0 <= int(below[7]) <= 3


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Layout(0, 4), "not 0 x 4"),
        (lambda: Layout(4, 4, "tile"), "not 'tile'"),
        (lambda: Layout(4, 4, levels=0), "levels is from 1 to 3, not 0"),
        (lambda: Layout(4, 4, levels=4), "levels is from 1 to 3, not 4"),
        (lambda: build_pyramid(Layout(4, 4), jnp.zeros((4, 5, 1))), r"not \(4, 4, channels\)"),
        (lambda: level(Layout(4, 4), jnp.zeros((21, 1)), 3), "0 to 2, not 3"),
        (lambda: level(Layout(4, 4), jnp.zeros((20, 1)), 0), r"\(21, channels\), not \(20, 1\)"),
    ],
)
def test_mistakes_are_named(make, message: str):
    with pytest.raises(ValueError, match=message):
        make()
