"""Materials that vary over a surface: as JAX has them, at every width, with what each has and nothing else."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pyopencl as cl
import pytest
from pyopencl.array import to_device, zeros

from jaxbrdf.brdf.energy_scale import TERMS, EnergyScale, scaled
from jaxbrdf.checks.parity import ABSOLUTE, RELATIVE, demanding_queries, evaluated, jax_values, placed
from jaxbrdf.export.bundle import Bundle, from_bytes, to_bytes
from jaxbrdf.export.parts import Parts
from jaxbrdf.opencl import Collection, Material, material, tuning
from jaxbrdf.opencl.material import kernel_source
from jaxbrdf.opencl.program import build
from jaxbrdf.opencl.shape import Shape
from jaxbrdf.texture.footprint import ellipse
from jaxbrdf.types import Query
from tests.export.bundles import SURFACES, demanding_bundle, small_bundle
from tests.opencl.conftest import Device
from tests.opencl.kernels import SHAPES

FLAGS = cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR
SHAPE = Shape(4, 8)

# An effect, the macro that stands for it, and the variant that lacks it.
ABSENT = {
    "frame": ("define JB_FRAME ", "surface without frame"),
    "warps": ("define JB_WARPS ", "surface without warps"),
    "gating": ("define JB_GATING ", "surface without gating"),
}


@cache
def stored(variant: str) -> Bundle:
    return from_bytes(to_bytes(demanding_bundle(variant)), variant)


@cache
def queries(variant: str) -> Query:
    directions = demanding_queries(jax.random.key(1), count=512)
    return placed(jax.random.key(2), directions, stored(variant).params.s.layout)


def few(variant: str) -> Query:
    return jax.tree.map(lambda part: part[::32], queries(variant))


@cache
def expected(variant: str) -> np.ndarray:
    return jax_values(stored(variant), queries(variant))


def at_points(query: Query) -> Query:
    return query._replace(footprint=None)


def excess(bundle: Bundle, query: Query, found: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """What the difference is of what is allowed.

    In float32 the ends of a footprint are uncertain by 1e-6 of its length, and over one texel of independent latents
    ln f changes by some 10: 1e-5 for each texel of its length.
    """
    texels = 0.0
    if query.footprint is not None:
        texels = np.asarray(ellipse(bundle.params.s.layout, query.footprint).major)[:, None]
    return np.abs(found - wanted) / (RELATIVE * (1.0 + 0.1 * texels) * wanted + ABSOLUTE)


@pytest.mark.parametrize("variant", SURFACES)
def test_opencl_gives_what_jax_gives(opencl: Device, variant: str):
    bundle, query, wanted = stored(variant), queries(variant), expected(variant)
    found = evaluated(Material.load(bundle, opencl.context, shape=SHAPE), query)
    worst = excess(bundle, query, found, wanted)
    # opposed directions about the frame's own normal: the azimuth of wh has no limit there
    assert (worst > 1.0).sum() <= 3
    assert worst.max() < 10.0
    lit = wanted > 0
    assert np.median(np.abs(found - wanted)[lit] / wanted[lit]) < 1e-5
    # parameters are demanding
    assert wanted.max() > 1e5 * wanted[lit].min()


@cache
def expected_at_points() -> np.ndarray:
    return jax_values(stored("surface"), at_points(queries("surface")))


def test_points_are_not_filtered(opencl: Device):
    bundle, query = stored("surface"), at_points(queries("surface"))
    loaded = Material.load(bundle, opencl.context, shape=SHAPE)
    found = evaluated(loaded, query)
    assert excess(bundle, query, found, expected_at_points()).max() <= 1.0
    assert not np.allclose(found, expected("surface"), rtol=0.1)
    nothing = jnp.zeros((len(query.wi), 2, 2))
    np.testing.assert_allclose(found, evaluated(loaded, query._replace(footprint=nothing)), rtol=RELATIVE)


@pytest.mark.parametrize("shape", [SHAPES[0], SHAPES[3]], ids=str)
def test_every_width_gives_what_jax_gives(opencl: Device, shape: Shape):
    # eleven channels: two blocks
    bundle, query = stored("surface of odd sizes"), few("surface of odd sizes")
    found = evaluated(Material.load(bundle, opencl.context, shape=shape), query)
    assert excess(bundle, query, found, expected("surface of odd sizes")[::32]).max() <= 1.0


def test_the_path_of_a_gpu_gives_the_same(opencl: Device, monkeypatch: pytest.MonkeyPatch):
    # one query a work item, weights in local memory, loops unrolled, arrays copied
    for module in (material, tuning):
        monkeypatch.setattr(module, "is_gpu", lambda _: True)
    bundle, query = stored("surface"), few("surface")
    found = evaluated(Material.load(bundle, opencl.context), query)
    assert excess(bundle, query, found, expected("surface")[::32]).max() <= 1.0


def test_half_texels_are_what_the_file_says(opencl: Device):
    bundle = from_bytes(to_bytes(stored("surface"), precision="float16"), "half")
    loaded, query = Material.load(bundle, opencl.context, shape=SHAPE), few("surface")
    assert loaded.precision == "float16"
    found = evaluated(loaded, query)
    whole = Material.load(bundle, opencl.context, precision="float32", shape=SHAPE)
    assert whole.parameters.size > 1.9 * loaded.parameters.size
    np.testing.assert_allclose(found, evaluated(whole, query), rtol=RELATIVE)
    assert not np.allclose(
        found, evaluated(Material.load(stored("surface"), opencl.context, shape=SHAPE), query), rtol=RELATIVE
    )


def test_an_energy_scale_is_applied(opencl: Device):
    weights: Any = np.random.default_rng(2).normal(0.0, 1.0, (TERMS, 3)).astype(np.float32)
    scale = EnergyScale(weights)
    bundle, query = stored("surface")._replace(parts=Parts(scale=scale)), few("surface")
    found = evaluated(Material.load(bundle, opencl.context, shape=SHAPE), query)
    factor = scaled(lambda _, query: jnp.ones_like(query.wi), lambda scale: (None, scale))(scale, query)
    assert excess(bundle, query, found, np.asarray(factor) * expected("surface")[::32]).max() <= 1.0


def test_a_place_that_is_no_number_stays_visible(opencl: Device):
    loaded = Material.load(stored("surface"), opencl.context, shape=SHAPE)
    up, uv, footprint = np.tile([0.0, 0.6, 0.8], (6, 1)), np.full((6, 2), 0.3), np.tile(0.01 * np.eye(2), (6, 1, 1))
    uv[0, 0], uv[1, 1], footprint[2, 0, 1], footprint[3, 1, 1] = np.nan, np.inf, np.nan, np.inf
    found = loaded.evaluate(up, up, uv=uv, footprint=footprint)
    # an infinite footprint is beyond the texture: its last level
    np.testing.assert_array_equal(np.isnan(found).all(axis=-1), [True, True, True, False, False, False])
    assert np.isfinite(found[3:]).all()


def planar(array: Any, rows: int) -> np.ndarray:
    return np.ascontiguousarray(np.asarray(array).reshape(-1, rows).T)


def test_arrays_of_the_device_give_what_evaluate_gives(opencl: Device):
    loaded, query = Material.load(stored("surface"), opencl.context, shape=SHAPE), few("surface")
    count = len(query.wi)
    arrays = [planar(part, rows) for part, rows in zip(query, (3, 3, 2, 4), strict=True)]
    wi, wo, uv, footprint = (cl.Buffer(opencl.context, FLAGS, hostbuf=array) for array in arrays)
    out = zeros(opencl.queue, (3, count), np.float32)
    loaded.enqueue(opencl.queue, wi, wo, out, uv=uv, footprint=footprint).wait()
    np.testing.assert_array_equal(out.get().T, evaluated(loaded, query))
    on_device = to_device(opencl.queue, arrays[2])
    loaded.enqueue(opencl.queue, wi, wo, out, uv=on_device).wait()
    np.testing.assert_array_equal(out.get().T, evaluated(loaded, at_points(query)))
    with pytest.raises(ValueError, match="but uv 2 n, footprint 4 n"):
        loaded.enqueue(opencl.queue, wi, wo, out, uv=footprint, footprint=uv)
    with pytest.raises(ValueError, match="out overlaps wo"):
        loaded.enqueue(opencl.queue, wi, wo, wo, uv=uv)
    rows = to_device(opencl.queue, np.ascontiguousarray(arrays[2].T))
    with pytest.raises(ValueError, match=r"not a contiguous \(2, n\): all u, all v"):
        loaded.enqueue(opencl.queue, wi, wo, out, uv=rows)
    with pytest.raises(ValueError, match="uv is None"):
        loaded.enqueue(opencl.queue, wi, wo, out)


def test_any_batch_shape_and_wrong_ones(opencl: Device):
    loaded, w = Material.load(stored("surface"), opencl.context, shape=SHAPE), np.tile([0.0, 0.6, 0.8], (5, 13, 1))
    uv = np.random.default_rng(0).uniform(size=(5, 13, 2))
    f = loaded.evaluate(w, w, uv=uv)
    np.testing.assert_array_equal(f[3, 7], loaded.evaluate(w[3, 7], w[3, 7], uv=uv[3, 7]))
    assert loaded.evaluate(w[:0], w[:0], uv=uv[:0]).shape == (0, 13, 3)
    with pytest.raises(ValueError, match=r"uv is \(5, 13\), not \(5, 13, 2\)"):
        loaded.evaluate(w, w, uv=uv[..., 0])
    with pytest.raises(ValueError, match=r"footprint is \(5, 13, 2\), not \(5, 13, 2, 2\)"):
        loaded.evaluate(w, w, uv=uv, footprint=uv)
    with pytest.raises(ValueError, match="uv is None; a material that varies over a surface"):
        loaded.evaluate(w, w)
    with pytest.raises(ValueError, match="this one is the same everywhere"):
        Material.load(small_bundle(), opencl.context).evaluate(w, w, uv=uv)


CALLER = """
__kernel void shade(__global const float *wi, __global const float *wo, __global const float *uv,
                    __global const float *footprint, __global const float *parameters, __global float *f) {
    const size_t i = get_global_id(0);
    vstore3(brick_eval(vload3(i, wi), vload3(i, wo), vload2(i, uv), vload4(i, footprint), parameters), i, f);
}
"""


def test_another_kernel_calls_it_inline(opencl: Device):
    loaded, query = Material.load(stored("surface"), opencl.context, shape=SHAPE), few("surface")
    program = build(opencl.context, loaded.source("brick") + CALLER)
    arrays = [np.ascontiguousarray(np.asarray(part), np.float32) for part in query]
    buffers = [cl.Buffer(opencl.context, FLAGS, hostbuf=array) for array in (*arrays, loaded.inline_parameters())]
    found = np.zeros_like(arrays[0])
    out = cl.Buffer(opencl.context, FLAGS, hostbuf=found)
    kernel = cl.Kernel(program, "shade")
    kernel.set_args(*buffers, out)
    cl.enqueue_nd_range_kernel(opencl.queue, kernel, (len(found),), None)
    cl.enqueue_copy(opencl.queue, found, out, is_blocking=True)
    assert excess(stored("surface"), query, found, expected("surface")[::32]).max() <= 1.0


@pytest.mark.parametrize("effect", ABSENT)
def test_an_absent_effect_is_absent_code(opencl: Device, effect: str):
    macro, variant = ABSENT[effect]
    texts = [kernel_source(stored(v), "float32", SHAPE, opencl.device) for v in ("surface", variant)]
    assert macro in texts[0]
    assert macro not in texts[1]


def test_points_have_no_probes_and_a_map_that_decodes_nothing_is_not_there(opencl: Device):
    bundle = demanding_bundle("surface without frame")
    config = replace(bundle.manifest.config, warp_terms=0)
    plain = bundle._replace(manifest=bundle.manifest._replace(config=config), params=bundle.params._replace(warps=None))
    text = kernel_source(plain, "float32", SHAPE, opencl.device)
    assert "define JB_DECODED " not in text
    # of the two kernels the second takes places for points
    filtered, points = text.split("#define JB_NAME(x) material_##x")[1].split("#define JB_NAME(x) points_##x")
    assert "define JB_PROBES" in filtered
    assert "define JB_PROBES" not in points


def test_a_collection_refuses_a_surface():
    with pytest.raises(ValueError, match="material 1 varies over a surface"):
        Collection.load([small_bundle(), stored("surface")])


def test_a_part_that_the_kernel_does_not_know_is_refused(opencl: Device):
    bundle = stored("surface")
    unknown = bundle._replace(manifest=bundle.manifest._replace(model="gated"))
    with pytest.raises(ValueError, match="the kernel of model gated does not know s"):
        Material.load(unknown, opencl.context)
