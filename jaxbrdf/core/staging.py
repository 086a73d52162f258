"""Where a computation should store what it has, rather than compute it again."""

from __future__ import annotations

from typing import Any, TypeVar

import jax
import jax.numpy as jnp

T = TypeVar("T")


def staged(values: T) -> T:
    """The same pytree of arrays, but computed once for all that uses it; gradients pass unchanged.

    On the CPU, XLA repeats cheap arithmetic inside each loop that needs it: an index that a dozen table reads share is
    computed a dozen times. `optimization_barrier` does not help, since XLA drops it before it forms those loops. A loop
    that never turns, which XLA cannot know, makes it store the values: 4 times the speed of table interpolation.
    """
    return values if jax.tree.leaves(values)[0].size == 0 else _stored(values)


@jax.custom_vjp
def staged_both_ways(values: T) -> T:
    """`staged`, and what comes back for the values is staged too: for arrays of floats, in reverse mode.

    A chain of cheap arithmetic over single rows becomes one loop in which each row's derivative is computed again for
    every row before it: without a stop in between, the time grows exponentially with the chain's length.
    """
    return staged(values)


def _both_ways_forward(values: T) -> tuple[T, None]:
    return staged(values), None


def _both_ways_backward(_: None, cotangents: T) -> tuple[T]:
    return (staged(cotangents),)


staged_both_ways.defvjp(_both_ways_forward, _both_ways_backward)


@jax.custom_jvp
def _stored(values: Any) -> Any:
    leaves = jax.tree.leaves(values)
    probe = leaves[0].reshape(-1)[0]
    never = (probe != probe) & (jnp.abs(probe) == jnp.inf)
    return jax.lax.while_loop(lambda carry: carry[0], _turn, (never, values))[1]


@_stored.defjvp
def _stored_jvp(primals: tuple[Any], tangents: tuple[Any]) -> tuple[Any, Any]:
    return _stored(primals[0]), tangents[0]


def _turn(carry: tuple[jax.Array, Any]) -> tuple[jax.Array, Any]:
    return ~carry[0], jax.tree.map(jnp.negative, carry[1])
