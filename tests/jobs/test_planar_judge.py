"""Judgements of textured materials: none of the truth, more of a blurred one, and free of the truth's noise."""

from __future__ import annotations

import json
from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.data.pbr import PbrTextures
from jaxbrdf.jobs import planar_judge as judge
from jaxbrdf.render.planar_scene import PlanarScene
from jaxbrdf.surface.textured import mip_mapped, surface_of
from jaxbrdf.texture.pyramid import Layout
from jaxbrdf.types import Brdf, Material, Query

SIZE = 16
SCENE = PlanarScene(SIZE, size=12, scales=3, cameras=((45.0, 25.0),))
KEY = jax.random.key(5)
WAVE = jnp.array([3.0, 1.0])


@cache
def surface() -> tuple[Layout, Material]:
    """One, for functions of another would be compiled anew."""
    rng = np.random.default_rng(0)
    color = np.float32(rng.uniform(0.05, 0.95, (SIZE, SIZE, 3)))
    rough, metal = (np.float32(rng.uniform(0.3, 0.9, (SIZE, SIZE))) for _ in range(2))
    normal = np.append(rng.uniform(-0.2, 0.2, (SIZE, SIZE, 2)), np.ones((SIZE, SIZE, 1)), axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return surface_of("noise", PbrTextures(color, rough, metal, np.float32(normal), ()))


@pytest.fixture(scope="module")
def materials() -> dict[str, Material]:
    """Filtered maps under the footprint, and under one that is eight times as large."""
    layout, material = surface()
    filtering = mip_mapped(layout, probes=4)

    def blurred(params: jax.Array, query: Query) -> jax.Array:
        return filtering.eval(params, query._replace(footprint=8.0 * query.footprint))

    parts = {"mip-mapped": filtering, "blurred": Brdf(blurred)}
    return {name: Material(name, brdf, material.params, False) for name, brdf in parts.items()}


@pytest.fixture(scope="module")
def reference() -> judge.PlanarReference:
    return judge.planar_reference(KEY, surface()[1], SCENE, samples=64, draws=2**12)


def wave(phase: jax.Array, damped: jax.Array | float) -> jax.Array:
    return (1.0 + damped * jnp.cos(2.0 * jnp.pi * phase))[..., None].repeat(3, axis=-1)


def wave_at_points(_: None, query: Query) -> jax.Array:
    return wave(phase_of(query), 1.0)


def phase_of(query: Query) -> jax.Array:
    return query.uv[..., 0] * WAVE[0] + query.uv[..., 1] * WAVE[1]


def wave_filtered(_: None, query: Query) -> jax.Array:
    """The closed form of `wave_at_points` under a Gaussian of covariance J J^T / 4."""
    along = [query.footprint[..., 0, i] * WAVE[0] + query.footprint[..., 1, i] * WAVE[1] for i in (0, 1)]
    return wave(phase_of(query), jnp.exp(-0.5 * jnp.pi**2 * (along[0] ** 2 + along[1] ** 2)))


def test_the_reference_has_no_error(reference: judge.PlanarReference):
    found = judge.errors_of(reference.halves.mean(0), reference.configurations.halves.mean(0), reference)
    for name in ("flip", "mae", "rmse"):
        np.testing.assert_array_equal(getattr(found, name), np.zeros(SCENE.shape))
    np.testing.assert_allclose(found.ssim, 1.0, atol=1e-6)
    assert found.mae_hdr.value == pytest.approx(0.0, abs=1e-6)
    assert found.rmse_hdr.value == 0.0


def test_a_blurred_material_is_worse(reference: judge.PlanarReference, materials: dict[str, Material]):
    report = judge.planar_report(materials, reference)
    sharp, blurred = report["materials"]["mip-mapped"], report["materials"]["blurred"]
    noise = report["noise"]
    assert noise["flip"][0] < sharp["flip"][0] < blurred["flip"][0]
    assert blurred["ssim"][0] < sharp["ssim"][0] < 1
    for name in ("rmse_hdr", "mae_hdr"):
        assert 0 < sharp[name] < blurred[name]
    # at the finest scale the means are the maps themselves
    assert sharp["per_scale"]["flip"][0][0] < 0.2 * blurred["per_scale"]["flip"][0][0]
    ratios = report["ratios"]["blurred / mip-mapped"]
    assert all(ratios[name][1] > 1 for name in ("flip", "mae", "rmse", "one_minus_ssim"))
    assert report["footprint_texels"] == pytest.approx([0.125, 2.0, 32.0])
    coarse = np.mean([mean for mean, *_ in sharp["per_scale"]["rmse"][1:]])
    assert sharp["from_two_texels"]["rmse"][0] == pytest.approx(coarse)
    assert json.loads(json.dumps(report, allow_nan=False)) == json.loads(json.dumps(report))


def test_judgements_repeat(reference: judge.PlanarReference, materials: dict[str, Material]):
    again = judge.planar_reference(KEY, surface()[1], SCENE, samples=64, draws=2**12)
    np.testing.assert_array_equal(again.halves, reference.halves)
    first, second = (judge.planar_errors(materials["blurred"], one) for one in (reference, again))
    for name in first._fields:
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name))


def test_the_references_noise_is_not_the_materials_error():
    """The closed form under footprints, judged by two samples a half: RMSE of f is zero within its error."""
    scene = PlanarScene(SIZE, size=11, scales=2, cameras=((60.0, 25.0),))
    noisy = judge.planar_reference(KEY, Material("", Brdf(wave_at_points), None, True), scene, samples=4, draws=2**14)
    exact = Material("", Brdf(wave_filtered), None, True)
    found = judge.planar_errors(exact, noisy)
    off = np.asarray(wave_filtered(None, noisy.configurations.query)) - noisy.configurations.halves.mean(0)
    assert np.sqrt(np.mean(np.square(off))) > 0.1
    halves = noisy.configurations.halves - np.asarray(wave_filtered(None, noisy.configurations.query))
    squares = np.prod(halves, axis=0).mean(-1)
    assert found.rmse_hdr.value**2 < 4.5 * squares.std() / np.sqrt(len(squares))
    # pictures say beside them what noise makes
    assert np.median(found.rmse / judge.noise_errors(noisy).rmse) == pytest.approx(1.0, rel=0.3)


def test_a_flat_picture_shows_what_is_too_bright():
    flat = np.full((12, 12, 3), [0.2, 0.02, 0.01])
    bright = judge.image_errors(1.5 * flat, flat, exposure=judge.exposure_of(flat))
    brighter = judge.image_errors(1.9 * flat, flat, exposure=judge.exposure_of(flat))
    assert 0.01 < bright.rmse < brighter.rmse
    assert judge.exposure_of(np.zeros((12, 12, 3))) == 1.0


@pytest.mark.parametrize("samples", [0, 1, 3])
def test_halves_are_equal(samples: int):
    with pytest.raises(ValueError, match=f"samples is {samples}"):
        judge.planar_reference(KEY, surface()[1], SCENE, samples=samples)
