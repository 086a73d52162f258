"""Losses against their formulas, worked by hand or in numpy's float64."""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.fit import losses
from jaxbrdf.fit.losses import LossWeights, Scale
from tests.fit.batches import batch_of

UNIT = Scale(jnp.float32(1.0), jnp.float32(1.0))
LOSSES = {"mixture": losses.mixture, "log_domain": losses.log_domain, "balanced": losses.balanced}


def drawn(seed: int = 0, count: int = 64) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """ln p and f from 1e-4 to 1e4, `(3, n)`, and importances from 0 to 2."""
    rng = np.random.default_rng(seed)
    log_p, log_f = rng.uniform(-9, 9, (2, 3, count))
    return log_p, np.exp(log_f), rng.uniform(0, 2, count)


def test_mixture_by_hand():
    # p = (1, 2, 4), f = (1, 3, 2): |f - p|^2 = 5, |p|^2 = 21
    batch = batch_of(np.array([[1.0], [3.0], [2.0]]))
    log_p = jnp.log(jnp.array([[1.0], [2.0], [4.0]]))
    found = losses.mixture(log_p, batch, UNIT, share=0.75, epsilon=0.0)
    np.testing.assert_allclose(found, [0.75 * 5 / 21 + 0.25 * 5], rtol=1e-6)


def test_mixture_is_equation_10_with_the_papers_numbers():
    log_p, f, _ = drawn()
    p = np.exp(log_p)
    square = np.sum((f - p) ** 2, axis=0)
    expected = 0.9999 * square / np.sum((p + 1e-6) ** 2, axis=0) + (1 - 0.9999) * square
    np.testing.assert_allclose(losses.mixture(jnp.asarray(log_p, jnp.float32), batch_of(f), UNIT), expected, rtol=2e-5)


def test_mixture_stops_the_gradient_of_its_denominator():
    log_p, f, _ = drawn(1)
    p = np.exp(log_p)
    size = np.sum((p + 1e-6) ** 2, axis=0)
    # d/d ln p of the numerators alone
    slope = (0.9999 / size + (1 - 0.9999)) * 2 * p
    gradient = jax.grad(lambda x: jnp.sum(losses.mixture(x, batch_of(f), UNIT)))(jnp.asarray(log_p, jnp.float32))
    # p - f loses what p and f have in common
    assert np.all(np.abs(gradient - slope * (p - f)) <= 1e-5 * slope * (p + f))


def test_log_domain_by_hand():
    batch = batch_of(np.array([[0.999], [0.0], [9.999]]))
    log_p = jnp.log(jnp.array([[0.099], [0.009], [9.999]]))
    found = losses.log_domain(log_p, batch, UNIT)
    np.testing.assert_allclose(found, np.log([[10.0], [10.0], [1.0]]), rtol=1e-5, atol=1e-5)


def test_balanced_is_the_weighted_sum_of_the_errors_that_fits_are_judged_by():
    log_p, f, importance = drawn(2)
    p, difference = np.exp(log_p), np.abs(np.exp(log_p) - f)
    scale = losses.scale_of(batch_of(f, importance))
    terms = (
        np.mean(importance * 2 * difference / (p + f + 1e-3)),
        np.mean(importance * difference) / np.mean(importance * f),
        np.mean(importance * difference**2) / np.mean(importance * f**2),
    )
    for weights in (LossWeights(), LossWeights(0.5, 0.0, 2.0)):
        found = losses.balanced(jnp.asarray(log_p, jnp.float32), batch_of(f, importance), scale, weights=weights)
        np.testing.assert_allclose(jnp.mean(found), np.dot(weights, terms), rtol=1e-4)


def test_scale_is_the_cosine_weighted_size_and_never_zero():
    f, importance = np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]]), np.array([0.5, 1.5])
    scale = losses.scale_of(batch_of(f, importance))
    np.testing.assert_allclose(scale.mean, (0.5 * 9 + 1.5 * 12) / 6, rtol=1e-6)
    np.testing.assert_allclose(scale.mean_square, (0.5 * 35 + 1.5 * 56) / 6, rtol=1e-6)
    assert min(losses.scale_of(batch_of(np.zeros((3, 4))))) > 0


@pytest.mark.parametrize("name", LOSSES)
def test_a_loss_is_zero_at_the_truth_and_positive_elsewhere(name: str):
    _, f, importance = drawn(3)
    truth = jnp.asarray(np.log(f), jnp.float32)
    loss = partial(LOSSES[name], batch=batch_of(f, importance + 0.1), scale=UNIT)
    worst = np.abs(loss(truth)).max()
    assert worst < 1e-2
    assert np.all(np.asarray(loss(truth + 0.5)) > worst)
    assert np.all(np.asarray(loss(truth - 0.5)) > worst)


@pytest.mark.parametrize("name", LOSSES)
@pytest.mark.parametrize("log_p", [-1e4, -80.0, 0.0, 29.0, 80.0, 1e4])
@pytest.mark.parametrize("f", [0.0, 1e-7, 1.0, 1e7])
def test_values_and_gradients_stay_finite(name: str, log_p: float, f: float):
    batch = batch_of(np.full((3, 1), f))
    value, gradient = jax.value_and_grad(lambda x: jnp.sum(LOSSES[name](x, batch, UNIT)))(jnp.full((3, 1), log_p))
    assert np.isfinite(value)
    assert np.isfinite(gradient).all()


def slope_of_tempered(log_f: float, f: list[float]) -> np.ndarray:
    """d loss / d ln p of `tempered` where all targets are predicted alike, `(n,)`, of a material of mean one."""
    batch = batch_of(np.tile(np.asarray(f), (3, 1)))
    predicted = jnp.full((3, len(f)), log_f)
    return np.asarray(jax.grad(lambda x: jnp.sum(losses.tempered(x, batch, UNIT)))(predicted))[0]


@pytest.mark.parametrize("mean", [1e-3, 0.1, 1.0, 50.0])
def test_tempered_is_least_at_the_mean_of_noisy_targets(mean: float):
    """Lehtinen et al. (2018): zero in half of the draws, three times the mean and once the mean in the others."""
    slopes = slope_of_tempered(np.log(mean), [0.0, 0.0, 3.0 * mean, mean])
    assert abs(slopes.sum()) < 1e-5 * np.abs(slopes).sum()
    lower, higher = (slope_of_tempered(np.log(mean) + d, [0.0, 0.0, 3.0 * mean, mean]).sum() for d in (-0.1, 0.1))
    assert lower < 0 < higher


def test_tempered_does_not_grow_with_a_highlight_that_is_missed():
    """Ten times (p + 0.3 E f): beyond, a target's slope is the same, and at most 20."""
    slopes = slope_of_tempered(np.log(0.2), [4.9, 5.0, 5.1, 1e3, 1e6])
    np.testing.assert_allclose(slopes[1:], slopes[1], rtol=1e-5)
    assert slopes[0] > slopes[1]
    assert (np.abs(slopes) < 20.0).all()
