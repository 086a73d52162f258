"""First latents and frames: what they say is what the maps say."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.fit.first_params import params_from_maps
from jaxbrdf.jobs.surface_config import sizes_of
from jaxbrdf.models.guided import guided
from jaxbrdf.models.shading_frame import frame_of
from jaxbrdf.models.spatial import LatentTexture
from jaxbrdf.models.spatial_gated import SpatialGatedConfig, spatial_gated
from jaxbrdf.models.table import SPATIAL
from jaxbrdf.surface.prefilter import prefiltered
from jaxbrdf.surface.textured import reciprocal_textured
from jaxbrdf.texture.pyramid import Pyramid
from jaxbrdf.types import Query
from tests.surface.relief import relief, relief_textures

SIZE = 16


def test_the_first_frames_normal_is_the_mean_normal():
    layout, texels = relief(SIZE)
    model = spatial_gated(SpatialGatedConfig(latents=LatentTexture(SIZE, SIZE)))
    params = params_from_maps(model.init(jax.random.key(0)), Pyramid(layout, texels))
    normal = np.stack(frame_of(params.frame.T @ params.s.texels.T).normal, axis=-1)
    want = relief_textures(SIZE).normal.reshape(-1, 3)
    np.testing.assert_allclose(normal[: SIZE * SIZE], want, atol=1e-4)


def test_latents_are_one_slopes_and_components_without_correlation():
    layout, texels = relief(SIZE)
    model = spatial_gated(SpatialGatedConfig(latents=LatentTexture(SIZE, SIZE)))
    latents = np.asarray(params_from_maps(model.init(jax.random.key(0)), Pyramid(layout, texels)).s.texels)
    np.testing.assert_array_equal(latents[:, 0], 1.0)
    components = latents[:, 3:]
    np.testing.assert_allclose(components.T @ components / len(components), np.eye(5), atol=1e-3)


def test_what_does_not_vary_is_zero_and_not_noise():
    texture = LatentTexture(2, 2, channels=6)
    model = spatial_gated(SpatialGatedConfig(latents=texture))
    features = jnp.tile(jnp.array([[0.1, -0.2, 0.3, 0.4]]), (texture.layout.texels, 1))
    params = guided(model.init(jax.random.key(0)), features)
    np.testing.assert_array_equal(params.s.texels[:, 1:], 0.0)
    assert np.isfinite(params.frame).all()


def test_three_channels_are_needed():
    texture = LatentTexture(2, 2, channels=2)
    model = spatial_gated(SpatialGatedConfig(latents=texture))
    with pytest.raises(ValueError, match="latents have 2 channels"):
        guided(model.init(jax.random.key(0)), jnp.zeros((texture.layout.texels, 3)))


@pytest.mark.parametrize("name", list(SPATIAL))
def test_every_model_can_start_from_the_maps(name: str):
    layout, texels = relief(8)
    model = SPATIAL[name].build(sizes_of(name, layout))
    params = params_from_maps(model.init(jax.random.key(0)), Pyramid(layout, texels))
    assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(params))


def test_a_mip_map_of_lobes_starts_near_the_surface_under_small_footprints():
    """LEAN mapping of half a texel: within a tenth of the mean of f, which plain zeros miss by more than a half."""
    layout, texels = relief(SIZE)
    model = SPATIAL["ggx-mip"].build(sizes_of("ggx-mip", layout))
    zero = model.init(jax.random.key(0))
    count = 2048
    key = jax.random.split(jax.random.key(3), 2)
    phi = 2 * jnp.pi * jax.random.uniform(key[0], (2, count))
    sin = jnp.sqrt(0.8 * jax.random.uniform(key[1], (2, count)))
    wi, wo = jnp.stack([sin * jnp.cos(phi), sin * jnp.sin(phi), jnp.sqrt(1 - sin * sin)], axis=-1)
    uv = jax.random.uniform(jax.random.key(4), (count, 2))
    query = Query(wi, wo, uv, jnp.tile(0.5 / SIZE * jnp.eye(2), (count, 1, 1)))
    want = prefiltered(reciprocal_textured(layout).eval, samples=256)(jax.random.key(5), texels, query)

    def off(params: object) -> float:
        return float(jnp.mean(jnp.abs(model.eval(params, query) - want)) / jnp.mean(want))

    assert off(params_from_maps(zero, Pyramid(layout, texels))) < 0.2 < 0.5 < off(zero)


def test_maps_of_another_size_are_refused():
    layout, texels = relief(8)
    model = SPATIAL["ggx-mip"].build(sizes_of("ggx-mip", relief(16)[0]))
    with pytest.raises(ValueError, match="laid out"):
        params_from_maps(model.init(jax.random.key(0)), Pyramid(layout, texels))
