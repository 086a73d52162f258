"""A model's reflectance with the parts that a bundle has."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import jax

from jaxbrdf.brdf.albedo_table import albedo_at
from jaxbrdf.brdf.energy_scale import scaled
from jaxbrdf.brdf.proposed import Proposed, sampled_by
from jaxbrdf.export.parts import Parts
from jaxbrdf.sampling.proposal import Proposal
from jaxbrdf.sampling.view_proxy import VISIBLE_VIEW_PROXY
from jaxbrdf.types import Brdf, Params, Query


class BundleParams(NamedTuple):
    """The model's own parameters, and the parts'."""

    model: Params
    parts: Parts


def assembled(brdf: Brdf, parts: Parts) -> Brdf:
    """The reflectance of `BundleParams`: `brdf` with the parts that are there, and nothing of the others.

    Light is drawn by the bundle's sampler, or by the model's own where there is only that.
    """
    evaluate = _evaluation(brdf, parts)
    proposal = _proposal(brdf, parts)
    made = (
        Brdf(evaluate) if proposal is None else sampled_by(proposal, evaluate, lambda params: Proposed(params, params))
    )
    return made if parts.albedo is None else made._replace(albedo=_albedo)


def _evaluation(brdf: Brdf, parts: Parts) -> Callable[[Params, Query], jax.Array]:
    if parts.scale is None:
        return lambda params, query: brdf.eval(params.model, query)
    return scaled(brdf.eval, lambda params: (params.model, params.parts.scale))


def _proposal(brdf: Brdf, parts: Parts) -> Proposal | None:
    """How light is drawn, of `BundleParams`."""
    if parts.sampler is not None:
        return Proposal(
            lambda params, wo, u: VISIBLE_VIEW_PROXY.sample(params.parts.sampler, wo, u),
            lambda params, wi, wo: VISIBLE_VIEW_PROXY.pdf(params.parts.sampler, wi, wo),
        )
    if brdf.sample is None or brdf.pdf is None:
        return None
    sample, pdf = brdf.sample, brdf.pdf
    return Proposal(
        lambda params, wo, u: sample(params.model, Query(wo, wo), u).wi,
        lambda params, wi, wo: pdf(params.model, Query(wi, wo)),
    )


def _albedo(params: Params, query: Query) -> jax.Array:
    return albedo_at(params.parts.albedo, query.wo)
