"""Counts of operations: by hand for a network, and against the paper's table."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import pytest

from jaxbrdf.models import mlp, spatial
from jaxbrdf.models.operations import Operations, spatial_operations
from jaxbrdf.models.spatial import LatentTexture, SpatialCoordinates
from jaxbrdf.models.table import SPATIAL

PUBLISHED = {"gated": 1625, "tripleplane": 1638, "zeltner": 1645, "neumip": 1633}
"""Of Timonen et al.'s table 5."""


def test_a_network_over_latents_by_hand():
    """8-5-3: 40 + 15 multiply-adds, biases, five SiLUs of three, and three exponentials; the latent is free."""
    texture = LatentTexture(4, 4)

    def init(key: jax.Array) -> tuple:
        return spatial.init_latents(key, texture), mlp.init(key, (8, 5, 3))

    def decode(params: tuple, coordinates: SpatialCoordinates) -> jax.Array:
        return mlp.apply(params[1], spatial.latents_at(params[0], coordinates, probes=1))

    counted = spatial_operations(spatial.spatial_model(init, decode))
    assert counted == Operations(40 + 15, 8 + 3 * 5 + 3)
    assert (counted.published, counted.flops) == (81, 136)


def test_what_no_result_depends_on_is_not_counted():
    def init(key: jax.Array) -> tuple:
        return (spatial.init_latents(key, LatentTexture(4, 4)),)

    def decode(params: tuple, coordinates: SpatialCoordinates) -> jax.Array:
        jnp.sin(coordinates.wi)
        return coordinates.wi + spatial.latents_at(params[0], coordinates, probes=1)[:3]

    assert spatial_operations(spatial.spatial_model(init, decode)) == Operations(0, 6)


@pytest.mark.parametrize("name", PUBLISHED)
def test_within_a_sixth_of_the_papers_table(name: str):
    model = SPATIAL[name].build(SPATIAL[name].config())
    assert spatial_operations(model).published == pytest.approx(PUBLISHED[name], rel=1 / 6)


def test_the_analytic_model_takes_a_third_of_the_others():
    counts = {name: spatial_operations(entry.build(entry.config())).published for name, entry in SPATIAL.items()}
    assert 100 < counts.pop("ggx-mip") < min(counts.values()) / 2


def test_parts_have_the_price_of_their_arithmetic():
    entry = SPATIAL["gated"]
    whole = spatial_operations(entry.build(entry.config()))
    for less in ({"frame": False}, {"warp_terms": 0}, {"gating": False}):
        assert spatial_operations(entry.build(replace(entry.config(), **less))).published < whole.published
