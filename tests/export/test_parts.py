"""What a bundle holds beside its model: stored and read, put together, and refused where it is not sound."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import safetensors.numpy

from jaxbrdf.brdf.albedo_table import AlbedoTable
from jaxbrdf.brdf.energy_scale import TERMS, EnergyScale, log2_loss
from jaxbrdf.errors import DataError
from jaxbrdf.export.bundle import Bundle, from_bytes, material, to_bytes
from jaxbrdf.export.parts import Parts
from jaxbrdf.sampling.hemisphere import square_to_cosine
from jaxbrdf.sampling.view_proxy import VISIBLE_VIEW_PROXY, ViewProxy
from jaxbrdf.types import Query
from tests.export.bundles import small_bundle


def filled() -> Parts:
    rng = np.random.default_rng(4)
    nodes, values = rng.normal(size=(1, 5, 9)), rng.uniform(size=(1, 7, 3))
    weights = rng.uniform(size=(TERMS, 3))
    return Parts(
        *(kind(np.float32(x)) for kind, x in ((EnergyScale, weights), (ViewProxy, nodes), (AlbedoTable, values)))
    )


def pairs() -> Query:
    return Query(*square_to_cosine(jax.random.uniform(jax.random.key(1), (2, 50, 2))))


def with_parts(**parts) -> Bundle:
    return small_bundle()._replace(parts=filled()._replace(**parts))


@pytest.mark.parametrize("precision", ["float32", "float16"])
def test_parts_come_back_in_full_precision(precision):
    back = from_bytes(to_bytes(with_parts(), precision=precision), "x").parts
    for found, expected in zip(jax.tree.leaves(back), jax.tree.leaves(filled()), strict=True):
        np.testing.assert_array_equal(found, expected)


def test_what_is_not_there_is_not_stored():
    back = from_bytes(to_bytes(with_parts(sampler=None, albedo=None)), "x").parts
    assert (back.sampler, back.albedo) == (None, None)
    assert from_bytes(to_bytes(small_bundle()), "x").parts == Parts()


def test_a_file_of_the_first_schema_is_read():
    content = to_bytes(small_bundle())
    header = int.from_bytes(content[:8], "little")
    text = content[8 : 8 + header].replace(b'\\"schema\\": 2', b'\\"schema\\": 1')
    assert text != content[8 : 8 + header]
    back = from_bytes(content[:8] + text + content[8 + header :], "x")
    np.testing.assert_array_equal(back.params.h, from_bytes(content, "x").params.h)


def test_a_material_has_the_parts_of_its_bundle():
    plain, whole, query = material(small_bundle()), material(with_parts()), pairs()
    loss = log2_loss(filled().scale, query.wi) + log2_loss(filled().scale, query.wo)
    expected = plain.brdf.eval(plain.params, query) * jnp.exp2(-loss)
    np.testing.assert_allclose(whole.brdf.eval(whole.params, query), expected, rtol=1e-5)
    density = VISIBLE_VIEW_PROXY.pdf(filled().sampler, query.wi, query.wo)
    np.testing.assert_allclose(whole.brdf.pdf(whole.params, query), density, rtol=1e-5)
    normal = Query(query.wi[0], jnp.array([0.0, 0.0, 1.0]))
    np.testing.assert_allclose(whole.brdf.albedo(whole.params, normal), filled().albedo.values[0, 0], rtol=1e-6)
    assert (plain.brdf.sample, plain.brdf.albedo) == (None, None)


@pytest.mark.parametrize(
    ("name", "array", "fault"),
    [
        ("scale.weights", np.zeros((5, 3)), r"tensor scale.weights is \(5, 3\), not \(14, 3\)"),
        ("scale.weights", np.full((TERMS, 3), np.nan), "tensor scale.weights is not finite"),
        ("sampler.nodes", np.zeros((1, 1, 9)), r"tensor sampler.nodes of shape \(1, 1, 9\) is too small"),
        ("sampler.nodes", np.zeros((1, 4, 8)), r"tensor sampler.nodes is \(1, 4, 8\), not \(azimuths, elevations, 9\)"),
        ("albedo.values", np.zeros((4, 3)), r"tensor albedo.values is \(4, 3\)"),
    ],
)
def test_parts_that_are_not_sound_are_named(tmp_path, name, array, fault):
    path = tmp_path / "a.safetensors"
    content = to_bytes(with_parts())
    tensors = safetensors.numpy.load(content) | {name: np.float32(array)}
    path.write_bytes(content)
    with safetensors.safe_open(path, "numpy") as opened:
        metadata = opened.metadata()
    with pytest.raises(DataError, match=fault):
        from_bytes(safetensors.numpy.save(tensors, metadata=metadata), path)
