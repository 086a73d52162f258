from __future__ import annotations

import json
import os
from pathlib import Path

import jax
import numpy as np
import pytest
import safetensors.numpy

from jaxbrdf.checks.parity import demanding_queries
from jaxbrdf.errors import DataError
from jaxbrdf.export.bundle import Bundle, from_bytes, load, material, save, to_bytes
from jaxbrdf.models.table import MODELS
from jaxbrdf.texture.angular import close_centre, is_texture
from tests.export.bundles import VARIANTS, random_bundle, small_bundle


def same(a: Bundle, b: Bundle) -> bool:
    assert jax.tree.structure(a.params) == jax.tree.structure(b.params)
    return all(np.array_equal(x, y) for x, y in zip(jax.tree.leaves(a.params), jax.tree.leaves(b.params), strict=True))


@pytest.mark.parametrize("variant", VARIANTS)
def test_a_file_gives_back_what_was_stored(variant: str):
    made = random_bundle(variant)
    back = from_bytes(to_bytes(made), "x")
    assert back.manifest == made.manifest
    closed = jax.tree.map(lambda leaf: close_centre(leaf) if is_texture(leaf) else leaf, made.params)
    assert same(back, made._replace(params=closed))
    # a second trip changes nothing at all
    assert to_bytes(back) == to_bytes(made)


@pytest.mark.parametrize("variant", ["naive-mlp general", "tripleplane isotropic"])
def test_a_file_gives_the_same_material(variant: str):
    made = random_bundle(variant)
    query = demanding_queries(jax.random.key(0), count=64)
    evaluate = jax.jit(MODELS[made.manifest.model].build(made.manifest.config).eval)
    found = material(from_bytes(to_bytes(made), "x"))
    assert np.array_equal(jax.jit(found.brdf.eval)(found.params, query), evaluate(made.params, query))
    assert found.isotropic == made.manifest.isotropic == variant.endswith("isotropic")
    assert found.name == "light blue"


def test_half_precision_rounds_textures_to_the_nearest_half_and_leaves_weights():
    made = small_bundle()
    whole, half = to_bytes(made), to_bytes(made, precision="float16")
    back = from_bytes(half, "x")
    assert back.params.d.dtype == np.float32
    rounded = made.params.d.astype(np.float16).astype(np.float32)
    np.testing.assert_array_equal(back.params.d[:, 1:], rounded[:, 1:])
    np.testing.assert_array_equal(back.params.mlp.weights[0], made.params.mlp.weights[0])
    texels = made.params.h.size + made.params.d.size
    assert len(whole) - len(half) == pytest.approx(2 * texels, abs=32)


def test_other_programs_read_the_file(tmp_path: Path):
    save(tmp_path / "a.safetensors", small_bundle())
    with safetensors.safe_open(tmp_path / "a.safetensors", "numpy") as file:
        manifest = json.loads(file.metadata()["jaxbrdf"])
        h = file.get_tensor("h")
    assert (manifest["schema"], manifest["model"], manifest["isotropic"]) == (2, "gated", False)
    assert manifest["config"]["textures"]["d_azimuths"] == 7
    assert h.shape == (2, 4, 5)
    assert (h[:, 0] == h[:, 0, :1]).all()


def test_saving_replaces_and_leaves_nothing_else(tmp_path: Path):
    path = tmp_path / "a.safetensors"
    path.write_bytes(b"old")
    save(path, small_bundle(), precision="float16")
    assert same(load(path), from_bytes(to_bytes(small_bundle(), precision="float16"), "x"))
    assert os.listdir(tmp_path) == ["a.safetensors"]


def test_what_cannot_be_stored_is_refused():
    made = small_bundle()
    with pytest.raises(ValueError, match=r"mlp\.biases\.0 is not finite"):
        to_bytes(made._replace(params=made.params._replace(mlp=with_bias(made, np.nan))))
    too_large = made._replace(params=made.params._replace(d=np.full_like(made.params.d, 1e5)))
    with pytest.raises(ValueError, match=r"d holds 1e\+05, beyond the range of float16"):
        to_bytes(too_large, precision="float16")
    assert from_bytes(to_bytes(too_large), "x").params.d[0, 0, 0] == np.float32(1e5)
    with pytest.raises(ValueError, match="the config of gated wants"):
        to_bytes(made._replace(params=made.params._replace(h=made.params.d)))


def with_bias(made: Bundle, value: float):
    mlp = made.params.mlp
    return mlp._replace(biases=(np.full_like(mlp.biases[0], value), *mlp.biases[1:]))


@pytest.mark.parametrize("what", ["absent", "folder", "empty"])
def test_what_is_no_file_is_told_in_one_line(tmp_path: Path, what: str):
    path = tmp_path / "a.safetensors"
    if what == "folder":
        path.mkdir()
    if what == "empty":
        path.touch()
    with pytest.raises(DataError) as raised:
        load(path)
    assert raised.value.path == str(path)
    assert "\n" not in str(raised.value)


def test_an_unwritable_path_is_told_in_one_line(tmp_path: Path):
    with pytest.raises(DataError, match="none/a"):
        save(tmp_path / "none" / "a.safetensors", small_bundle())
