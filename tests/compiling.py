"""Compiling as users do, for tests of roundings: the suite compiles without optimisation (tests/conftest.py)."""

from __future__ import annotations

from functools import partial

import jax

jit_as_users = partial(jax.jit, compiler_options={"xla_backend_optimization_level": "3"})
"""`jax.jit` at XLA's own level."""
