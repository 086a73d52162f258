"""Kernels of analytic models against JAX in float64, and the numbers that the host prepares for them."""

from __future__ import annotations

from functools import cache
from typing import Any

import jax
import numpy as np
import pytest

from jaxbrdf.checks.parity import demanding_queries, jax_values, opencl_parity
from jaxbrdf.export.bundle import Bundle, from_bytes, to_bytes
from jaxbrdf.models.abc import LogAbcParams
from jaxbrdf.models.principled import PrincipledConfig
from jaxbrdf.models.table import ANALYTIC, first_params
from jaxbrdf.opencl import Material
from jaxbrdf.opencl.shape import Shape
from jaxbrdf.types import Query
from tests.export.bundles import bundle_of
from tests.opencl.conftest import Device
from tests.opencl.kernels import SHAPES

BARE = PrincipledConfig(metallic=False, spec_tint=False, sheen=False, flatness=False, clearcoat=False)
FULL = PrincipledConfig(False, metallic=True, spec_tint=True, sheen=True, flatness=True, clearcoat=True)
VARIANTS: dict[str, tuple[str, Any]] = {
    f"{model} {'isotropic' if isotropic else 'general'}": (model, entry.config(isotropic=isotropic))
    for model, entry in ANALYTIC.items()
    for isotropic in ((True, False) if entry.has_axes else (True,))
} | {"principled bare": ("principled", BARE), "principled full": ("principled", FULL)}


@cache
def stored(variant: str) -> Bundle:
    model, config = VARIANTS[variant]
    params = jax.tree.map(np.asarray, first_params(jax.random.key(1), model, config))
    return from_bytes(to_bytes(bundle_of(model, config, params)), model)


@cache
def queries() -> Query:
    return demanding_queries(jax.random.key(1), count=2048)


@cache
def expected(variant: str) -> np.ndarray:
    return jax_values(stored(variant), queries())


@pytest.mark.parametrize("variant", VARIANTS)
def test_opencl_gives_what_jax_gives(opencl: Device, variant: str):
    assert opencl_parity(stored(variant), opencl.device, queries(), expected(variant)).violation <= 1.0


@pytest.mark.parametrize("shape", SHAPES, ids=str)
@pytest.mark.parametrize("variant", ["abc isotropic", "principled full"])
def test_every_width_gives_what_jax_gives(opencl: Device, variant: str, shape: Shape):
    assert opencl_parity(stored(variant), opencl.device, queries(), expected(variant), shape=shape).violation <= 1.0


@pytest.mark.parametrize(
    ("variant", "changes"),
    [
        ("abc isotropic", {"log_a": np.full(3, 11.0), "log_b": 17.0, "c": 10.0, "eta": 1e3}),
        ("principled full", {"roughness": 0.01, "anisotropic": 1.0, "clearcoat_gloss": 1.0}),
    ],
)
def test_the_sharpest_there_is(opencl: Device, variant: str, changes: dict[str, Any]):
    bundle = stored(variant)
    sharp = bundle.params._replace(**{name: np.float32(value) for name, value in changes.items()})
    bundle = bundle._replace(params=sharp)
    assert opencl_parity(bundle, opencl.device, queries(), jax_values(bundle, queries())).violation <= 1.0


def test_parameters_out_of_range_are_those_that_jax_takes(opencl: Device):
    bundle = stored("abc isotropic")
    params: LogAbcParams = bundle.params
    outside = bundle._replace(
        params=params._replace(diffuse=np.array([2.0, -1.0, 0.5], np.float32), eta=np.float32(0.5))
    )
    few = Query(queries().wi[::32], queries().wo[::32])
    assert opencl_parity(outside, opencl.device, few, jax_values(outside, few)).violation <= 1.0


@pytest.mark.parametrize(
    ("with_it", "without_it", "macros"),
    [
        ("ggx isotropic", "ggx-only isotropic", {"JB_DIFFUSE"}),
        ("principled full", "principled bare", {"JB_TINTED", "JB_SHEEN", "JB_FLATNESS", "JB_COAT"}),
    ],
)
def test_a_part_that_is_not_there_is_not_compiled(opencl: Device, with_it: str, without_it: str, macros: set[str]):
    def defined(variant: str) -> set[str]:
        source = Material.load(stored(variant), opencl.context).source()
        return {macro for macro in macros if f"#define {macro} " in source}

    assert defined(with_it) == macros
    assert defined(without_it) == set()
