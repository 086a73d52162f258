"""What the judging scene shows, by the footprints and directions of its pixels."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.brdf.lambert import LAMBERT, LambertParams
from jaxbrdf.render.planar_scene import PlanarScene, scene_footprints, scene_light, scene_pictures, scene_view
from jaxbrdf.render.plane import camera_of, see
from jaxbrdf.types import Material

SCENE = PlanarScene(1024, size=15)
MIDDLE = 15 * 7 + 7


def seen(scale: int, camera: int):
    return see(camera_of(scene_view(SCENE, scale, camera)), jnp.arange(15 * 15), (15, 15))


def test_scales_run_from_an_eighth_of_a_texel_to_two_textures():
    footprints = scene_footprints(SCENE)
    assert (len(footprints), footprints[0] * 1024, footprints[-1]) == (21, 0.125, 2.0)
    np.testing.assert_allclose(footprints[1:] / footprints[:-1], (2.0 * 8192) ** (1 / 20))


@pytest.mark.parametrize("scale", [0, 7, 20])
@pytest.mark.parametrize("camera", [0, 1, 2])
def test_the_pixel_in_the_middle_has_the_scales_footprint(scale: int, camera: int):
    """Across the slant; along it, longer by 1 / cos."""
    long, wide = np.linalg.svd(np.asarray(seen(scale, camera).place.footprint[MIDDLE]), compute_uv=False)
    wanted, slant = scene_footprints(SCENE)[scale], np.radians(SCENE.cameras[camera][0])
    assert wide == pytest.approx(wanted, rel=1e-4)
    assert long == pytest.approx(wanted / np.cos(slant), rel=1e-4)


@pytest.mark.parametrize("camera", [0, 1, 2])
def test_a_picture_has_one_direction_of_view(camera: int):
    found = seen(10, camera)
    assert np.asarray(found.hit).all()
    wo = np.asarray(found.place.wo, float)
    assert np.degrees(np.linalg.norm(wo - wo[MIDDLE], axis=-1)).max() < 5 / np.sqrt(2)
    slant = np.degrees(np.arccos(wo[MIDDLE, 2]))
    assert slant == pytest.approx(SCENE.cameras[camera][0], abs=0.05)


def test_the_second_light_is_the_mirror_image_of_the_second_camera():
    wo, wi = np.asarray(seen(0, 1).place.wo[MIDDLE]), np.array(scene_light(SCENE, 1, 1))
    np.testing.assert_allclose(wi, wo * [-1, -1, 1], atol=1e-5)
    lengths = [np.linalg.norm(scene_light(SCENE, c, n)) for _, c, n in np.ndindex(SCENE.shape)]
    np.testing.assert_allclose(lengths, 1.0)


def test_places_cover_the_texture():
    places = np.array([scene_view(SCENE, scale, camera).centre for scale, camera in np.ndindex(SCENE.shape[:2])])
    assert places.min() >= 0
    assert places.max() < 1
    counts, *_ = np.histogram2d(*places.T, bins=4, range=[[0, 1], [0, 1]])
    # 63 places in 16 cells
    assert counts.min() >= 2
    assert counts.max() <= 6


def test_pictures_stand_in_order():
    scene = PlanarScene(4, size=3, scales=2)
    white = Material("white", LAMBERT, LambertParams(jnp.ones(3)), True)
    pictures = scene_pictures(jax.random.key(0), white, scene)
    assert pictures.shape == (2, 3, 4, 3, 3, 3)
    cosines = np.cos(np.radians([theta for theta, _ in scene.lights]))
    want = np.broadcast_to(cosines[:, None, None, None], pictures.shape)
    np.testing.assert_allclose(pictures, want, rtol=1e-5)
