"""RGL materials against Mitsuba, which reads the same files."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import colour
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.brdf import rgl
from jaxbrdf.checks.chi_square import chi_square
from jaxbrdf.data.rgl import read
from jaxbrdf.types import Material, Query
from tests.brdf.mitsuba_measured import Reference, cosine_directions, measured
from tests.writers import rgl as writer

FILES = (
    "aurora_white",
    "cc_green_malachite",
    "cc_ibiza_sunset",
    "cc_iris_purple_gem",
    "cg_sunflower",
    "chm_light_blue",
    "chm_orange",
    "cm_military_green",
    "colodur_napoli_4f",
    "irid_flake_paint1_fine",
    "paper_white",
    "vch_golden_yellow",
)
PAIRS = 400


def load(path: Path) -> Material:
    return rgl.material(read(path.read_bytes(), path), path.stem)


def pairs(seed: int = 0, count: int = PAIRS) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    uniform = rng.random((count, 3), dtype=np.float32)
    return cosine_directions(rng, count), cosine_directions(rng, count), uniform


def relative(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    larger = np.maximum(np.abs(a), np.abs(b))
    return np.abs(a - b) / np.where(larger > 0, larger, 1.0)


def assert_agrees(material: Material, wi: np.ndarray, wo: np.ndarray, u: np.ndarray, reference: Reference) -> None:
    query = Query(jnp.asarray(wi), jnp.asarray(wo))
    value = np.asarray(jax.jit(material.brdf.eval)(material.params, query))
    error = relative(value, np.maximum(reference.value, 0.0) / wi[:, 2:])
    assert np.median(error) <= 1e-5
    assert np.quantile(error, 0.99) <= 1e-4
    density = np.asarray(jax.jit(material.brdf.pdf)(material.params, query))
    assert np.median(relative(density, reference.density)) <= 1e-5
    assert np.quantile(relative(density, reference.density), 0.99) <= 1e-4
    drawn = jax.jit(material.brdf.sample)(material.params, query, jnp.asarray(u))
    assert np.quantile(np.abs(np.asarray(drawn.wi) - reference.drawn), 0.99) <= 1e-4
    weight_error = relative(np.asarray(drawn.weight), np.maximum(reference.weight, 0.0))
    assert np.median(weight_error) <= 1e-4
    assert np.quantile(weight_error, 0.95) <= 1e-2


@pytest.mark.parametrize("name", FILES)
def test_real_file_agrees_with_mitsuba(name: str, data_dir: Path, mitsuba_rgb) -> None:
    path = data_dir / "rgl" / f"{name}_rgb.bsdf"
    wi, wo, u = pairs()
    assert_agrees(load(path), wi, wo, u, measured(mitsuba_rgb, path, wi, wo, u))


def test_anisotropic_file_agrees_with_mitsuba(tmp_path: Path, mitsuba_rgb) -> None:
    path = tmp_path / "made.bsdf"
    path.write_bytes(writer.tensor_file(writer.fields(azimuths=5, sectors=4)))
    material = load(path)
    assert not material.isotropic
    wi, wo, u = pairs()
    assert_agrees(material, wi, wo, u, measured(mitsuba_rgb, path, wi, wo, u))


@pytest.mark.parametrize("sectors", [2, 4])
def test_viewer_on_an_axis_is_the_limit_beside_it(sectors: int) -> None:
    # Where y is a signed zero Mitsuba jumps to the other end of the azimuths; here it is the limit from that side.
    material = rgl.material(read(writer.tensor_file(writer.fields(azimuths=5, sectors=sectors)), "made"), "made")
    on_axis = jnp.array([[0.6, 0.0, 0.8], [-0.6, 0.0, 0.8], [0.6, -0.0, 0.8], [-0.6, -0.0, 0.8]])
    beside = jnp.array([[0.6, 1e-6, 0.8], [-0.6, 1e-6, 0.8], [0.6, -1e-6, 0.8], [-0.6, -1e-6, 0.8]])
    wi = jnp.broadcast_to(jnp.array([0.1, 0.2, 0.97467943]), (4, 3))
    value, limit = (jax.jit(material.brdf.eval)(material.params, Query(wi, wo)) for wo in (on_axis, beside))
    np.testing.assert_allclose(value, limit, rtol=1e-4)


def test_file_without_jacobian_agrees_with_mitsuba(tmp_path: Path, mitsuba_rgb) -> None:
    path = tmp_path / "made.bsdf"
    fields = writer.fields() | {"jacobian": np.zeros(1, np.uint8)}
    path.write_bytes(writer.tensor_file(fields))
    wi, wo, u = pairs()
    material, reference = load(path), measured(mitsuba_rgb, path, wi, wo, u).value
    value = jax.jit(material.brdf.eval)(material.params, Query(jnp.asarray(wi), jnp.asarray(wo)))
    assert np.quantile(relative(np.asarray(value), np.maximum(reference, 0.0) / wi[:, 2:]), 0.99) <= 1e-4


@pytest.mark.parametrize(("azimuths", "sectors"), [(1, 1), (5, 1), (5, 2)])
def test_spectral_file_agrees_with_mitsuba_and_colour_science(azimuths, sectors, tmp_path, mitsuba_spectral) -> None:
    path = tmp_path / "made_spec.bsdf"
    nanometres = np.linspace(380.0, 760.0, 20)
    path.write_bytes(writer.tensor_file(writer.fields(azimuths=azimuths, sectors=sectors, wavelengths=nanometres)))
    material = load(path)
    wi, wo, u = pairs(count=40)
    groups = [measured(mitsuba_spectral, path, wi, wo, u, nanometres[i : i + 4].tolist()) for i in range(0, 20, 4)]
    spectra = np.concatenate([group.value for group in groups], axis=-1) / wi[:, 2:]
    expected = np.maximum([to_rgb(nanometres, spectrum) for spectrum in spectra], 0.0)
    value = jax.jit(material.brdf.eval)(material.params, Query(jnp.asarray(wi), jnp.asarray(wo)))
    np.testing.assert_allclose(value, expected, rtol=2e-3, atol=2e-3)


def to_rgb(nanometres: np.ndarray, spectrum: np.ndarray) -> np.ndarray:
    """colour-science's own integration, under D65, with the ends of the spectrum held."""
    fine = np.arange(360, 781)
    distribution = colour.SpectralDistribution(np.interp(fine, nanometres, spectrum), fine)
    shape = colour.SpectralShape(360, 780, 1)
    light = colour.SDS_ILLUMINANTS["D65"].copy().align(shape)
    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"].copy().align(shape)
    xyz = colour.sd_to_XYZ(distribution, observer, light, method="Integration") / 100.0
    return colour.RGB_COLOURSPACES["ITU-R BT.709"].matrix_XYZ_to_RGB @ xyz


