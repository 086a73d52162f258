"""Renderings against closed forms, Mitsuba, and each other by different samplers."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import mitsuba as mi
import numpy as np
import pytest

from jaxbrdf.brdf.builtin import MATERIALS
from jaxbrdf.brdf.lambert import LAMBERT, LambertParams
from jaxbrdf.brdf.microfacet import SEPARABLE_MICROFACET, ggx
from jaxbrdf.render.camera import FILL, film_points
from jaxbrdf.render.environment import make_environment
from jaxbrdf.render.integrate import render_directional, render_environment
from jaxbrdf.render.proposal import with_sampler
from jaxbrdf.render.shading import to_local, to_world
from jaxbrdf.render.sphere import intersect
from jaxbrdf.render.studio import studio
from jaxbrdf.sampling.hemisphere import square_to_cosine
from jaxbrdf.types import Brdf, Material, Query, Sample

SIZE = 48
WHITE = Material("white", LAMBERT, LambertParams(jnp.ones(3)), True)
KEY = jax.random.key(0)


def normals() -> tuple[np.ndarray, np.ndarray]:
    """Normals at the pixels' centres `(SIZE, SIZE, 3)` and which pixels lie wholly inside the sphere."""
    y, x = (np.mgrid[:SIZE, :SIZE] + 0.5 - SIZE / 2) * 2 / (FILL * SIZE)
    squared = x**2 + y**2
    inside = np.sqrt(squared) < 1 - 2.5 / SIZE
    return np.stack([x, -y, np.sqrt(np.maximum(1 - squared, 0))], -1), inside


def cosine_only(params: LambertParams, query: Query, u: jax.Array) -> Sample:
    wi = square_to_cosine(u[..., 1:])
    f = MATERIALS["gold"]().brdf.eval(params, query._replace(wi=wi))
    return Sample(wi, LAMBERT.pdf(LambertParams(jnp.ones(3)), query._replace(wi=wi)), jnp.pi * f)


def cosine_pdf(_: LambertParams, query: Query) -> jax.Array:
    return LAMBERT.pdf(LambertParams(jnp.ones(3)), query)


def test_white_furnace():
    image = render_environment(KEY, WHITE, make_environment(np.ones((16, 32, 3))), height=SIZE, width=SIZE, samples=64)
    _, inside = normals()
    assert image.shape == (SIZE, SIZE, 3)
    assert image.dtype == np.float32
    assert abs(image[inside].mean() - 1) < 3e-3
    assert image[inside].std() < 0.1
    assert not image[0, 0].any()


def test_directional_light_is_the_cosine():
    direction = np.array([1.0, 2.0, 2.0]) / 3
    image = render_directional(WHITE, (1.0, 2.0, 2.0), irradiance=(np.pi, 1.0, 0.0), height=SIZE, width=SIZE)
    normal, inside = normals()
    cos = np.maximum(normal @ direction, 0)
    interior = inside & (cos > 0.1)
    np.testing.assert_allclose(image[interior][:, 0], cos[interior], atol=5e-3)
    np.testing.assert_allclose(image[interior][:, 1], cos[interior] / np.pi, atol=2e-3)
    assert not image[..., 2].any()


def test_an_image_need_not_be_square():
    image = render_directional(WHITE, (0.0, 0.0, 1.0), height=30, width=50)
    assert image.shape == (30, 50, 3)
    lit = image[..., 0] > 0
    assert (lit.any(0).sum(), lit.any(1).sum()) == (30, 30)
    np.testing.assert_allclose(image, image[:, ::-1], atol=1e-5)
    np.testing.assert_allclose(image, image[::-1], atol=1e-5)


def test_every_sampler_gives_the_same_picture():
    material = MATERIALS["gold"]()
    environment = make_environment(np.clip(studio(height=32), 0, 5))
    parts = {
        "own": material.brdf,
        "proposal": Brdf(material.brdf.eval),
        "cosine": Brdf(material.brdf.eval, cosine_only, cosine_pdf),
    }
    images = {}
    for seed, (name, brdf) in enumerate(parts.items()):
        made = render_environment(
            jax.random.key(seed), material._replace(brdf=brdf), environment, height=SIZE, width=SIZE, samples=64
        )
        images[name] = made.astype(float)
    for name in ("proposal", "cosine"):
        difference = (images[name] - images["own"]).mean(-1)
        lit = images["own"].any(-1)
        error = difference[lit].std() / np.sqrt(lit.sum())
        assert abs(difference[lit].mean()) < 4 * error, name
        assert error < 1e-2 * images["own"][lit].mean()


