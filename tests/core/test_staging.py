from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.core.staging import staged, staged_both_ways


@pytest.mark.parametrize("first", [1.5, jnp.nan, jnp.inf, -jnp.inf])
def test_values_are_unchanged_whatever_the_first_is(first: float) -> None:
    values = jnp.array([[first, 2.0], [3.0, -0.0]]), jnp.array([1, -2])
    for function in (staged, jax.jit(staged)):
        out = function(values)
        np.testing.assert_array_equal(out[0], values[0])
        np.testing.assert_array_equal(out[1], values[1])


def test_empty_arrays_pass() -> None:
    assert staged((jnp.zeros((0, 3)),))[0].shape == (0, 3)


def test_gradients_pass_in_both_modes() -> None:
    def cubed(x: jax.Array) -> jax.Array:
        return jnp.sum(staged((x * x, jnp.arange(3)))[0] * x)

    x = jnp.array([1.0, -2.0, 3.0])
    np.testing.assert_allclose(jax.grad(cubed)(x), 3.0 * x * x)
    np.testing.assert_allclose(jax.jvp(cubed, (x,), (jnp.ones(3),))[1], 42.0)


def test_it_can_be_mapped() -> None:
    x = jnp.arange(6.0).reshape(2, 3)
    np.testing.assert_array_equal(jax.vmap(lambda row: staged((row,))[0])(x), x)


def test_what_comes_back_is_unchanged_too() -> None:
    def cubed(x: jax.Array) -> jax.Array:
        square, same = staged_both_ways((x * x, x))
        return jnp.sum(square * same)

    x = jnp.array([1.0, -2.0, 3.0])
    np.testing.assert_allclose(jax.jit(jax.grad(cubed))(x), 3.0 * x * x)
    np.testing.assert_array_equal(jax.jit(staged_both_ways)([x])[0], x)
