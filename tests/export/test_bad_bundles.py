from __future__ import annotations

import contextlib
import copy
import json
import struct
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import safetensors
import safetensors.numpy
from hypothesis import given
from hypothesis import strategies as st

from jaxbrdf.errors import DataError
from jaxbrdf.export.bundle import from_bytes, to_bytes
from tests.export.bundles import small_bundle

CONTENT = to_bytes(small_bundle())
TENSORS = safetensors.numpy.load(CONTENT)
HEADER_LENGTH = struct.unpack("<Q", CONTENT[:8])[0]
MANIFEST = json.loads(json.loads(CONTENT[8 : 8 + HEADER_LENGTH])["__metadata__"]["jaxbrdf"])


def fault_of(content: bytes) -> str:
    with pytest.raises(DataError) as raised:
        from_bytes(content, "some/bundle.safetensors")
    assert raised.value.path == "some/bundle.safetensors"
    assert "\n" not in str(raised.value)
    return raised.value.fault


def rewritten(manifest: Any = None, tensors: dict[str, np.ndarray] | None = None) -> bytes:
    text = manifest if isinstance(manifest, str) else json.dumps(MANIFEST if manifest is None else manifest)
    return safetensors.numpy.save(TENSORS if tensors is None else tensors, metadata={"jaxbrdf": text})


def changed(*path: str, value: Any) -> dict[str, Any]:
    manifest = copy.deepcopy(MANIFEST)
    place = manifest
    for name in path[:-1]:
        place = place[name]
    place[path[-1]] = value
    return manifest


def without(*path: str) -> dict[str, Any]:
    manifest = changed(*path, value=None)
    place = manifest
    for name in path[:-1]:
        place = place[name]
    del place[path[-1]]
    return manifest


def test_an_untouched_rewrite_is_read():
    assert from_bytes(rewritten(), "x").manifest == small_bundle().manifest


@pytest.mark.parametrize(
    ("manifest", "fault"),
    [
        (changed("schema", value=4), "schema 4 is newer than this jaxbrdf, which reads up to 3"),
        (changed("schema", value="1"), "schema is '1', not a version"),
        (changed("schema", value=True), "schema is True, not a version"),
        (without("schema"), "schema is None, not a version"),
        (changed("model", value="oracle"), "model 'oracle' is unknown"),
        (changed("model", value=["gated"]), "model ['gated'] is unknown"),
        (changed("model", value="tripleplane"), "config has an unknown entry"),
        (changed("conventions", "value", value="f cos"), "its conventions are not those of this jaxbrdf"),
        (without("conventions"), "its conventions are not those of this jaxbrdf"),
        (changed("isotropic", value=True), "isotropic is True, its config says False"),
        (without("config", "hidden"), "config.hidden is missing"),
        (changed("config", "wings", value=2), "config has an unknown entry 'wings'"),
        (changed("config", value=[]), "config is [], not a dict"),
        (changed("config", "hidden", value=[3.0]), "config.hidden[0] is 3.0, not a int"),
        (changed("config", "hidden", value=[0]), "config.hidden[0] is 0, not a size"),
        (changed("config", "hidden", value=[4] * 33), "config.hidden has 33 entries, at most 32"),
        (changed("config", "hidden", value=[2**31]), "config.hidden[0] is 2147483648, not a size"),
        (
            changed("config", "hidden", value=[2**20] * 32),
            "tensor mlp.weights.0 is (4, 3), its config says (4, 1048576)",
        ),
        (
            changed("config", "textures", "h_radii", value=2**20),
            "tensor h is (2, 4, 5), its config says (2, 1048576, 5)",
        ),
        (changed("config", "textures", "h_radii", value=True), "config.textures.h_radii is True, not a int"),
        (changed("config", "h_exponents", value=[]), "tensor 'warp_h.exponents' does not belong to model gated"),
        (changed("config", "h_exponents", value=[1, 1e999]), "config.h_exponents[1] is inf"),
        (changed("provenance", "seed", value="3"), "manifest.provenance.seed is '3', not a int"),
        (changed("errors", "mae", value=None), "manifest.errors.mae is None, not a float"),
        (changed("errors", "mae", value=float("nan")), "manifest.errors.mae is nan"),
        (changed("name", value=5), "manifest.name is 5, not a str"),
        ("[1]", "its manifest is not a JSON object"),
        ("{", "its manifest is not JSON"),
        ("[" * 200_000, "its manifest is not JSON"),
        ("1" * 5_000, "its manifest is not JSON"),
    ],
)
def test_a_tampered_manifest_is_named(manifest: Any, fault: str):
    assert fault_of(rewritten(manifest)).startswith(fault)