def test_the_same_key_gives_the_same_picture_and_another_does_not():
    environment = make_environment(studio(height=16))
    one, same, other = (
        render_environment(jax.random.key(k), WHITE, environment, height=16, width=16, samples=4) for k in (0, 0, 1)
    )
    np.testing.assert_array_equal(one, same)
    assert np.any(one != other)


def test_frames_are_orthonormal_right_handed_and_see_the_viewer():
    film = film_points(jnp.arange(SIZE * SIZE), jnp.full((SIZE * SIZE, 2), 0.5), SIZE, SIZE)
    film = jnp.concatenate([film, jnp.array([[0.0, 0.0], [0.0, 1.0], [0.0, -0.9999999], [1.0, 0.0]])])
    frame = np.asarray(intersect(film).frame, float)
    np.testing.assert_allclose(frame @ np.swapaxes(frame, -1, -2), np.broadcast_to(np.eye(3), frame.shape), atol=1e-6)
    np.testing.assert_allclose(np.linalg.det(frame), 1.0, atol=1e-6)
    w = jnp.broadcast_to(jnp.array([0.36, 0.48, 0.8]), (len(frame), 3))
    np.testing.assert_allclose(to_world(intersect(film).frame, to_local(intersect(film).frame, w)), w, atol=1e-6)


def test_a_material_with_a_sampler_keeps_it():
    assert with_sampler(LAMBERT) is LAMBERT
    assert with_sampler(Brdf(LAMBERT.eval)).sample is not None


@pytest.mark.parametrize("name", ["white", "gold"])
def test_pictures_match_mitsuba(mitsuba_rgb, name: str):
    """A sphere of radius one seen orthographically, under the same smooth environment."""
    y, x = np.mgrid[0:1:128j, 0 : 2 * np.pi : 257j][:, :, :-1]
    image = (1.5 + 0.8 * np.cos(np.pi * y) + 0.7 * np.sin(np.pi * y) * np.cos(x - 2.2))[..., None] * [1.0, 0.8, 0.6]
    image = np.asarray(image, np.float32)
    bsdf = {"type": "diffuse", "reflectance": {"type": "rgb", "value": [1.0, 1.0, 1.0]}}
    if name == "gold":
        index = MATERIALS["gold"]().params.fresnel
        eta, k = ({"type": "rgb", "value": np.asarray(v).tolist()} for v in index)
        bsdf = {"type": "roughconductor", "distribution": "ggx", "alpha": 0.05, "eta": eta, "k": k}
    look = mi.ScalarTransform4f().look_at(origin=[0, 0, 5], target=[0, 0, 0], up=[0, 1, 0])
    film = {"type": "hdrfilm", "width": 24, "height": 24, "rfilter": {"type": "box"}, "pixel_format": "rgb"}
    sensor = {
        "type": "orthographic",
        "to_world": look @ mi.ScalarTransform4f().scale([1 / FILL, 1 / FILL, 1]),
        "film": film,
        "sampler": {"type": "independent", "sample_count": 256},
    }
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "direct", "hide_emitters": True},
            "sensor": sensor,
            "ball": {"type": "sphere", "bsdf": bsdf},
            "light": {"type": "envmap", "bitmap": mi.Bitmap(image)},
        }
    )
    want = np.array(mi.render(scene, seed=1))
    shiny = ggx(jnp.array(0.05), jnp.array(0.05), MATERIALS["gold"]().params.fresnel)
    material = WHITE if name == "white" else Material("shiny", SEPARABLE_MICROFACET, shiny, True)
    got = render_environment(KEY, material, make_environment(image), height=24, width=24, samples=256)
    y, x = (np.mgrid[:24, :24] + 0.5 - 12) * 2 / (FILL * 24)
    inside = np.hypot(x, y) < 0.85
    relative = got[inside] / want[inside] - 1
    # measured: means equal to 2e-4, pixels scattered by 2 percent from 256 independent samples
    assert abs(relative.mean()) < 3e-3
    assert relative.std() < 0.03
