"""A bundle's sampler on devices: densities against JAX in float64, draws against densities."""

from __future__ import annotations

from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
import pyopencl as cl
import pytest

from jaxbrdf.checks.chi_square import chi_square_of_draws, expected_mass, significance_of_each
from jaxbrdf.checks.parity import demanding_queries
from jaxbrdf.checks.partition import partition_around
from jaxbrdf.core.directions import spherical
from jaxbrdf.export.bundle import Bundle, from_bytes, material, to_bytes
from jaxbrdf.export.parts import Parts
from jaxbrdf.opencl import Material, Sampler
from jaxbrdf.opencl.program import build
from jaxbrdf.opencl.sampler import proxy_nodes, sampler_source
from jaxbrdf.opencl.shape import Shape
from jaxbrdf.sampling.view_proxy import VISIBLE_VIEW_PROXY, ViewProxy
from jaxbrdf.types import Query
from tests.export.bundles import demanding_bundle
from tests.opencl.conftest import DEVICES, Device
from tests.opencl.kernels import SHAPES


@cache
def with_sampler(azimuths: int) -> Bundle:
    """Lobes of roughness from 1e-3 to 0.5, leaning either way, as nodes of a fit are: neighbours are alike."""
    nodes = np.random.default_rng(azimuths).normal(0.0, 0.5, (azimuths, 6, 9)).astype(np.float32)
    nodes[..., 4:6] += np.linspace(-1.0, 2.0, 6, dtype=np.float32)[:, None]
    bundle = demanding_bundle("gated isotropic" if azimuths == 1 else "gated general")
    return from_bytes(to_bytes(bundle._replace(parts=Parts(sampler=ViewProxy(nodes)))), "sampler")


@cache
def queries() -> Query:
    return demanding_queries(jax.random.key(1), count=2048)


@cache
def densities(azimuths: int) -> np.ndarray:
    sampler = with_sampler(azimuths).parts.sampler
    assert sampler is not None
    with jax.enable_x64(True):
        nodes = jnp.asarray(np.asarray(sampler.nodes, np.float64))
        wi, wo = (jnp.asarray(np.asarray(w, np.float64)) for w in (queries().wi, queries().wo))
        return np.asarray(jax.jit(VISIBLE_VIEW_PROXY.pdf)(ViewProxy(nodes), wi, wo))