@pytest.mark.parametrize(
    ("name", "tensor", "fault"),
    [
        ("h", None, "tensor h is missing"),
        ("mlp.weights.7", np.zeros(3, np.float32), "tensor 'mlp.weights.7' does not belong to model gated"),
        ("d", np.zeros((2, 6, 8), np.float32), "tensor d is (2, 6, 8), its config says (2, 6, 7)"),
        ("d", np.zeros((2, 6, 7), np.float64), "tensor d is F64, not F16 or F32"),
        ("d", np.zeros((2, 6, 7), np.int32), "tensor d is I32, not F16 or F32"),
        ("d", np.full((2, 6, 7), np.nan, np.float32), "tensor d is not finite"),
        ("d", np.full((2, 6, 7), -np.inf, np.float16), "tensor d is not finite"),
    ],
)
def test_a_tampered_tensor_is_named(name: str, tensor: np.ndarray | None, fault: str):
    tensors = {k: v for k, v in (TENSORS | {name: tensor}).items() if v is not None}
    assert fault_of(rewritten(tensors=tensors)) == fault


def test_a_texture_too_small_to_interpolate_is_named():
    manifest = changed("config", "textures", "h_radii", value=1)
    assert "too small" in fault_of(rewritten(manifest, TENSORS | {"h": TENSORS["h"][:, :1]}))


def test_a_file_of_another_kind_is_named():
    plain = safetensors.numpy.save(TENSORS)
    assert fault_of(plain) == "a safetensors file without a jaxbrdf manifest"
    assert fault_of(b"\x89PNG\r\n\x1a\n" + bytes(100)).startswith("not a safetensors file")


@pytest.mark.parametrize("length", [0, 1, 2**31, 2**63 - 1, 2**64 - 1])
def test_an_absurd_header_length_is_refused(length: int):
    assert fault_of(struct.pack("<Q", length) + CONTENT[8:]).startswith("not a safetensors file")


def test_a_header_that_claims_more_than_the_file_holds_is_refused():
    header = CONTENT[8 : 8 + HEADER_LENGTH].replace(b"[2,6,7]", b"[2,6,7000000000]")
    assert fault_of(struct.pack("<Q", len(header)) + header + CONTENT[8 + HEADER_LENGTH :]).startswith("not a safe")


@given(st.integers(0, len(CONTENT) - 1), st.booleans())
def test_a_cut_or_padded_file_is_refused(length: int, padded: bool):
    fault_of(CONTENT + bytes(length + 1) if padded else CONTENT[:length])


@given(st.data())
def test_any_damage_gives_a_bundle_or_the_one_error(data: st.DataObject):
    draw: Callable[..., Any] = data.draw
    content = bytearray(CONTENT)
    # half of the damage goes where the structure is
    for _ in range(draw(st.integers(1, 4))):
        end = HEADER_LENGTH + 8 if draw(st.booleans()) else len(content)
        content[draw(st.integers(0, end - 1))] = draw(st.integers(0, 255))
    with contextlib.suppress(DataError):
        found = from_bytes(bytes(content), "x")
        assert all(np.isfinite(leaf).all() for leaf in found.params.mlp.weights)
