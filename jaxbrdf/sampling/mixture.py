"""One of several proposals, drawn by chance: one-sample multiple importance sampling (Veach and Guibas 1995).

With every draw weighed by the mixture's density, this is the balance heuristic for a single draw.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial, reduce
from typing import Annotated, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.core.numerics import match_rank, safe_divide
from jaxbrdf.core.ranges import Range
from jaxbrdf.sampling.proposal import Proposal
from jaxbrdf.types import Params


class MixtureParams(NamedTuple):
    """The parts' own parameters, and their chances `(n,)` or `(..., n)` up to a common factor, one of them positive."""

    parts: tuple[Params, ...]
    chances: Annotated[jax.Array, Range(0.0, np.inf)]


def mixture(*proposals: Proposal) -> Proposal:
    """The proposal that draws from one of `proposals`; parameters `MixtureParams`.

    Raises:
        ValueError: no proposals.
    """
    if not proposals:
        raise ValueError("proposals is empty; a mixture needs at least one")

    def sample(params: MixtureParams, wo: jax.Array, u: jax.Array) -> jax.Array:
        draws = [partial(part.sample, own, wo) for part, own in zip(proposals, params.parts, strict=True)]
        return choose(params.chances, draws, u)

    def pdf(params: MixtureParams, wi: jax.Array, wo: jax.Array) -> jax.Array:
        return blend(params.chances, [part.pdf(own, wi, wo) for part, own in zip(proposals, params.parts, strict=True)])

    return Proposal(sample, pdf)


def choose(chances: jax.Array, draws: Sequence[Callable[[jax.Array], jax.Array]], u: jax.Array) -> jax.Array:
    """The direction `(..., 3)` that the draw in whose interval u[0] falls makes of u.

    What u[0] has left within the interval is stretched to [0, 1) and handed on in its place.

    Args:
        chances: `(n,)` or `(..., n)`, up to a common factor.
        draws: n functions of u `(..., 3)`.
        u: uniform in [0, 1), `(..., 3)`.
    """
    share = _shares(chances, u.ndim)
    start = jnp.cumsum(share, axis=-1) - share
    below_one = 1.0 - jnp.finfo(u.dtype).epsneg
    wi = jnp.zeros_like(u)
    for index, draw in enumerate(draws):
        inside = safe_divide(u[..., 0] - start[..., index], share[..., index])
        rest = jnp.clip(inside, 0.0, below_one)
        drawn = draw(jnp.concatenate([rest[..., None], u[..., 1:]], axis=-1))
        # a part without a chance is not drawn, even where rounding leaves it an interval
        reached = (u[..., 0] >= start[..., index]) & (share[..., index] > 0)
        wi = jnp.where(reached[..., None], drawn, wi)
    return wi


def blend(chances: jax.Array, densities: Sequence[jax.Array]) -> jax.Array:
    """The mixture's density `(...)` of its parts' densities, each `(...)`."""
    share = _shares(chances, densities[0].ndim + 1)
    return reduce(jnp.add, (share[..., i] * density for i, density in enumerate(densities)))


def _shares(chances: jax.Array, rank: int) -> jax.Array:
    """The chances divided by their sum, all equal where that is zero, with axes in front up to `rank`."""
    total = jnp.sum(chances, axis=-1, keepdims=True)
    return match_rank(jnp.where(total > 0, chances / jnp.where(total > 0, total, 1.0), 1.0 / chances.shape[-1]), rank)
