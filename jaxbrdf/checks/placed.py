"""A material over a surface as the checks take it: its reflectance at one place, under one footprint."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np

from jaxbrdf.checks.suite import Subject
from jaxbrdf.types import Brdf, Query


def at_place(subject: Subject, uv: tuple[float, float], size: float) -> Subject:
    """The subject under a round footprint, of directions alone.

    Args:
        subject: whose queries have uv and footprint.
        uv: the place.
        size: the footprint's, in uv.
    """
    brdf, slack = subject.material.brdf, subject.slack

    def at(query: Query) -> Query:
        batch, kind = query.wi.shape[:-1], query.wi.dtype
        footprint = jnp.broadcast_to(jnp.asarray(size * np.eye(2), kind), (*batch, 2, 2))
        return query._replace(uv=jnp.broadcast_to(jnp.asarray(uv, kind), (*batch, 2)), footprint=footprint)

    there = Brdf(lambda params, query: brdf.eval(params, at(query)))
    return subject._replace(
        material=subject.material._replace(brdf=there),
        slack=None if slack is None else lambda query: slack(at(query)),
    )