@pytest.mark.parametrize("made", [False, True], ids=["isotropic", "anisotropic"])
def test_sampler_matches_its_density(made: bool, request) -> None:
    if made:
        content = writer.tensor_file(writer.fields(azimuths=5, sectors=4))
    else:
        content = (request.getfixturevalue("data_dir") / "rgl" / "cm_military_green_rgb.bsdf").read_bytes()
    material = rgl.material(read(content, "tested"), "tested")
    viewer = jnp.array([0.5, 0.3, 0.81240385])
    result = chi_square(jax.random.key(1), material.brdf, material.params, viewer, samples=60_000, cells=16, points=12)
    assert result.p_value > 1e-3


def test_density_of_a_drawn_direction_is_its_pdf(data_dir: Path) -> None:
    material = load(data_dir / "rgl" / "paper_white_rgb.bsdf")
    _, wo, u = (jnp.asarray(a) for a in pairs())
    drawn = jax.jit(material.brdf.sample)(material.params, Query(wo, wo), u)
    query = Query(drawn.wi, wo)
    value, density = (np.asarray(jax.jit(f)(material.params, query)) for f in (material.brdf.eval, material.brdf.pdf))
    lit = np.asarray(drawn.wi)[:, 2] > 1e-3
    assert np.quantile(relative(np.asarray(drawn.pdf)[lit], density[lit]), 0.99) < 1e-4
    expected = value[lit] * np.asarray(drawn.wi)[lit, 2:] / density[lit, None]
    assert np.median(relative(np.asarray(drawn.weight)[lit], expected)) < 1e-4
    assert np.all(np.asarray(drawn.pdf) >= 0)
    assert np.all(np.asarray(drawn.weight)[np.asarray(drawn.wi)[:, 2] <= 0] == 0)


