"""Bundles of models over a surface."""

from __future__ import annotations

import json
from typing import Any

import jax
import numpy as np
import pytest
import safetensors.numpy

from jaxbrdf.checks.parity import demanding_queries, placed
from jaxbrdf.errors import DataError
from jaxbrdf.export.bundle import from_bytes, material, to_bytes
from jaxbrdf.models.table import SPATIAL_MODELS
from jaxbrdf.texture.angular import close_centre, is_texture
from tests.export.bundles import SURFACES, random_bundle, small_bundle

SMALL = "surface of odd sizes"


def manifest_of(content: bytes) -> dict[str, Any]:
    header = json.loads(content[8 : 8 + int.from_bytes(content[:8], "little")])
    return json.loads(header["__metadata__"]["jaxbrdf"])


def rewritten(content: bytes, manifest: dict[str, Any], tensors: dict[str, np.ndarray]) -> bytes:
    return safetensors.numpy.save(safetensors.numpy.load(content) | tensors, metadata={"jaxbrdf": json.dumps(manifest)})


def fault_of(content: bytes) -> str:
    with pytest.raises(DataError) as raised:
        from_bytes(content, "some.safetensors")
    assert "\n" not in str(raised.value)
    return raised.value.fault


@pytest.mark.parametrize("variant", SURFACES)
def test_a_file_gives_back_what_was_stored(variant: str):
    made = random_bundle(variant)
    back = from_bytes(to_bytes(made), "x")
    assert back.manifest == made.manifest
    assert not back.manifest.isotropic
    assert back.params.s.layout == made.manifest.config.latents.layout
    closed = jax.tree.map(lambda leaf: close_centre(leaf) if is_texture(leaf) else leaf, made.params)
    jax.tree.map(np.testing.assert_array_equal, back.params, closed)
    # a second trip changes nothing at all
    assert to_bytes(back) == to_bytes(made)


def test_a_file_gives_the_same_material():
    made = random_bundle("surface")
    query = placed(jax.random.key(1), demanding_queries(jax.random.key(0), count=64), made.params.s.layout)
    evaluate = jax.jit(SPATIAL_MODELS[made.manifest.model].build(made.manifest.config).eval)
    found = material(from_bytes(to_bytes(made), "x"))
    assert np.array_equal(jax.jit(found.brdf.eval)(found.params, query), evaluate(made.params, query))


def test_half_precision_rounds_latents_and_leaves_linear_maps():
    made = random_bundle(SMALL)
    whole, half = to_bytes(made), to_bytes(made, precision="float16")
    back = from_bytes(half, "x")
    np.testing.assert_array_equal(back.params.s.texels, made.params.s.texels.astype(np.float16).astype(np.float32))
    np.testing.assert_array_equal(back.params.frame, made.params.frame)
    np.testing.assert_array_equal(back.params.warps.weights, made.params.warps.weights)
    texels = made.params.s.texels.size + made.params.h.size + made.params.d.size
    assert len(whole) - len(half) == pytest.approx(2 * texels, abs=64)


def test_only_surfaces_need_the_newest_schema():
    surface, plain = (manifest_of(to_bytes(made)) for made in (random_bundle(SMALL), small_bundle()))
    assert (surface["schema"], plain["schema"]) == (3, 2)
    assert surface["config"]["latents"]["wrap"] == "clamp"
    assert "v down the rows" in surface["conventions"]["spatial texture"]
    assert "spatial texture" not in plain["conventions"]


def test_the_least_schema_is_what_a_surface_is_read_with():
    content = to_bytes(random_bundle(SMALL))
    assert fault_of(rewritten(content, manifest_of(content) | {"schema": 2}, {})) == (
        "schema 2 does not know model spatial-gated"
    )


@pytest.mark.parametrize(
    ("place", "value", "fault"),
    [
        ("wrap", "border", "config.latents.wrap is 'border', not one of repeat, clamp, mirror"),
        ("wrap", 1, "config.latents.wrap is 1, not one of repeat, clamp, mirror"),
        ("probes", 0, "config.latents.probes is 0, not a size from 1 to 1048576"),
        ("height", 14, "tensor s.texels is (100, 11), its config says (109, 11)"),
    ],
)
def test_a_tampered_size_is_named(place: str, value: Any, fault: str):
    content = to_bytes(random_bundle(SMALL))
    manifest = manifest_of(content)
    manifest["config"]["latents"][place] = value
    assert fault_of(rewritten(content, manifest, {})) == fault


def test_more_texels_than_anything_holds_are_refused():
    content = to_bytes(random_bundle(SMALL))
    manifest = manifest_of(content)
    manifest["config"]["latents"] |= {"height": 2**20, "width": 2**20}
    assert fault_of(rewritten(content, manifest, {})).endswith("numbers, 2147483648 are too many")
    manifest["config"]["warp_terms"] = -1
    assert fault_of(rewritten(content, manifest, {})).startswith("config.warp_terms is -1")


@pytest.mark.parametrize(
    ("name", "tensor", "fault"),
    [
        ("s.texels", np.zeros((99, 11), np.float32), "tensor s.texels is (99, 11), its config says (100, 11)"),
        ("s.texels", np.full((100, 11), np.nan, np.float16), "tensor s.texels is not finite"),
        ("s.texels", np.zeros((100, 11), np.int16), "tensor s.texels is I16, not F16 or F32"),
        ("frame", np.zeros((10, 6), np.float32), "tensor frame is (10, 6), its config says (11, 6)"),
        ("s", np.zeros(1, np.float32), "tensor 's' does not belong to model spatial-gated"),
    ],
)
def test_a_tampered_tensor_is_named(name: str, tensor: np.ndarray, fault: str):
    content = to_bytes(random_bundle(SMALL))
    assert fault_of(rewritten(content, manifest_of(content), {name: tensor})) == fault


def test_a_missing_tensor_is_named():
    content = to_bytes(random_bundle(SMALL))
    kept = {name: tensor for name, tensor in safetensors.numpy.load(content).items() if name != "s.texels"}
    metadata = {"jaxbrdf": json.dumps(manifest_of(content))}
    assert fault_of(safetensors.numpy.save(kept, metadata=metadata)) == "tensor s.texels is missing"


def test_latents_that_cannot_be_stored_are_refused():
    made = random_bundle(SMALL)
    texels = np.full_like(made.params.s.texels, 1e5)
    too_large = made._replace(params=made.params._replace(s=made.params.s._replace(texels=texels)))
    with pytest.raises(ValueError, match=r"s\.texels holds 1e\+05, beyond the range of float16"):
        to_bytes(too_large, precision="float16")
