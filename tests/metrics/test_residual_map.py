"""The map of residuals: places and values that are known."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.core.directions import from_half_difference, spherical
from jaxbrdf.metrics.brdf_space import SMAPE_OFFSET, TruePairs
from jaxbrdf.metrics.residual_map import residual_map
from jaxbrdf.types import Query

THETA_H, THETA_D = np.array([0.5, 20.0, 70.0, 5.0]), np.array([3.0, 45.0, 12.0, 89.0])


def pairs(f: jax.Array) -> TruePairs:
    wh, wd = (spherical(jnp.radians(jnp.asarray(t)), jnp.array([0.3, 1.0, 2.0, 0.0])) for t in (THETA_H, THETA_D))
    return TruePairs(Query(*from_half_difference(wh, wd)), jnp.ones(4), f)


def test_each_residual_lies_in_its_cell():
    truth = jnp.ones((4, 3)) - SMAPE_OFFSET
    factor = jnp.array([0.5, 2.0, 1.0, 3.0])[:, None]
    found = residual_map([pairs(truth)], lambda _: factor - SMAPE_OFFSET, cells=9)
    # the last pair has a direction below the horizon
    assert found.count.sum() == 3
    for theta_h, theta_d, wanted in zip(THETA_H[:3], THETA_D[:3], np.log([0.5, 2.0, 1.0]), strict=True):
        place = np.searchsorted(found.theta_h, theta_h) - 1, np.searchsorted(found.theta_d, theta_d) - 1
        assert found.count[place] == 1
        np.testing.assert_allclose(found.mean[place], wanted, atol=1e-5)
        np.testing.assert_allclose(found.root_mean_square[place], abs(wanted), atol=1e-5)
    assert np.isnan(found.mean[found.count == 0]).all()


def test_errors_that_cancel_in_the_mean_do_not_in_its_root():
    truth = jnp.ones((4, 3)) - SMAPE_OFFSET
    found = residual_map([pairs(truth), pairs(2.0 * truth + SMAPE_OFFSET)], lambda _: jnp.full((4, 3), np.sqrt(2.0)))
    there = found.count > 0
    np.testing.assert_allclose(found.mean[there], 0.0, atol=1e-3)
    np.testing.assert_allclose(found.root_mean_square[there], 0.5 * np.log(2.0), atol=1e-3)
