"""Mitsuba's BSDF plugins, one query at a time, in this project's roles: its si.wi is our wo."""

from __future__ import annotations

from types import ModuleType
from typing import Any

import numpy as np

from experiments.check_brdfs_against_mitsuba import Answer
from jaxbrdf.types import Query


def one_by_one(mi: ModuleType, plugin: dict[str, Any], query: Query, *, lobes: str = "All") -> Answer:
    """f without the cosine `(n, 3)`, and the density `(n,)`, of the lobes whose flag has that name."""
    bsdf, context, rows = mi.load_dict(plugin), mi.BSDFContext(), []
    context.type_mask = getattr(mi.BSDFFlags, lobes)
    for wi, wo in zip(np.asarray(query.wi).tolist(), np.asarray(query.wo).tolist(), strict=True):
        surface = mi.SurfaceInteraction3f()
        surface.wi = wo
        rows.append((np.array(bsdf.eval(context, surface, wi)) / wi[2], bsdf.pdf(context, surface, wi)))
    return Answer(*(np.array(column) for column in zip(*rows, strict=True)))
