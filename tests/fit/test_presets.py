"""The presets: that of the paper has the paper's numbers, and all can run."""

from __future__ import annotations

import pytest

from jaxbrdf.fit import losses
from jaxbrdf.fit.optimiser import staircase
from jaxbrdf.fit.presets import PRESETS


def test_the_paper_preset_has_the_numbers_of_sections_4_3_to_4_5():
    preset = PRESETS["paper"]()
    adam = preset.optimiser
    assert (adam.beta1, adam.beta2, adam.epsilon) == (0.99, 0.999, 1e-15)
    assert adam.texture_rate == adam.network_rate == 3e-3
    assert adam.smoothing == 5.0
    assert (preset.loop.batch, preset.loop.ema) == (2**18, 0.005)
    assert preset.steps == 100_000
    assert preset.schedule is staircase
    assert preset.loss is losses.mixture
    assert not preset.highlights


@pytest.mark.parametrize("name", PRESETS)
@pytest.mark.parametrize("devices", [1, 2, 4, 8])
def test_batches_divide_into_devices_and_pieces_and_pools_into_batches(name: str, devices: int):
    preset = PRESETS[name]()
    share = preset.loop.batch // devices
    assert preset.name == name
    assert preset.loop.batch % devices == 0
    assert share % min(share, preset.loop.microbatch) == 0
    assert preset.pool % preset.loop.batch == 0


def test_presets_are_in_order_of_cost():
    queries = {name: PRESETS[name]().steps * PRESETS[name]().loop.batch for name in PRESETS}
    assert list(queries) == sorted(queries, key=queries.__getitem__)
