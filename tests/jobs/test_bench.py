"""Prices and rates, on few queries; no test asserts a time."""

from __future__ import annotations

from functools import partial
from itertools import groupby
from pathlib import Path

import jax
import numpy as np
import pytest

from jaxbrdf.export import bundle as bundles
from jaxbrdf.jobs import bench, price
from jaxbrdf.jobs.progress import Silent
from jaxbrdf.models.mlp import init
from jaxbrdf.opencl.platform import choose, context_of
from tests.export.bundles import random_bundle
from tests.jobs.tiny import Listener, run_json

KEYS = {
    "ns_per_evaluation",
    "evaluations_per_second",
    "gflops",
    "fma_ceiling_gflops",
    "jax_evaluations_per_second",
    "build_seconds",
}


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few queries, few rounds, and no chains of a second."""
    monkeypatch.setattr(price, "JAX_BATCHES", (2**8,))
    monkeypatch.setattr(bench, "timed_query", partial(price.timed_query, count=1000))
    monkeypatch.setattr(bench, "timed_query_on", partial(price.timed_query_on, count=1000))
    monkeypatch.setattr(bench, "ROUNDS", 3)
    monkeypatch.setattr(bench.ceiling, "PROCESSOR_CUTS", ((8, 8),))


def test_a_benchmark_has_every_rate(capsys: pytest.CaptureFixture[str], bundle: Path):
    found = run_json(capsys, "bench", bundle)
    assert found.keys() >= KEYS
    assert all(found[key] > 0 for key in KEYS)
    least, most = found["ns_spread"]
    assert least <= found["ns_per_evaluation"] <= most
    assert found["evaluations_per_second"] == pytest.approx(1e9 / found["ns_per_evaluation"])
    assert (found["name"], found["model"], found["precision"]) == ("light blue", "gated", "float32")
    # 12-12-12-3: a multiplication and an addition for each weight
    assert found["gflops"] == pytest.approx(2 * (12 * 12 + 12 * 12 + 12 * 3) / found["ns_per_evaluation"])


def test_a_material_over_a_surface_is_timed_at_places_under_footprints(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
):
    file = tmp_path / "planes.safetensors"
    bundles.save(file, random_bundle("surface of planes"))
    found = run_json(capsys, "bench", file)
    assert all(found[key] > 0 for key in KEYS)
    assert found["model"] == "spatial-tripleplane"


def test_operations_are_those_of_all_layers():
    assert bench.network_operations(init(jax.random.key(0), (6, 14, 3))) == 2 * (6 * 14 + 14 * 3)


def test_each_is_timed_in_turn_round_by_round(monkeypatch: pytest.MonkeyPatch):
    asked: list[str] = []
    ticks = iter(range(100))
    monkeypatch.setattr(price.time, "perf_counter", lambda: float(next(ticks)))
    times = price.interleaved({name: partial(asked.append, name) for name in "ab"}, 3)
    assert [name for name, _ in groupby(asked)] == ["a", "b"] * 3
    assert times == {"a": [1.0, 1.0, 1.0], "b": [1.0, 1.0, 1.0]}


def test_a_price_is_the_median_with_quartiles_and_extremes():
    found = price.price_of([5e-6, 1e-6, 2e-6, 4e-6, 3e-6], 100)
    assert found._asdict() == pytest.approx({"ns": 30.0, "lower": 20.0, "upper": 40.0, "least": 10.0, "most": 50.0})


def test_bundles_are_priced_together(monkeypatch: pytest.MonkeyPatch, bundle: Path):
    monkeypatch.setattr(price, "timed_query", partial(price.timed_query, count=1000))
    loaded, listener = {"a": bundles.load(bundle), "b": bundles.load(bundle)}, Listener()
    found = price.opencl_prices(loaded, context_of(choose()), reporter=listener, rounds=3)
    assert list(found) == ["a", "b"]
    assert listener.notes == [(1, "1 of 2"), (2, "2 of 2")]
    for one in found.values():
        assert 0 < one.least <= one.lower <= one.ns <= one.upper <= one.most
    assert price.opencl_prices({}, context_of(choose()), reporter=Silent()) == {}


def test_a_timed_run_evaluates_the_query(bundle: Path):
    """What `enqueue` writes is what the material gives."""
    query = price.timed_query(count=999)
    assert query.wi.shape == (999, 3)
    material = price.Material.load(bundle, context_of(choose()))
    arrays = price.device_arrays(material.context, query)
    price._evaluate(material, arrays)
    found = np.empty((3, 999), np.float32)
    price.cl.enqueue_copy(material.queue, found, arrays.f)
    expected = material.evaluate(np.asarray(query.wi), np.asarray(query.wo))
    np.testing.assert_allclose(found.T, expected, rtol=1e-6)
