"""Hard parameters: the ends of the ranges that a record declares, as one stack that is evaluated at once."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.core.ranges import Range, clamp, ranges_of
from jaxbrdf.types import Params


def extremes(params: Params, *, hard: Sequence[Params] = ()) -> Params:
    """Parameters with a first axis: `params` itself, all at their low ends, all high, all in the middle of the ranges,
    one leaf at a time at either end, and the `hard` ones.

    What declares no finite range keeps its value; what is valid only together is put to the nearest that is.

    Args:
        hard: more parameters of the same kind, such as those that are hard together.
    """
    leaves, kind = jax.tree.flatten(params)
    changed = [jax.tree.unflatten(kind, one) for one in _variants(leaves, ranges_of(params))]
    stack = [[np.asarray(leaf) for leaf in jax.tree.leaves(clamp(one))] for one in changed]
    stack += [[np.asarray(leaf) for leaf in jax.tree.leaves(own)] for own in hard]
    return jax.tree.unflatten(kind, [jnp.asarray(np.stack(same)) for same in zip(*stack, strict=True)])


def random_stack(rng: np.random.Generator, params: Params, count: int) -> Params:
    """`count` parameters drawn evenly between the ends of each range, by ratio where one is many times the other.

    What declares no finite range keeps its value; what is valid only together is put to the nearest that is.
    """
    leaves, kind = jax.tree.flatten(params)
    drawn = [_drawn(rng, np.asarray(leaf), valid, count) for leaf, valid in zip(leaves, ranges_of(params), strict=True)]
    return clamp(jax.tree.unflatten(kind, drawn))


def _drawn(rng: np.random.Generator, leaf: np.ndarray, valid: Range, count: int) -> jax.Array:
    stack = np.broadcast_to(leaf, (count, *leaf.shape))
    share = rng.random(stack.shape)
    if valid.low > 0 and np.isfinite(valid.high):
        stack = valid.low * (valid.high / valid.low) ** share
    elif np.isfinite(valid).all():
        stack = valid.low + (valid.high - valid.low) * share
    return jnp.asarray(stack, leaf.dtype)


def _variants(leaves: list[jax.Array], ranges: list[Range]) -> Iterator[list[np.ndarray]]:
    own = [np.asarray(leaf) for leaf in leaves]
    ends = [[_put(leaf, at(valid)) for leaf, valid in zip(own, ranges, strict=True)] for at in (_low, _high)]
    middle = [_put(leaf, _middle(valid)) for leaf, valid in zip(own, ranges, strict=True)]
    yield own
    if np.isfinite(np.asarray(ranges)).any():
        yield from (*ends, middle)
    for index, valid in enumerate(ranges):
        if np.isfinite(valid).any():
            yield from ([*own[:index], end[index], *own[index + 1 :]] for end in ends)


def _put(leaf: np.ndarray, value: float) -> np.ndarray:
    return np.full_like(leaf, value) if np.isfinite(value) else leaf


def _low(valid: Range) -> float:
    return valid.low


def _high(valid: Range) -> float:
    return valid.high


def _middle(valid: Range) -> float:
    """Between the ends, by their ratio where one is many times the other."""
    if valid.low > 0:
        return float(np.sqrt(valid.low * valid.high))
    return 0.5 * (valid.low + valid.high) if np.isfinite(valid).all() else np.inf
