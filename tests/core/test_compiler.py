from __future__ import annotations

import jax
import pytest

from jaxbrdf.core.compiler import known_options

KNOWN = {"xla_embed_ir_in_executable": "True"}


@pytest.mark.parametrize("unknown", [{"xla_of_another_year": "true"}, {"xla_embed_ir_in_executable": "perhaps"}])
def test_options_that_xla_refuses_are_left_out(unknown: dict[str, str]):
    with pytest.raises(Exception, match=r"option|value|parse"):
        jax.jit(lambda x: x, compiler_options=unknown).lower(0.0).compile()
    assert known_options(unknown) == {}


def test_options_that_xla_accepts_are_kept():
    assert known_options(KNOWN) == KNOWN
