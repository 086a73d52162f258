"""What holds for every model over a surface: sizes, reciprocity, and what is left out."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.models.spatial import encode
from jaxbrdf.models.spatial_gated import SpatialGatedParams, spatial_gated
from jaxbrdf.models.spatial_tripleplane import SpatialTripleplaneParams
from jaxbrdf.models.table import MODELS, SPATIAL
from jaxbrdf.models.zeltner import ZeltnerConfig, zeltner
from jaxbrdf.types import Model, Query
from tests.models.surfaces import COUNT, LATENTS, SMALL, TEXTURES, queries, random_params, small, swapped

RECIPROCAL = [name for name, entry in SPATIAL.items() if entry.is_reciprocal]
TEXELS = sum(4**n for n in range(11))


@pytest.mark.parametrize(
    ("name", "latents", "rest"),
    [
        # angular textures of 32 x 32 each, the decoder, the frame, the warps
        ("gated", 8 * TEXELS, 2 * 32 * 32 * 40 + 327 + 48 + 72),
        ("tripleplane", 8 * TEXELS, 2 * 32 * 32 * 8 + 995),
        ("zeltner", 8 * TEXELS, 1119 + 96),
        # two networks of 5.06 kB, and seven channels on one level
        ("neumip", 8 * TEXELS + 7 * 1024**2, 1264),
        ("ggx-mip", 12 * TEXELS, 0),
    ],
)
def test_sizes_are_the_papers(name: str, latents: int, rest: int):
    model = SPATIAL[name].build(SPATIAL[name].config())
    leaves = jax.tree.leaves(jax.eval_shape(model.init, jax.random.key(0)))
    assert sum(leaf.size for leaf in leaves) == latents + rest


def test_the_papers_kilobytes():
    """Table 5 of Timonen et al.: networks, angular textures and spatial ones, as far as they are printed."""
    assert [round(4 * n / 1000, 2) for n in (327 + 48 + 72, 995, 1119 + 96, 1264)] == [1.79, 3.98, 4.86, 5.06]
    assert [round(4 * n / 1e5) / 10 for n in (8 * TEXELS, 8 * TEXELS + 7 * 1024**2, 12 * TEXELS)] == [44.7, 74.1, 67.1]


def test_bundles_tell_all_models_apart():
    names = [entry.bundle for entry in SPATIAL.values()]
    assert len({*names, *MODELS}) == len(names) + len(MODELS)


@cache
def evaluation(name: str):
    return jax.jit(small(name).eval)


@pytest.mark.parametrize("name", ["zeltner", "neumip"])
def test_eval_is_decode_of_encode(name: str):
    params, query = random_params(0, small(name)), queries(1, COUNT)
    coordinates = jax.jit(small(name).encode)(query)
    shapes = [part.shape for part in jax.tree.leaves(coordinates)]
    assert shapes == [(3, COUNT), (3, COUNT), (2, COUNT), (2, 2, COUNT)]
    rows = jax.jit(small(name).decode)(params, coordinates)
    assert rows.shape == (3, COUNT)
    np.testing.assert_allclose(evaluation(name)(params, query), np.exp(rows.T), rtol=1e-5)


def test_queries_may_have_any_shape():
    params, query = random_params(0, small("zeltner")), queries(1, COUNT)
    shaped = jax.tree.map(lambda part: part.reshape(2, COUNT // 2, *part.shape[1:]), query)
    found = evaluation("zeltner")(params, shaped)
    np.testing.assert_array_equal(found.reshape(COUNT, 3), evaluation("zeltner")(params, query))


def test_a_query_without_a_place_is_refused():
    with pytest.raises(ValueError, match=r"query\.uv is None"):
        encode(queries(0, 2)._replace(uv=None))


@pytest.mark.parametrize("name", RECIPROCAL)
def test_reciprocal_by_construction(name: str):
    params, query = random_params(2, small(name)), queries(3, COUNT)
    f, back = evaluation(name)(params, query), evaluation(name)(params, swapped(query))
    np.testing.assert_allclose(back, f, rtol=2e-5)


@pytest.mark.parametrize("name", sorted(set(SPATIAL) - set(RECIPROCAL)))
def test_networks_over_both_directions_are_not_reciprocal(name: str):
    params, query = random_params(2, small(name)), queries(3, COUNT)
    f, back = evaluation(name)(params, query), evaluation(name)(params, swapped(query))
    assert np.max(np.abs(back - f) / (back + f)) > 0.01


@pytest.mark.parametrize("name", SPATIAL)
def test_places_and_footprints_matter_and_whole_periods_do_not(name: str):
    params, query = random_params(4, small(name)), queries(5, COUNT)
    f = evaluation(name)(params, query)
    uv, footprint = map(jnp.asarray, (query.uv, query.footprint))
    moved = evaluation(name)(params, query._replace(uv=uv + 0.3))
    wider = evaluation(name)(params, query._replace(footprint=8.0 * footprint))
    whole = evaluation(name)(params, query._replace(uv=uv + 2.0))
    assert min(np.mean(np.abs(np.log(other / f))) for other in (moved, wider)) > 0.01
    np.testing.assert_allclose(whole, f, rtol=1e-3)


@cache
def price(model: Model) -> float:
    """Floating-point operations of the compiled value."""
    query = queries(0, COUNT)
    params = jax.eval_shape(model.init, jax.random.key(0))
    return jax.jit(model.eval).lower(params, query).compile().cost_analysis()["flops"]


@pytest.mark.parametrize(
    "less",
    [
        replace(SMALL["gated"], gating=False),
        replace(SMALL["gated"], frame=False),
        replace(SMALL["gated"], warp_terms=0),
        replace(SMALL["gated"], latents=replace(LATENTS, probes=1)),
    ],
    ids=["gating", "frame", "warps", "probes"],
)
def test_what_is_switched_off_is_not_compiled(less):
    assert price(spatial_gated(less)) < price(small("gated"))


def test_first_frames_and_warps_are_those_of_a_model_without():
    plain = spatial_gated(replace(SMALL["gated"], frame=False, warp_terms=0))
    params, query = small("gated").init(jax.random.key(3)), queries(10, COUNT)
    want = jax.jit(plain.eval)(params._replace(frame=None, warps=None), query)
    np.testing.assert_allclose(evaluation("gated")(params, query), want, rtol=1e-5)


def test_the_gated_model_with_all_switched_off_is_the_tripleplane():
    off = spatial_gated(replace(SMALL["gated"], gating=False, frame=False, warp_terms=0))
    params: SpatialTripleplaneParams = random_params(11, small("tripleplane"))
    same = SpatialGatedParams(params.s, params.h, params.d, None, None, params.mlp)
    query = queries(12, COUNT)
    np.testing.assert_allclose(jax.jit(off.eval)(same, query), evaluation("tripleplane")(params, query), rtol=1e-6)


def test_gating_multiplies_matrices_with_the_latent():
    """Against the same with numpy: at the centre of both textures and of a texel of the finest level."""
    params: SpatialGatedParams = random_params(13, spatial_gated(replace(SMALL["gated"], frame=False, warp_terms=0)))
    up, uv = jnp.array([[0.0, 0.0, 1.0]]), jnp.array([[2.5 / 8, 4.5 / 8]])
    z = np.asarray(params.s.texels[4 * 8 + 2])
    z_h, z_d = (np.asarray(t[:, 0, 0]).reshape(TEXTURES.channels, -1) @ z for t in (params.h, params.d))
    x = np.concatenate([z_h, z_d]) @ params.mlp.weights[0] + params.mlp.biases[0]
    want = (x / (1 + np.exp(-x))) @ params.mlp.weights[1] + params.mlp.biases[1]
    model = spatial_gated(replace(SMALL["gated"], frame=False, warp_terms=0))
    found = jax.jit(model.eval)(params, Query(up, up, uv))
    np.testing.assert_allclose(np.log(found[0]), want, rtol=1e-4)


@pytest.mark.parametrize("frames", [1, 3])
def test_any_number_of_frames(frames: int):
    model = zeltner(replace(SMALL["zeltner"], frames=frames))
    params = random_params(14, model)
    assert params.frame.shape == (4, 6 * frames)
    assert np.isfinite(jax.jit(model.eval)(params, queries(15, COUNT))).all()


def test_no_frame_is_refused():
    with pytest.raises(ValueError, match="frames is at least 1, not 0"):
        ZeltnerConfig(frames=0)
