"""Means over a few configurations with the interval that they leave open."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import stats

CONFIDENCE = 0.95

LEAST_ERROR = 2.0**-24
"""The rounding of a float32 value just below one: an error below it, such as none, counts as this much in a ratio."""


class Interval(NamedTuple):
    """A mean and the bounds of its interval of 95 % confidence."""

    mean: float
    low: float
    high: float


def mean_interval(values: np.ndarray) -> Interval:
    """The mean of independent values, any shape, by Student's t.

    Raises:
        ValueError: fewer than two values, which say nothing of their spread.
    """
    values = np.asarray(values, np.float64).ravel()
    if len(values) < 2:
        raise ValueError(f"there are {len(values)} values; an interval needs at least 2")
    reach = stats.t.ppf(0.5 + 0.5 * CONFIDENCE, len(values) - 1) * values.std(ddof=1) / np.sqrt(len(values))
    return Interval(float(values.mean()), float(values.mean() - reach), float(values.mean() + reach))


def mean_ratio(errors: np.ndarray, others: np.ndarray) -> Interval:
    """The geometric mean of `errors` over `others`, taken pair by pair, and its interval.

    Args:
        errors, others: of the same configurations, `(groups, ...)`; the mean within a group counts as one value.
    """
    logs = (np.log(np.maximum(np.asarray(part, np.float64), LEAST_ERROR)) for part in (errors, others))
    ratio = np.subtract(*logs)
    found = mean_interval(ratio.reshape(len(ratio), -1).mean(axis=1))
    return Interval(*(float(np.exp(bound)) for bound in found))
