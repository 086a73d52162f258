"""Errors of one BRDF against another, as means over two cosine-distributed directions and three channels.

With prediction p, truth f, and c the cosine of wi:

    MAE = E |p - f|                       SMAPE = E 2 |p - f| / (p + f + 1e-3)
    RMSE = sqrt(E (p - f)^2)              log-RMSE = sqrt(E (log(1 + p c) - log(1 + f c))^2)

Plain cosine draws miss highlights, so the means are taken over draws of any density, each weighted by its importance
(cos cos / pi^2) / density. Sums run in float64; roots have their standard error by the delta method.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.metrics.estimate import NO_DRAWS, Estimate, Moments, add_draws, mean, root
from jaxbrdf.types import Query

Evaluate = Callable[[Query], jax.Array]
DrawWeighted = Callable[[jax.Array, int], tuple[Query, jax.Array]]

SMAPE_OFFSET = 1e-3
LEAST_PAIRS = 2**19


class BrdfErrors(NamedTuple):
    """Each error with its standard error, and the number of pairs behind them."""

    mae: Estimate
    smape: Estimate
    rmse: Estimate
    log_rmse: Estimate
    pairs: int


class TruePairs(NamedTuple):
    """Drawn pairs and what is right at them.

    Attributes:
        query: directions `(n, 3)`.
        importance: the pairs' weights, `(n,)`.
        f: the truth, `(n, 3)`.
    """

    query: Query
    importance: jax.Array
    f: jax.Array


def errors(predicted: jax.Array, truth: jax.Array, importance: jax.Array, cos: jax.Array) -> BrdfErrors:
    """Errors of values at independently drawn pairs.

    Args:
        predicted, truth: f in 1/sr, `(n, 3)`.
        importance: `(n,)`, the pairs' weights.
        cos: `(n,)`, cosine of wi.
    """
    return _from_moments(add_draws(NO_DRAWS, np.asarray(pair_terms(predicted, truth, importance, cos))))


def estimate_errors(
    key: jax.Array,
    predicted: Evaluate,
    truth: Evaluate,
    draw: DrawWeighted,
    *,
    pairs: int = LEAST_PAIRS,
    chunk: int = 2**16,
) -> BrdfErrors:
    """Errors of `predicted` against `truth`, chunk by chunk so that memory stays bounded.

    Args:
        key: chooses the pairs; the same key gives two predictions the same pairs.
        predicted, truth: `query -> f`, called with `(chunk, 3)` directions; compile them first if they are slow.
        draw: `(key, count) -> (query, importance)`, such as `jaxbrdf.sampling.pairs.draw_weighted`.
        pairs: how many at least; rounded up to whole chunks.
        chunk: pairs a call, even.
    """
    return compare_at(true_pairs(key, truth, draw, pairs=pairs, chunk=chunk), {"": predicted})[""]


def true_pairs(
    key: jax.Array, truth: Evaluate, draw: DrawWeighted, *, pairs: int = LEAST_PAIRS, chunk: int = 2**16
) -> Iterator[TruePairs]:
    """The pairs of `estimate_errors`, chunk by chunk: kept in a list, they judge many predictions by one truth."""
    compiled = jax.jit(draw, static_argnums=1)
    for index in range(-(-pairs // chunk)):
        query, importance = compiled(jax.random.fold_in(key, index), chunk)
        yield TruePairs(query, importance, truth(query))


def compare_at(drawn: Iterable[TruePairs], predicted: Mapping[str, Evaluate]) -> dict[str, BrdfErrors]:
    """Errors of predictions at pairs that were drawn before."""
    totals = dict.fromkeys(predicted, NO_DRAWS)
    for query, importance, f in drawn:
        for name, evaluate in predicted.items():
            terms = pair_terms(evaluate(query), f, importance, query.wi[..., 2])
            totals[name] = add_draws(totals[name], np.asarray(terms))
    return {name: _from_moments(moments) for name, moments in totals.items()}


@jax.jit
def pair_terms(predicted: jax.Array, truth: jax.Array, importance: jax.Array, cos: jax.Array) -> jax.Array:
    """What each pair adds to MAE, SMAPE and the two mean squares, `(n, 4)`: importance times the channels' mean."""
    difference = predicted - truth
    absolute = jnp.abs(difference)
    logarithms = jnp.log1p(predicted * cos[..., None]) - jnp.log1p(truth * cos[..., None])
    relative = 2.0 * absolute / (predicted + truth + SMAPE_OFFSET)
    per_channel = jnp.stack([absolute, relative, difference * difference, logarithms * logarithms], axis=-1)
    return importance[..., None] * jnp.mean(per_channel, axis=-2)


def _from_moments(moments: Moments) -> BrdfErrors:
    means = mean(moments)
    columns = np.stack([means.value, means.standard_error], axis=-1)
    mae, smape, mse, log_mse = (Estimate(*column) for column in columns)
    return BrdfErrors(mae, smape, root(mse), root(log_mse), moments.count)
