"""Pictures of the plane against closed forms: Lambert's law, waves under a Gaussian, and textures without detail."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.brdf.lambert import LAMBERT, LambertParams
from jaxbrdf.brdf.metallic_roughness import METALLIC_ROUGHNESS, MetallicRoughnessParams
from jaxbrdf.data.pbr import PbrTextures
from jaxbrdf.render.environment import make_environment
from jaxbrdf.render.film import CHUNK, all_pixels
from jaxbrdf.render.plane import PlaneView, camera_of, see
from jaxbrdf.render.plane_picture import plane_directional, plane_environment
from jaxbrdf.surface.textured import mip_mapped, surface_of
from jaxbrdf.types import Brdf, Material, Query

KEY = jax.random.key(0)
SIZE = 16
VIEW = PlaneView(2.0, 50.0, 35.0, height=SIZE, width=SIZE)
ALBEDO = np.array([0.8, 0.4, 0.1])
LAMBERTIAN = Material("paint", LAMBERT, LambertParams(jnp.asarray(ALBEDO, jnp.float32)), True)
WHITE = make_environment(np.ones((8, 16, 3)))
WAVE = np.array([2.0, 1.0])


def waves(_: None, query: Query) -> jax.Array:
    """Diffuse, of an albedo that is a wave, with the same phase in all channels."""
    assert query.footprint is None
    phase = 2.0 * jnp.pi * (query.uv[..., 0] * WAVE[0] + query.uv[..., 1] * WAVE[1])
    lit = (query.wi[..., 2] > 0) & (query.wo[..., 2] > 0)
    return jnp.where(lit, (0.5 + 0.5 * jnp.cos(phase)) / jnp.pi, 0.0)[..., None].repeat(3, axis=-1)


def filtered_waves(view: PlaneView) -> np.ndarray:
    """A Gaussian of covariance J J^T / 4 damps a wave k by exp(-2 pi^2 k J J^T k / 4)."""
    place = see(camera_of(view), jnp.arange(view.height * view.width), (view.height, view.width)).place
    along = WAVE @ np.asarray(place.footprint, float)
    damped = np.exp(-0.5 * np.pi**2 * np.sum(np.square(along), axis=-1))
    found = 0.5 + 0.5 * damped * np.cos(2 * np.pi * (np.asarray(place.uv, float) @ WAVE))
    return found.reshape(view.height, view.width)


def textures(base_color: np.ndarray, normal: tuple[float, float, float] = (0.0, 0.0, 1.0)) -> PbrTextures:
    shape = base_color.shape[:2]
    normals = np.broadcast_to(np.float32(normal) / np.float32(np.linalg.norm(normal)), (*shape, 3))
    rough, metal = (np.full(shape, number, np.float32) for number in (0.6, 0.0))
    return PbrTextures(base_color.astype(np.float32), rough, metal, normals, ())


def test_lambert_under_a_sun_is_the_cosine():
    direction = np.array([1.0, -2.0, 2.0])
    for view in (PlaneView(height=SIZE, width=SIZE), VIEW):
        picture = plane_directional(KEY, LAMBERTIAN, view, tuple(direction), irradiance=(np.pi, 1.0, 0.0))
        assert (picture.shape, picture.dtype) == ((SIZE, SIZE, 3), np.float32)
        want = ALBEDO * [1.0, 1.0 / np.pi, 0.0] * 2 / 3
        np.testing.assert_allclose(picture, np.broadcast_to(want, picture.shape), rtol=1e-5)
    assert not plane_directional(KEY, LAMBERTIAN, VIEW, (0.0, 1.0, -0.1)).any()


def test_lambert_under_an_even_sky_is_its_albedo_and_above_the_horizon_it_is_black():
    view = replace(VIEW, slant=80.0, field_of_view=60.0, width=2 * SIZE)
    picture = plane_environment(KEY, LAMBERTIAN, view, WHITE, samples=64, at_points=False)
    hit = np.asarray(see(camera_of(view), jnp.arange(2 * SIZE * SIZE), (SIZE, 2 * SIZE)).hit).reshape(SIZE, 2 * SIZE)
    assert 0 < hit.sum() < hit.size
    assert not picture[~hit].any()
    assert not plane_directional(KEY, LAMBERTIAN, view, (0.0, 0.0, 1.0))[~hit].any()
    np.testing.assert_allclose(picture[hit].mean(axis=0), ALBEDO, rtol=5e-3)


@pytest.mark.parametrize("slant", [0.0, 70.0])
def test_a_wave_is_damped_by_the_pixels_filter(slant: float):
    view = replace(VIEW, slant=slant, field_of_view=20.0)
    material = Material("waves", Brdf(waves), None, True)
    want = filtered_waves(view)
    assert want.min() < 0.45 < 0.55 < want.max()
    picture = plane_directional(KEY, material, view, (0.0, 0.0, 1.0), samples=1024)
    np.testing.assert_allclose(picture[..., 0], want, atol=4e-3)
    under_sky = plane_environment(KEY, material, view, WHITE, samples=256)[..., 0] - want
    assert abs(under_sky.mean()) < 4 * under_sky.std() / SIZE + 1e-4
    assert under_sky.std() < 0.05


def test_a_ramp_keeps_the_value_in_the_pixels_middle():
    ramp = Brdf(lambda _, query: jnp.stack([query.uv[..., 0], query.uv[..., 1], 1.0 + 0.0 * query.uv[..., 0]], -1))
    picture = plane_directional(KEY, Material("ramp", ramp, None, True), VIEW, (0.0, 0.0, 1.0), samples=256)
    uv = np.asarray(see(camera_of(VIEW), jnp.arange(SIZE * SIZE), (SIZE, SIZE)).place.uv).reshape(SIZE, SIZE, 2)
    np.testing.assert_allclose(picture[..., :2] / np.pi, uv, atol=2e-2)
    assert np.abs(picture[..., :2] / np.pi - uv).mean() < 2e-3


def test_a_texture_is_seen_upright():
    """Its four quarters are told apart, and a far checker is its mean."""
    quarters = np.zeros((8, 8, 3))
    quarters[:4, :4, 0] = quarters[:4, 4:, 1] = quarters[4:, :4, 2] = 1.0
    _, material = surface_of("quarters", textures(quarters))
    view = PlaneView(1.0, field_of_view=45.0, height=SIZE, width=SIZE)
    picture = plane_directional(KEY, material, view, (0.0, 0.0, 1.0), samples=16)
    for row, column, brightest in ((4, 4, 0), (4, 11, 1), (11, 4, 2)):
        assert picture[row, column, brightest] > 3 * np.delete(picture[row, column], brightest).max()
    checker = np.indices((8, 8)).sum(axis=0)[..., None] % 2 * np.ones(3)
    params = [surface_of("", textures(color))[1].params for color in (checker, np.full((8, 8, 3), 0.5))]
    far = replace(view, distance=40.0)
    pair = [plane_directional(KEY, material._replace(params=one), far, (0.0, 1.0, 1.0), samples=16) for one in params]
    np.testing.assert_allclose(pair[0].mean(axis=(0, 1)), pair[1].mean(axis=(0, 1)), rtol=0.02)
    assert pair[0].std() < 0.1 * pair[0].mean()


def test_a_texture_without_detail_is_the_material_alone():
    _, material = surface_of("plain", textures(np.broadcast_to(ALBEDO, (4, 4, 3))))
    numbers = (ALBEDO, 0.0, 0.6)
    params = MetallicRoughnessParams(*(jnp.asarray(one, jnp.float32) for one in numbers))
    alone = Material("alone", METALLIC_ROUGHNESS, params, True)
    light = (-0.3, 0.8, 0.6)
    want = plane_directional(KEY, alone, VIEW, light)
    assert want.std() > 1e-3
    np.testing.assert_allclose(plane_directional(KEY, material, VIEW, light, samples=4), want, rtol=1e-4)
    filtering = material._replace(brdf=mip_mapped(surface_of("", textures(np.ones((4, 4, 3))))[0]))
    np.testing.assert_allclose(plane_directional(KEY, filtering, VIEW, light), want, rtol=1e-4)


def test_the_sky_lights_what_leans_to_it():
    """Normals that lean up the texture face what lies beyond the plane, at the world's -z."""
    towards = {"up": (0.0, 1.0, 1.0), "down": (0.0, -1.0, 1.0), "right": (1.0, 0.0, 1.0), "left": (-1.0, 0.0, 1.0)}
    sky = np.zeros((32, 64, 3))
    # behind the middle of the picture's edge: u = 0 is -z; a quarter of the height is 45 degrees up
    sky[6:10, -3:] = sky[6:10, :3] = 1.0
    view = PlaneView(height=8, width=8)
    brdf = surface_of("", textures(np.ones((2, 2, 3))))[1].brdf
    means = {}
    for name, normal in towards.items():
        # one BRDF for all, which is compiled once
        material = surface_of(name, textures(np.ones((2, 2, 3)), normal))[1]._replace(brdf=brdf)
        means[name] = plane_environment(KEY, material, view, make_environment(sky), samples=32).mean()
    assert means["up"] > 1.2 * means["right"]
    assert means["right"] == pytest.approx(means["left"], rel=0.02)
    assert means["down"] < 0.2 * means["right"]


def test_the_same_key_gives_the_same_picture_and_another_does_not():
    material = Material("waves", Brdf(waves), None, True)
    one, same, other = (
        plane_directional(jax.random.key(k), material, VIEW, (0.0, 0.0, 1.0), samples=4) for k in (0, 0, 1)
    )
    np.testing.assert_array_equal(one, same)
    assert np.any(one != other)


@pytest.mark.parametrize(("height", "width"), [(1, 1), (3, 5), (96, 96), (200, 301)])
def test_every_pixel_is_in_a_chunk(height: int, width: int):
    pixels = all_pixels(height, width)
    assert pixels.shape[1] <= CHUNK
    np.testing.assert_array_equal(np.unique(pixels), np.arange(height * width))
    assert pixels.size < height * width + len(pixels)
