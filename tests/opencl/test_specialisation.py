"""What a material does not have is not in its program, and leaving it out changes no value where it is neutral."""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import numpy as np
import pyopencl as cl
import pytest

from jaxbrdf.checks.parity import RELATIVE, demanding_queries, jax_values, opencl_parity, random_params
from jaxbrdf.export.bundle import Bundle, Precision
from jaxbrdf.models.gated import GatedConfig, GatedParams, gated
from jaxbrdf.models.half_difference import TextureSizes
from jaxbrdf.models.warp import RadialWarp
from jaxbrdf.opencl import Material
from jaxbrdf.opencl.material import kernel_source
from jaxbrdf.opencl.platform import worth
from jaxbrdf.opencl.program import build
from jaxbrdf.opencl.shape import Shape
from tests.export.bundles import bundle_of
from tests.opencl.conftest import Device

SIZES = TextureSizes(False, 6, 7, 8, 9, 6)
FULL = GatedConfig(SIZES, (5, 6), (1.0,), (1.0,), horizon=True)
IDENTITY = RadialWarp(np.zeros(1, np.float32), np.log(np.expm1(np.full(1, 0.5, np.float32))))
SHAPE = Shape(8, 8)


class Effect(NamedTuple):
    """An effect in its neutral state, and the same material without it.

    Attributes:
        name: of the effect.
        macro: that stands in the program either with the effect or without it.
        present, absent: configurations.
    """

    name: str
    macro: str
    present: GatedConfig
    absent: GatedConfig


def without(**changes: Any) -> GatedConfig:
    return GatedConfig(**{**vars(FULL), **changes})


EFFECTS = (
    Effect("azimuth of wh", "define JB_ISOTROPIC", FULL, without(textures=TextureSizes(True, 6, 7, 8, 9, 6))),
    Effect("warp of H", "define JB_WARP_H ", FULL, without(h_exponents=())),
    Effect("warp of D", "define JB_WARP_D ", FULL, without(d_exponents=())),
    Effect("horizon", "define JB_HORIZON ", FULL, without(horizon=False)),
)


def neutral_params() -> GatedParams:
    """Values for `FULL` that half precision holds, with an H that has no azimuth, no warp, and an exponent of zero."""
    params = random_params(3, gated(FULL))
    h, d = (np.asarray(t, np.float16).astype(np.float32) for t in (params.h, params.d))
    h = np.repeat(h[:, :, :1], h.shape[2], axis=2)
    return params._replace(h=h, d=d, warp_h=IDENTITY, warp_d=IDENTITY, horizon=np.float32(0))


def bundle_for(config: GatedConfig) -> Bundle:
    """The neutral values, less what the configuration does not have."""
    params = neutral_params()
    h = params.h[:, :, :1] if config.textures.isotropic else params.h
    kept = {"warp_h": config.h_exponents, "warp_d": config.d_exponents, "horizon": config.horizon}
    dropped = {name: None for name, is_kept in kept.items() if not is_kept}
    return bundle_of("gated", config, params._replace(h=h, **dropped))


def binary_size(opencl: Device, bundle: Bundle, precision: Precision) -> int:
    """Bytes of the compiled program."""
    source = kernel_source(bundle, precision, SHAPE, opencl.device)
    program = build(opencl.context, source)
    return len(program.get_info(cl.program_info.BINARIES)[0])


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.name)
def test_an_absent_effect_is_absent_code(opencl: Device, effect: Effect):
    present, absent = bundle_for(effect.present), bundle_for(effect.absent)
    texts = [kernel_source(bundle, "float32", SHAPE, opencl.device) for bundle in (present, absent)]
    assert (effect.macro in texts[0]) != (effect.macro in texts[1])
    # Intel's compiler unrolls a shorter kernel further, so that its size says nothing
    if worth(opencl.device).pocl_version:
        assert binary_size(opencl, absent, "float32") < binary_size(opencl, present, "float32")


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.name)
def test_leaving_out_a_neutral_effect_changes_nothing(opencl: Device, effect: Effect):
    query = demanding_queries(jax.random.key(2), count=1024)
    wi, wo = np.asarray(query.wi), np.asarray(query.wo)
    values = [
        Material.load(bundle_for(config), opencl.context, precision="float32").evaluate(wi, wo)
        for config in (effect.present, effect.absent)
    ]
    # a neutral warp is r^1 through a logarithm: not to the last bit
    np.testing.assert_allclose(values[0], values[1], rtol=0.2 * RELATIVE)
    assert values[0].max() > 0


def test_half_precision_holds_what_it_can_and_halves_the_texels(opencl: Device):
    bundle = bundle_for(FULL)
    query = demanding_queries(jax.random.key(2), count=1024)
    wi, wo = np.asarray(query.wi), np.asarray(query.wo)
    half, full = (Material.load(bundle, opencl.context, precision=p) for p in ("float16", "float32"))
    np.testing.assert_allclose(half.evaluate(wi, wo), full.evaluate(wi, wo), rtol=1e-6)
    texels = 8 * (6 * 8 + 8 * 10)
    assert full.parameters.size - half.parameters.size == 2 * texels
    assert Material.load(bundle, opencl.context).precision == "float16"
    assert "vload_half8" not in kernel_source(bundle, "float32", SHAPE, opencl.device).split("#else")[0]


def test_texels_beyond_half_precision_are_refused(opencl: Device):
    bundle = bundle_for(FULL)
    bundle = bundle._replace(params=bundle.params._replace(d=bundle.params.d * np.float32(1e6)))
    assert Material.load(bundle, opencl.context).precision == "float32"
    with pytest.raises(ValueError, match="is beyond the range of float16: store it in float32"):
        Material.load(bundle, opencl.context, precision="float16")


class Framed(NamedTuple):
    """Parameters with a part of a model to come."""

    h: np.ndarray
    d: np.ndarray
    mlp: Any
    frames: np.ndarray


def test_a_part_that_the_kernel_does_not_know_is_refused(opencl: Device):
    bundle = bundle_for(FULL)
    params = bundle.params
    framed = bundle._replace(params=Framed(params.h, params.d, params.mlp, np.ones(3, np.float32)))
    with pytest.raises(ValueError, match="the kernel of model gated does not know frames"):
        Material.load(framed, opencl.context)
    unheard = bundle._replace(manifest=bundle.manifest._replace(model="nobody's"))
    with pytest.raises(ValueError, match="there is no kernel of model"):
        Material.load(unheard, opencl.context)


def test_clamps_are_left_out_only_where_no_query_needs_them(opencl: Device):
    bundle = bundle_for(FULL)
    saturated = bundle._replace(params=_with_saturated_units(bundle.params))
    assert "linear, bounded_silu)" in kernel_source(bundle, "float32", SHAPE, opencl.device)
    first = (
        kernel_source(saturated, "float32", SHAPE, opencl.device).split("JB_MLP_LAYERS(LAYER)")[1].split("LAYER(")[1]
    )
    assert "linear, silu)" in first
    query = demanding_queries(jax.random.key(2), count=1024)
    assert opencl_parity(saturated, opencl.device, query, jax_values(saturated, query)).violation <= 1.0


def _with_saturated_units(params: GatedParams) -> GatedParams:
    """The first layer's first unit stays beyond any exponential's range, its second below it."""
    weights, biases = list(params.mlp.weights), list(params.mlp.biases)
    biases[0] = np.array([150.0, -150.0, *biases[0][2:]], np.float32)
    weights[1] = np.concatenate([weights[1][:1] / 150, weights[1][1:]]).astype(np.float32)
    return params._replace(mlp=params.mlp._replace(weights=tuple(weights), biases=tuple(biases)))
