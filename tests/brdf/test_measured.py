from __future__ import annotations

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.brdf import measured
from jaxbrdf.brdf.cosine_sampler import cosine_sampled
from jaxbrdf.data import merl, utia
from jaxbrdf.errors import DataError
from jaxbrdf.types import Brdf, Material, Query
from tests.writers import rgl as writer

UP = jnp.array([[0.0, 0.0, 1.0]])


def lopsided(params: jax.Array, query: Query) -> jax.Array:
    """1 + params for light that is higher than the viewer, 1 - params for light that is lower; zero where x > 0."""
    value = jnp.where(query.wi[..., 2] > query.wo[..., 2], 1.0 + params, 1.0 - params)
    return jnp.where((query.wi[..., 0] > 0)[..., None], 0.0, value[..., None]) * jnp.ones(3)[None]


def contents() -> dict[str, bytes]:
    rng = np.random.default_rng(0)
    return {
        "made.bsdf": writer.tensor_file(writer.fields()),
        "made.binary": merl.write(merl.Merl(rng.random((*merl.SHAPE, 3)), np.ones(merl.SHAPE, bool))),
        "made.bin": utia.write(utia.Utia(rng.random((*utia.SHAPE, 3)))),
    }


@pytest.mark.parametrize(("name", "isotropic"), [("made.bsdf", True), ("made.binary", True), ("made.bin", False)])
def test_load_tells_the_kinds_apart(name: str, isotropic: bool, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(contents()[name])
    material = measured.load(str(tmp_path / name))
    assert (material.name, material.isotropic) == ("made", isotropic)
    value = material.brdf.eval(material.params, Query(UP, UP))
    assert value.shape == (1, 3)
    assert np.all(np.isfinite(value))


def test_content_goes_before_suffix(tmp_path: Path) -> None:
    (tmp_path / "misnamed.bin").write_bytes(contents()["made.bsdf"])
    assert measured.load(tmp_path / "misnamed.bin").isotropic


@pytest.mark.parametrize("name", ["made.txt", "made", "made.binary", "made.bsdf", "made.bin", "made.h5"])
def test_other_content_is_refused_by_name(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(b"something else, longer than a header")
    with pytest.raises(DataError) as caught:
        measured.load(tmp_path / name)
    assert str(caught.value).startswith(str(tmp_path / name))


def test_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="no such file"):
        measured.load(tmp_path / "missing.bsdf")


def test_published_network_from_its_archive(data_dir: Path) -> None:
    material = measured.load(data_dir / "nbrdf" / "merl_nbrdf.zip" / "alum-bronze.h5")
    assert (material.name, material.isotropic) == ("alum-bronze", True)


def test_symmetrised_is_the_mean_of_both_orders_and_keeps_the_sampler() -> None:
    material = Material("lopsided", cosine_sampled(lopsided), jnp.array(0.25), False)
    even = measured.symmetrised(material)
    dark, lit, lower = jnp.array([[0.6, 0.0, 0.8]]), jnp.array([[-0.28, 0.0, 0.96]]), jnp.array([[-0.8, 0.0, 0.6]])
    np.testing.assert_allclose(even.brdf.eval(even.params, Query(lit, lower)), 1.0)
    np.testing.assert_allclose(even.brdf.eval(even.params, Query(lit, dark)), 0.5 * 1.25)
    np.testing.assert_allclose(even.brdf.eval(even.params, Query(dark, lit)), 0.5 * 1.25)
    u = jax.random.uniform(jax.random.key(0), (8, 3))
    viewer = jnp.broadcast_to(lit, (8, 3))
    drawn, before = (m.brdf.sample(m.params, Query(viewer, viewer), u) for m in (even, material))
    np.testing.assert_array_equal(drawn.wi, before.wi)
    np.testing.assert_array_equal(drawn.pdf, before.pdf)
    expected = even.brdf.eval(even.params, Query(drawn.wi, viewer)) * drawn.wi[:, 2:] / drawn.pdf[:, None]
    np.testing.assert_allclose(drawn.weight, expected, rtol=1e-5)


def test_symmetrised_material_without_a_sampler_has_none() -> None:
    bare = Material("bare", Brdf(lopsided), jnp.array(0.25), False)
    even = measured.symmetrised(bare).brdf
    assert even.sample is None
    assert even.pdf is None
    high, low = jnp.array([[-0.28, 0.0, 0.96]]), jnp.array([[-0.8, 0.0, 0.6]])
    np.testing.assert_allclose(even.eval(bare.params, Query(high, low)), 1.0)


def test_shares_of_a_material_whose_shares_are_known() -> None:
    material = Material("lopsided", cosine_sampled(lopsided), jnp.array(0.25), False)
    assert measured.clamped_share(material) == pytest.approx(0.5, abs=0.01)
    # both orders lit in a quarter of the pairs, one of them in half, none in a quarter
    assert measured.asymmetry(material) == pytest.approx(0.25 * 0.5 + 0.5 * 2.0, abs=0.02)
    assert measured.asymmetry(measured.symmetrised(material)) == 0.0


def test_shares_of_a_real_material(data_dir: Path) -> None:
    material = measured.load(data_dir / "rgl" / "cg_sunflower_rgb.bsdf")
    assert 0.30 < measured.clamped_share(material) < 0.35
    assert 0.03 < measured.asymmetry(material) < 0.05