@pytest.mark.parametrize("azimuths", [1, 5])
@pytest.mark.parametrize("shape", SHAPES)
def test_densities_are_those_of_jax(opencl: Device, shape: Shape, azimuths: int):
    found = Sampler.load(with_sampler(azimuths), opencl.context, shape=shape).pdf(queries().wi, queries().wo)
    np.testing.assert_allclose(found, densities(azimuths), rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("azimuths", [1, 5])
@pytest.mark.parametrize("theta", [0.0, 0.7, 1.5])
def test_draws_have_their_density(opencl: Device, theta: float, azimuths: int):
    bundle, wo = with_sampler(azimuths), spherical(jnp.array(theta), jnp.array(2.5))
    u = np.random.default_rng(3).uniform(size=(200_000, 3)).astype(np.float32)
    drawn = Sampler.load(bundle, opencl.context).sample(np.broadcast_to(wo, u.shape), u)
    np.testing.assert_allclose(np.linalg.norm(drawn.wi, axis=-1), 1.0, atol=2e-6)
    made = material(bundle)
    wi = drawn.wi.astype(float)
    partition = partition_around(wi, wo)
    mass = expected_mass(made.brdf, made.params, wo, partition=partition, points=48)
    found = chi_square_of_draws(wi, mass, partition=partition)
    assert found.p_value > significance_of_each(0.01, 6 * len(DEVICES))


def test_a_draws_density_is_that_of_the_pair(opencl: Device):
    sampler = Sampler.load(with_sampler(1), opencl.context)
    rng = np.random.default_rng(5)
    u, wo = rng.uniform(size=(2, 77, 3)).astype(np.float32)
    wo /= np.linalg.norm(wo, axis=-1, keepdims=True)
    drawn = sampler.sample(wo.reshape(7, 11, 3), u.reshape(7, 11, 3))
    assert drawn.wi.shape == (7, 11, 3)
    found = sampler.pdf(drawn.wi.reshape(-1, 3), wo)
    # a direction is rounded to 1e-7, a fraction of the narrowest lobe's 1e-3
    np.testing.assert_allclose(found, drawn.pdf.ravel(), rtol=5e-3)
    assert ((drawn.wi[..., 2] > 0) == (drawn.pdf > 0)).all()


def test_planar_arrays_on_the_device_give_the_same(opencl: Device):
    sampler = Sampler.load(with_sampler(5), opencl.context)
    u, wo = np.random.default_rng(6).uniform(0.1, 0.9, size=(2, 37, 3)).astype(np.float32)
    wo /= np.linalg.norm(wo, axis=-1, keepdims=True)
    expected = sampler.sample(wo, u)
    flags = cl.mem_flags
    given = [cl.Buffer(opencl.context, flags.COPY_HOST_PTR, hostbuf=np.ascontiguousarray(w.T)) for w in (wo, u)]
    wi, pdf, again = (cl.Buffer(opencl.context, flags.READ_WRITE, 4 * 37 * n) for n in (3, 1, 1))
    drawn = sampler.enqueue_sample(opencl.queue, *given, wi, pdf, 37)
    done = sampler.enqueue_pdf(opencl.queue, wi, given[0], again, 37, wait_for=[drawn])
    found, density, repeated = np.empty((3, 37), np.float32), np.empty(37, np.float32), np.empty(37, np.float32)
    for array, buffer in ((found, wi), (density, pdf), (repeated, again)):
        cl.enqueue_copy(opencl.queue, array, buffer, wait_for=[done])
    np.testing.assert_array_equal(found.T, expected.wi)
    np.testing.assert_array_equal(density, expected.pdf)
    np.testing.assert_allclose(repeated, density, rtol=5e-3)


def test_the_function_for_other_kernels_stands_behind_the_materials(opencl: Device):
    bundle = with_sampler(1)
    text = Material.load(bundle, opencl.context).source("gold") + sampler_source(bundle, entry="gold")
    text += """__kernel void probe(__global const float *nodes, __global const float *own, __global float *out) {
        float pdf;
        const float3 wo = (float3)(0.6f, 0.0f, 0.8f);
        const float3 wi = gold_sample(wo, (float3)(0.7f, 0.3f, 0.6f), &pdf, nodes);
        out[0] = wi.x; out[1] = wi.y; out[2] = wi.z; out[3] = pdf; out[4] = gold_pdf(wi, wo, nodes);
        out[5] = gold_eval(wi, wo, own).x;
    }"""
    kernel = cl.Kernel(build(opencl.context, text), "probe")
    flags, out = cl.mem_flags, np.empty(6, np.float32)
    numbers = (proxy_nodes(bundle), Material.load(bundle, opencl.context).inline_parameters())
    buffers = [cl.Buffer(opencl.context, flags.COPY_HOST_PTR, hostbuf=array) for array in numbers]
    result = cl.Buffer(opencl.context, flags.WRITE_ONLY, out.nbytes)
    kernel(opencl.queue, (1,), None, *buffers, result)
    cl.enqueue_copy(opencl.queue, out, result)
    wo = np.array([0.6, 0.0, 0.8], np.float32)
    expected = Sampler.load(bundle, opencl.context).sample(wo, np.array([0.7, 0.3, 0.6], np.float32))
    np.testing.assert_allclose(out[:3], expected.wi, atol=2e-6)
    np.testing.assert_allclose(out[3:5], expected.pdf, rtol=5e-3)
    np.testing.assert_allclose(out[5], Material.load(bundle, opencl.context).evaluate(out[:3], wo)[0], rtol=1e-4)


def test_bad_input_is_named(opencl: Device):
    with pytest.raises(ValueError, match="light blue has no sampler"):
        Sampler.load(demanding_bundle("gated isotropic"), opencl.context)
    sampler = Sampler.load(with_sampler(1), opencl.context)
    with pytest.raises(ValueError, match=r"wo \(3,\) and u \(2,\)"):
        sampler.sample(np.zeros(3), np.zeros(2))
    with pytest.raises(ValueError, match="not an identifier"):
        sampler_source(with_sampler(1), entry="a b")
    assert sampler.pdf(np.zeros((0, 3)), np.zeros((0, 3))).shape == (0,)
    assert np.isnan(sampler.pdf(np.array([np.nan, 0.0, 1.0]), np.array([0.0, 0.0, 1.0])))
