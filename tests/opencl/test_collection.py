"""Several materials in a caller's own kernel."""

from __future__ import annotations

from functools import cache

import jax
import numpy as np
import pyopencl as cl
import pytest

from jaxbrdf.checks.parity import RELATIVE, demanding_queries, random_params
from jaxbrdf.export.bundle import Bundle, from_bytes, to_bytes
from jaxbrdf.models.table import MODELS
from jaxbrdf.opencl import Collection, Material
from jaxbrdf.opencl.program import build
from jaxbrdf.opencl.shape import Shape
from tests.export.bundles import VARIANTS, bundle_of
from tests.opencl.conftest import Device

MATERIALS = 25
COUNT = 2000

CHOOSING = """
__kernel void choose(__global const uint *index, __global const float *wi, __global const float *wo,
                     __global const float *parameters, __global float *f) {
    const size_t i = get_global_id(0);
    vstore3(material_eval(index[i], vload3(i, wi), vload3(i, wo), parameters), i, f);
}
"""


@cache
def bundles() -> tuple[Bundle, ...]:
    """Five variants of models, five materials of each."""
    names = list(VARIANTS)[:: len(VARIANTS) // 5][:5]
    made = []
    for seed in range(MATERIALS // 5):
        for name in names:
            model, config = VARIANTS[name]
            made.append(bundle_of(model, config, random_params(seed, MODELS[model].build(config))))
    return tuple(made)


@cache
def directions() -> tuple[np.ndarray, np.ndarray]:
    query = demanding_queries(jax.random.key(5), count=COUNT)
    return np.asarray(query.wi), np.asarray(query.wo)


def run(opencl: Device, source: str, name: str, arrays: list[np.ndarray], count: int) -> np.ndarray:
    flags = cl.mem_flags.READ_ONLY | cl.mem_flags.COPY_HOST_PTR
    buffers = [cl.Buffer(opencl.context, flags, hostbuf=np.ascontiguousarray(array)) for array in arrays]
    f = np.empty((count, 3), np.float32)
    output = cl.Buffer(opencl.context, cl.mem_flags.WRITE_ONLY, f.nbytes)
    kernel = cl.Kernel(build(opencl.context, source), name)
    kernel.set_args(*buffers, output)
    cl.enqueue_nd_range_kernel(opencl.queue, kernel, (count,), None)
    cl.enqueue_copy(opencl.queue, f, output)
    return f


def test_choosing_between_25_by_index_gives_each_ones_values(opencl: Device):
    collection = Collection.load(bundles())
    wi, wo = directions()
    index = np.arange(len(wi), dtype=np.uint32) % MATERIALS
    found = run(opencl, collection.source + CHOOSING, "choose", [index, wi, wo, collection.parameters], len(wi))
    for i, bundle in enumerate(bundles()):
        mine = index == i
        wanted = Material.load(bundle, opencl.context).evaluate(wi[mine], wo[mine])
        np.testing.assert_allclose(found[mine], wanted, rtol=0.5 * RELATIVE, atol=1e-7)


def test_materials_of_one_kind_are_compiled_once():
    source = Collection.load(bundles()).source
    assert source.count("#define JB_NAME(x) material_code_") == 5
    assert all(f"float3 material_{i}_eval(" in source for i in range(MATERIALS))


def test_entry_points_stand_side_by_side(opencl: Device):
    first, second = (Material.load(bundle, opencl.context) for bundle in bundles()[:2])
    kernel = """
    __kernel void both(__global const float *wi, __global const float *wo, __global const float *a,
                       __global const float *b, __global float *f) {
        const size_t i = get_global_id(0);
        const float3 light = vload3(i, wi), view = vload3(i, wo);
        vstore3(one_eval(light, view, a) + 2.0f * other_eval(light, view, b), i, f);
    }"""
    wi, wo = directions()
    arrays = [wi, wo, first.inline_parameters(), second.inline_parameters()]
    found = run(opencl, first.source("one") + second.source("other") + kernel, "both", arrays, len(wi))
    np.testing.assert_allclose(
        found, first.evaluate(wi, wo) + 2 * second.evaluate(wi, wo), rtol=0.5 * RELATIVE, atol=1e-7
    )


def test_materials_of_two_precisions_do_not_mix_in_one_text(opencl: Device):
    bundle = next(b for b in bundles() if b.manifest.model == "gated")
    half = from_bytes(to_bytes(bundle, precision="float16"), "half")
    full, stored = Material.load(bundle, opencl.context), Material.load(half, opencl.context)
    assert (full.precision, stored.precision) == ("float32", "float16")
    with pytest.raises(Exception, match="materials of one program must have one precision and one width"):
        build(opencl.context, full.source("one") + stored.source("other"))
    # a collection takes the wider of the two
    wi, wo = directions()
    collection = Collection.load([bundle, half])
    index = np.ones(len(wi), np.uint32)
    found = run(opencl, collection.source + CHOOSING, "choose", [index, wi, wo, collection.parameters], len(wi))
    np.testing.assert_allclose(found, stored.evaluate(wi, wo), rtol=0.5 * RELATIVE, atol=1e-7)


@pytest.mark.parametrize("entry", ["", "2nd", "a b", "x;y"])
def test_a_name_that_is_no_identifier_is_refused(opencl: Device, entry: str):
    with pytest.raises(ValueError, match="identifier"):
        Material.load(bundles()[0], opencl.context, shape=Shape(1, 8)).source(entry)
    with pytest.raises(ValueError, match="identifier"):
        Collection.load(bundles()[:1], prefix=entry)


def test_no_material_is_no_collection():
    with pytest.raises(ValueError, match="0 materials"):
        Collection.load([])
