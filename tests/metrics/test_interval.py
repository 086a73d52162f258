"""Intervals that hold what they say."""

from __future__ import annotations

import numpy as np
import pytest

from jaxbrdf.metrics.interval import mean_interval, mean_ratio


def test_an_interval_holds_the_mean_as_often_as_it_says():
    draws = np.random.default_rng(0).normal(3.0, 2.0, (4000, 12))
    found = np.array([mean_interval(one) for one in draws])
    share = np.mean((found[:, 1] <= 3.0) & (found[:, 2] >= 3.0))
    # four standard errors of a share of 0.95
    assert abs(share - 0.95) < 4 * np.sqrt(0.95 * 0.05 / len(draws))
    np.testing.assert_allclose(found[:, 0], draws.mean(axis=1))


def test_a_ratio_is_a_geometric_mean_of_pairs():
    rng = np.random.default_rng(1)
    others = rng.uniform(0.01, 1.0, (12, 21))
    found = mean_ratio(3.0 * others, others)
    np.testing.assert_allclose(found, 3.0, rtol=1e-12)
    noise = rng.lognormal(0.0, 0.3, others.shape)
    upwards, downwards = mean_ratio(noise * others, others), mean_ratio(others, noise * others)
    assert upwards.mean == pytest.approx(np.exp(np.log(noise).mean()))
    np.testing.assert_allclose([downwards.low, downwards.high], [1 / upwards.high, 1 / upwards.low])
    assert upwards.low < upwards.mean < upwards.high


def test_no_error_has_a_ratio_too():
    nothing, some = np.zeros((3, 2)), np.full((3, 2), 0.5)
    np.testing.assert_array_equal(mean_ratio(nothing, nothing), 1.0)
    np.testing.assert_allclose(mean_ratio(some, nothing), 0.5 * 2**24)


def test_one_value_has_no_interval():
    with pytest.raises(ValueError, match="there are 1 values"):
        mean_interval(np.ones(1))
