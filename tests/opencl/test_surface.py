"""Materials that vary over a surface: as JAX has them, at every width, with what each has and nothing else."""

from __future__ import annotations

from functools import cache

import jax
import numpy as np
import pytest

from jaxbrdf.checks.parity import demanding_queries, evaluated, jax_values, opencl_parity, placed
from jaxbrdf.export.bundle import Bundle, from_bytes, to_bytes
from jaxbrdf.opencl import Material
from jaxbrdf.opencl.shape import Shape
from jaxbrdf.types import Query
from tests.export.bundles import SURFACES, demanding_bundle
from tests.opencl.conftest import Device
from tests.opencl.kernels import SHAPES


@cache
def stored(variant: str) -> Bundle:
    return from_bytes(to_bytes(demanding_bundle(variant)), variant)


@cache
def queries(variant: str) -> Query:
    directions = demanding_queries(jax.random.key(1), count=512)
    return placed(jax.random.key(2), directions, stored(variant).manifest.config.latents.layout)


@cache
def expected(variant: str) -> np.ndarray:
    return jax_values(stored(variant), queries(variant))


@pytest.mark.parametrize("variant", SURFACES)
def test_opencl_gives_what_jax_gives(opencl: Device, variant: str):
    worst = opencl_parity(stored(variant), opencl.device, queries(variant), expected(variant))
    assert worst.violation <= 1.0, worst
