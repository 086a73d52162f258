"""Kernels of analytic models against JAX in float64, and the numbers that the host prepares for them."""

from __future__ import annotations

from functools import cache

import jax
import numpy as np
import pytest

from jaxbrdf.checks.parity import demanding_queries, jax_values, opencl_parity
from jaxbrdf.export.bundle import Bundle, from_bytes, to_bytes
from jaxbrdf.models.table import ANALYTIC, first_params
from jaxbrdf.opencl import Material
from jaxbrdf.types import Query
from tests.export.bundles import bundle_of
from tests.opencl.conftest import Device

VARIANTS = [(model, isotropic) for model in ANALYTIC for isotropic in (True, False)]


@cache
def stored(model: str, isotropic: bool) -> Bundle:
    config = ANALYTIC[model].config(isotropic=isotropic)
    params = jax.tree.map(np.asarray, first_params(jax.random.key(1), model, config))
    return from_bytes(to_bytes(bundle_of(model, config, params)), model)


@cache
def queries() -> Query:
    return demanding_queries(jax.random.key(1), count=2048)


@cache
def expected(model: str, isotropic: bool) -> np.ndarray:
    return jax_values(stored(model, isotropic), queries())


@pytest.mark.parametrize(("model", "isotropic"), VARIANTS)
def test_opencl_gives_what_jax_gives(opencl: Device, model: str, isotropic: bool):
    bundle = stored(model, isotropic)
    assert opencl_parity(bundle, opencl.device, queries(), expected(model, isotropic)).violation <= 1.0


def test_a_part_that_is_not_there_is_not_compiled(opencl: Device):
    bundle = stored("ggx", True)
    bare = bundle._replace(params=bundle.params._replace(albedo=None))
    source = Material.load(bundle, opencl.context).source()
    assert "#define JB_DIFFUSE" in source
    assert "#define JB_DIFFUSE" not in Material.load(bare, opencl.context).source()
