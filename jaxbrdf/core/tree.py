"""Pytrees as flat tables of named arrays, the form in which they are stored."""

from __future__ import annotations

from typing import Any

import jax


def named_leaves(tree: Any) -> dict[str, Any]:
    """Leaves by their place in the tree, such as `mlp.weights.0`, in flattening order."""
    leaves = jax.tree_util.tree_flatten_with_path(tree)[0]
    return {jax.tree_util.keystr(path, simple=True, separator="."): leaf for path, leaf in leaves}


def with_leaves(tree: Any, leaves: dict[str, Any]) -> Any:
    """A tree of the same structure whose leaves are those of the table; inverse of `named_leaves`.

    Raises:
        KeyError: naming a leaf that the table lacks.
    """
    return jax.tree.unflatten(jax.tree.structure(tree), [leaves[name] for name in named_leaves(tree)])
