"""A Monte Carlo figure and how far it may be off."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Estimate(NamedTuple):
    """A mean and its standard error, floats or arrays of one shape."""

    value: float | np.ndarray
    standard_error: float | np.ndarray


class Moments(NamedTuple):
    """Running sums of n independent draws and of their squares, in float64."""

    count: int
    total: np.ndarray
    squares: np.ndarray


NO_DRAWS = Moments(0, np.zeros(()), np.zeros(()))


def add_draws(moments: Moments, draws: np.ndarray) -> Moments:
    """`moments` with `draws` added, independent along the first axis."""
    draws = np.asarray(draws, np.float64)
    total, squares = moments.total + draws.sum(0), moments.squares + np.square(draws).sum(0)
    return Moments(moments.count + len(draws), total, squares)


def mean(moments: Moments) -> Estimate:
    """The mean of the draws with the standard error of a mean of independent draws."""
    value = moments.total / moments.count
    variance = np.maximum(moments.squares / moments.count - np.square(value), 0.0)
    return Estimate(value, np.sqrt(variance / max(moments.count - 1, 1)))


def root(estimate: Estimate) -> Estimate:
    """Square root of an estimate; its error by the delta method, se / (2 sqrt(value)), zero where the value is."""
    value = np.sqrt(estimate.value)
    slope = np.divide(0.5, value, out=np.zeros_like(value), where=value > 0)
    return Estimate(value, estimate.standard_error * slope)
