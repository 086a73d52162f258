"""Options of the XLA compiler, which come and go between its releases."""

from __future__ import annotations

import jax


def known_options(options: dict[str, str]) -> dict[str, str]:
    """Those among `options` that the installed XLA accepts, for `jax.jit(..., compiler_options=...)`."""
    return {name: value for name, value in options.items() if _is_known(name, value)}


def _is_known(name: str, value: str) -> bool:
    try:
        jax.jit(lambda x: x, compiler_options={name: value}).lower(0.0).compile()
    except (jax.errors.JaxRuntimeError, ValueError):
        return False
    return True
