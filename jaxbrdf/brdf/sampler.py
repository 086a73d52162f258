"""The sampling half of a BRDF, for code that cannot do without."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import jax

from jaxbrdf.types import Brdf, Params, Query, Sample


class Sampler(NamedTuple):
    """`sample` and `pdf` of a `Brdf` that has both."""

    sample: Callable[[Params, Query, jax.Array], Sample]
    pdf: Callable[[Params, Query], jax.Array]


def sampler_of(brdf: Brdf) -> Sampler:
    """The BRDF's sample and pdf.

    Raises:
        ValueError: it lacks one of them.
    """
    if brdf.sample is None or brdf.pdf is None:
        raise ValueError(
            f"brdf has no {'sample' if brdf.sample is None else 'pdf'}; sampling needs both sample and pdf"
        )
    return Sampler(brdf.sample, brdf.pdf)