def test_value_is_zero_below_the_horizon_and_never_negative(data_dir: Path) -> None:
    material = load(data_dir / "rgl" / "cc_iris_purple_gem_rgb.bsdf")
    wi, wo, _ = (jnp.asarray(a) for a in pairs())
    down = jnp.array([1.0, 1.0, -1.0])
    evaluate, density = jax.jit(material.brdf.eval), jax.jit(material.brdf.pdf)
    for query in (Query(wi * down[None], wo), Query(wi, wo * down[None]), Query(wi * down[None], wo * down[None])):
        assert not np.any(evaluate(material.params, query))
        assert not np.any(density(material.params, query))
    raw = jax.jit(partial(rgl.unclamped, rgl.Layout(True, 1, True)))(material.params, Query(wi, wo))
    assert np.any(np.asarray(raw) < 0)
    assert np.all(np.asarray(evaluate(material.params, Query(wi, wo))) >= 0)


@pytest.mark.parametrize("shape", [(), (0,), (2, 3, 4)])
def test_any_batch_shape(shape: tuple[int, ...], data_dir: Path) -> None:
    material = load(data_dir / "rgl" / "paper_white_rgb.bsdf")
    wi, wo, u = (jnp.broadcast_to(jnp.asarray(a[0]), (*shape, 3)) for a in pairs())
    query = Query(wi, wo)
    value = jax.eval_shape(material.brdf.eval, material.params, query)
    assert value.shape == (*shape, 3)
    assert value.dtype == jnp.float32
    assert jax.eval_shape(material.brdf.pdf, material.params, query).shape == shape
    drawn = jax.eval_shape(material.brdf.sample, material.params, query, u)
    assert (drawn.wi.shape, drawn.pdf.shape, drawn.weight.shape) == ((*shape, 3), shape, (*shape, 3))


def test_values_stay_finite_where_directions_degenerate(data_dir: Path) -> None:
    material = load(data_dir / "rgl" / "chm_orange_rgb.bsdf")
    up, graze = jnp.array([0.0, 0.0, 1.0]), jnp.array([1.0, 0.0, 1e-20])
    ends = jnp.stack([up, graze, graze * jnp.array([-1.0, 1.0, 1.0]), jnp.array([-1e-30, 0.0, 1.0])])
    wi, wo = jnp.tile(ends, (PAIRS // 4, 1)), jnp.tile(jnp.repeat(ends, 4, axis=0), (PAIRS // 16, 1))
    assert np.all(np.isfinite(jax.jit(material.brdf.pdf)(material.params, Query(wi, wo))))
    assert not np.any(np.isnan(jax.jit(material.brdf.eval)(material.params, Query(wi, wo))))


def test_isotropic_value_does_not_change_when_the_pair_turns(data_dir: Path) -> None:
    material = load(data_dir / "rgl" / "vch_golden_yellow_rgb.bsdf")
    wi, wo, _ = (jnp.asarray(a) for a in pairs())
    turn = jnp.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    evaluate = jax.jit(material.brdf.eval)
    value, turned = evaluate(material.params, Query(wi, wo)), evaluate(material.params, Query(wi @ turn, wo @ turn))
    assert np.quantile(relative(np.asarray(value), np.asarray(turned)), 0.99) < 1e-4
