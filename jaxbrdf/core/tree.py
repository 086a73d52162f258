"""Pytrees: as flat tables of named arrays, the form in which they are stored; and chosen from, entry by entry."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp


def named_leaves(tree: Any, *, is_leaf: Callable[[Any], bool] | None = None) -> dict[str, Any]:
    """Leaves by their place in the tree, such as `mlp.weights.0`, in flattening order.

    Args:
        tree: of any records.
        is_leaf: whether a node is taken whole.
    """
    leaves = jax.tree_util.tree_flatten_with_path(tree, is_leaf=is_leaf)[0]
    return {jax.tree_util.keystr(path, simple=True, separator="."): leaf for path, leaf in leaves}


def with_leaves(tree: Any, leaves: dict[str, Any]) -> Any:
    """A tree of the same structure whose leaves are those of the table; inverse of `named_leaves`.

    Raises:
        KeyError: naming a leaf that the table lacks.
    """
    return jax.tree.unflatten(jax.tree.structure(tree), [leaves[name] for name in named_leaves(tree)])


def select(condition: jax.Array, one: Any, other: Any) -> Any:
    """`one` where the condition `(...)` holds, `other` elsewhere; leaves are `(...)` or `(..., n)`."""

    def of_leaf(a: jax.Array, b: jax.Array) -> jax.Array:
        return jnp.where(condition[..., None] if a.ndim > condition.ndim else condition, a, b)

    return jax.tree.map(of_leaf, one, other)
