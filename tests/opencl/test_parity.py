from __future__ import annotations

from functools import cache

import jax
import numpy as np
import pytest

from jaxbrdf.brdf.energy_scale import TERMS, EnergyScale
from jaxbrdf.checks.hard import hard_queries
from jaxbrdf.checks.parity import ABSOLUTE, RELATIVE, demanding_queries, jax_values, opencl_parity, random_params
from jaxbrdf.export.bundle import Bundle, from_bytes, to_bytes
from jaxbrdf.export.parts import Parts
from jaxbrdf.models.nbrdf import NbrdfConfig, nbrdf
from jaxbrdf.opencl import Material, material, tuning
from jaxbrdf.opencl.shape import Shape
from jaxbrdf.types import Query
from tests.export.bundles import VARIANTS, bundle_of, demanding_bundle
from tests.opencl.conftest import Device
from tests.opencl.kernels import SHAPES


@cache
def stored(variant: str) -> Bundle:
    return from_bytes(to_bytes(demanding_bundle(variant)), variant)


@cache
def queries() -> Query:
    return demanding_queries(jax.random.key(1), count=4096)


def few_queries() -> Query:
    return Query(queries().wi[::64], queries().wo[::64])


@cache
def expected(variant: str) -> np.ndarray:
    return jax_values(stored(variant), queries())


@pytest.mark.parametrize("variant", VARIANTS)
def test_opencl_gives_what_jax_gives(opencl: Device, variant: str):
    worst = opencl_parity(stored(variant), opencl.device, queries(), expected(variant))
    assert worst.violation <= 1.0, worst


@pytest.mark.parametrize("variant", VARIANTS)
def test_the_parameters_are_demanding(variant: str):
    f = expected(variant)
    assert f[f > 0].min() < 2e-3
    assert f.max() > 5e2


def test_half_precision_is_what_the_file_says(opencl: Device):
    bundle = from_bytes(to_bytes(stored("tripleplane odd sizes"), precision="float16"), "half")
    rounded = expected_of_half()
    assert opencl_parity(bundle, opencl.device, queries(), rounded).violation <= 1.0
    assert not np.allclose(rounded, expected("tripleplane odd sizes"), rtol=1e-4)


@cache
def expected_of_half() -> np.ndarray:
    return jax_values(from_bytes(to_bytes(stored("tripleplane odd sizes"), precision="float16"), "half"), queries())


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_every_width_gives_what_jax_gives(opencl: Device, shape: Shape):
    variant = "gated horizon"
    assert opencl_parity(stored(variant), opencl.device, queries(), expected(variant), shape=shape).violation <= 1.0


@pytest.mark.parametrize("variant", ["gated horizon", "tripleplane isotropic", "nbrdf general"])
def test_the_path_of_a_gpu_gives_the_same(opencl: Device, monkeypatch: pytest.MonkeyPatch, variant: str):
    # one query a work item, weights in local memory, loops unrolled, arrays copied
    for module in (material, tuning):
        monkeypatch.setattr(module, "is_gpu", lambda _: True)
    loaded = Material.load(stored(variant), opencl.context)
    assert loaded.shape == tuning.GPU_SHAPE
    assert "#define JB_WEIGHTS __local" in material.kernel_source(
        stored(variant), "float32", loaded.shape, opencl.device
    )
    found = loaded.evaluate(np.asarray(few_queries().wi), np.asarray(few_queries().wo))
    wanted = expected(variant)[::64]
    assert (np.abs(found - wanted) <= RELATIVE * wanted + ABSOLUTE).all()


def test_a_network_far_wider_than_registers(opencl: Device):
    config = NbrdfConfig(hidden=(400, 400))
    bundle = bundle_of("nbrdf", config, random_params(1, nbrdf(config)))
    assert opencl_parity(bundle, opencl.device, few_queries(), jax_values(bundle, few_queries())).violation <= 1.0


@pytest.mark.parametrize("variant", ["gated isotropic", "naive-mlp general"])
def test_nothing_is_reflected_below_the_horizon(opencl: Device, variant: str):
    query = hard_queries()
    wi, wo = np.asarray(query.wi), np.asarray(query.wo)
    f = Material.load(stored(variant), opencl.context).evaluate(wi, wo)
    lit = (wi[:, 2] > 0) & (wo[:, 2] > 0)
    assert (f[~lit] == 0).all()
    assert (f[lit] > 0).all()
    assert np.isfinite(f).all()


def test_an_energy_scale_is_applied_and_costs_nothing_where_it_is_not(opencl: Device):
    weights = np.random.default_rng(2).normal(0.0, 1.0, (TERMS, 3)).astype(np.float32)
    plain = stored("gated isotropic")
    bundle = plain._replace(parts=Parts(scale=EnergyScale(weights)))
    few = few_queries()
    assert opencl_parity(bundle, opencl.device, few, jax_values(bundle, few)).violation <= 1.0
    macro = "define JB_SCALE "
    assert macro in Material.load(bundle, opencl.context).source()
    assert macro not in Material.load(plain, opencl.context).source()
