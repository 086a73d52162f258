"""Every reflectance and every sampler as a row: what is checked, at which parameters, and what it promises.

A new BRDF joins all checks by one row (`test_subjects.py`), which names what it exports, so that none is left out.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from functools import partial
from types import MappingProxyType
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.brdf.abc import ABC, AbcParams
from jaxbrdf.brdf.ashikhmin_shirley import ASHIKHMIN_SHIRLEY, AshikhminShirleyParams
from jaxbrdf.brdf.builtin import MATERIALS
from jaxbrdf.brdf.effects import STACK, Coat, Film, MultipleScattering
from jaxbrdf.brdf.energy_scale import TERMS, EnergyScale
from jaxbrdf.brdf.lambert import LAMBERT, LambertParams
from jaxbrdf.brdf.layered import LayeredParams, layered
from jaxbrdf.brdf.metallic_facets import METALLIC_FACETS, MetallicFacetsParams
from jaxbrdf.brdf.metallic_roughness import METALLIC_ROUGHNESS, MetallicRoughnessParams
from jaxbrdf.brdf.metals import METALS
from jaxbrdf.brdf.microfacet import MICROFACET, SEPARABLE_MICROFACET, MicrofacetParams
from jaxbrdf.brdf.multiple_scattering import MULTIPLE_SCATTERING
from jaxbrdf.brdf.normal_mapped import NormalMappedParams, normal_mapped, reciprocal_normal_mapped
from jaxbrdf.brdf.oren_nayar import OREN_NAYAR, OrenNayarParams
from jaxbrdf.brdf.principled import PRINCIPLED, PrincipledParams
from jaxbrdf.brdf.proposed import Proposed, sampled_by
from jaxbrdf.brdf.rough_interface import ROUGH_INTERFACE, SEPARABLE_ROUGH_INTERFACE, InterfaceParams
from jaxbrdf.brdf.sgd import SGD, SgdParams
from jaxbrdf.brdf.sheen import SHEEN, SheenParams
from jaxbrdf.brdf.substrate import SUBSTRATE, SubstrateParams
from jaxbrdf.checks.parity import demanding_params, random_params, with_isotropy
from jaxbrdf.checks.placed import at_place
from jaxbrdf.checks.precision import coordinate_slack
from jaxbrdf.checks.suite import Subject
from jaxbrdf.core.beckmann import Beckmann
from jaxbrdf.core.directions import above_horizon
from jaxbrdf.core.fresnel import Dielectric, Schlick, SchlickF82
from jaxbrdf.core.ggx import Ggx
from jaxbrdf.core.roughness import Axes, Isotropic, Tensor, Turned
from jaxbrdf.export.assembled import BundleParams, assembled
from jaxbrdf.export.parts import Parts
from jaxbrdf.models.mlp import Mlp
from jaxbrdf.models.spatial import LatentTexture
from jaxbrdf.models.table import ANALYTIC, MODELS, SPATIAL, brdf_of, config_of, is_reciprocal
from jaxbrdf.sampling.conditional import ViewGrid, conditional, tabulate_conditional
from jaxbrdf.sampling.defensive import defensive
from jaxbrdf.sampling.mixture import MixtureParams, mixture
from jaxbrdf.sampling.proposal import COSINE, UNIFORM, VISIBLE_NORMALS, Proposal
from jaxbrdf.sampling.proxy import (
    MIRRORED_NORMALS,
    PROXY,
    TILTED_COSINE,
    VISIBLE_PROXY,
    ProxyParams,
    normals_of,
    to_unconstrained,
)
from jaxbrdf.sampling.tilted_cosine import Tilt
from jaxbrdf.sampling.view_proxy import VIEW_PROXY, VISIBLE_VIEW_PROXY, ViewProxy
from jaxbrdf.types import Brdf, Material, Params, Query


class Row(NamedTuple):
    """A line of the table.

    Attributes:
        covers: the exported record or maker, or the name of the model or built-in material, that the row is there for.
        make: the subject, new each time.
        reason: why float32 loses more than 1e-4 here, so that the loss is told only; empty where it does not.
    """

    covers: Any
    make: Callable[[], Subject]
    reason: str = ""


def number(value: float) -> jax.Array:
    return jnp.float32(value)


def colour(*values: float) -> jax.Array:
    return jnp.array(values, jnp.float32)


GOLD, RED, PLAIN = METALS["gold"], colour(0.8, 0.3, 0.1), colour(0.9, 0.5, 0.1)
ISOTROPIC, STRETCHED = Isotropic(number(0.3)), Axes(number(0.1), number(0.4))
TURNED = Turned(number(0.1), number(0.4), number(0.6))
TENSOR = Tensor(number(0.3), number(0.4), number(0.15))
SINGULAR = (
    # eigenvalues 1 and 0, a rank of zero, and opposite signs: none is a roughness, and all are put to the nearest
    Tensor(number(0.5), number(0.5), number(0.5)),
    Tensor(number(0.0), number(0.0), number(0.0)),
    Tensor(number(0.2), number(0.2), number(-0.9)),
)
LEAST_COLOURS = colour(1e-40, 0.0, 1.0), colour(6e-8, 6e-5, 1.0)
"""A subnormal number of float32; the least number and the least normal one of float16."""
THIN = Axes(number(1e-3), number(1.0))
"""Anisotropy of 1000 : 1."""


def reciprocal(brdf: Brdf, params: Params, *, loss: float = 1e-4, hard: tuple[Params, ...] = ()) -> Subject:
    """A subject that is reciprocal and returns no more light than it gets, as most do."""
    return Subject(Material("", brdf, params, False), reciprocal=True, conserving=True, loss=loss, hard=hard)


def facets(distribution: Any, fresnel: Any = None) -> MicrofacetParams:
    return MicrofacetParams(distribution, GOLD() if fresnel is None else fresnel)


def microfacets(distribution: Any, fresnel: Any = None, *, hard: tuple[Any, ...] = (), **promised: Any) -> Subject:
    """Facets of gold if nothing else is said; `hard` are more distributions."""
    own = facets(distribution, fresnel)
    return reciprocal(MICROFACET, own, hard=tuple(own._replace(distribution=d) for d in hard), **promised)


def from_above(interface: Brdf, params: InterfaceParams) -> Subject:
    """What an interface reflects upwards; it has a far side too, which its own tests ask for."""

    def evaluate(own: InterfaceParams, query: Query) -> jax.Array:
        lit = above_horizon(query.wi, query.wo)[..., None]
        return jnp.where(lit, interface.eval(own, query), 0.0)

    return reciprocal(Brdf(evaluate), params)


def effects(*parts: Any, **promised: Any) -> Subject:
    return reciprocal(STACK, parts, **promised)


def sgd() -> Subject:
    """About the authors' gold metallic paint, which promises no conservation."""
    numbers = (0.05, 0.5, 0.03, 0.8, 0.1, 0.02, 0.0, 1.0, 10.0, 0.5)
    params = SgdParams(*(jnp.full(3, value, jnp.float32) for value in numbers))
    return Subject(Material("", SGD, params, True), reciprocal=True)


def principled() -> Subject:
    params = PrincipledParams(PLAIN, number(0.4), number(1.5), *map(number, (0.3, 0.5, 0.2, 0.5, 0.5, 0.3, 0.6, 0.7)))
    return Subject(Material("", PRINCIPLED, params, False), reciprocal=True)


def of_model(name: str, *, peak: float = 1.0) -> Subject:
    """A learned model with random parameters, or an analytic one at a start of its fits; f times `peak`."""
    config = with_isotropy(config_of(name)(), False)
    brdf = brdf_of(name, config)
    if name in ANALYTIC:
        # of this key lobes are 9 : 1 at most: about a much thinner one the checks' cells are too coarse to be summed
        return Subject(Material("", brdf, ANALYTIC[name].start(jax.random.key(6), config), False), reciprocal=True)
    model = MODELS[name].build(config)
    params = random_params(1, model) if peak == 1.0 else _brightened(demanding_params(jax.random.key(0), model), peak)
    return Subject(Material("", brdf, jax.tree.map(jnp.asarray, params), False), reciprocal=is_reciprocal(name))


def of_surface(name: str) -> Subject:
    """A model over a surface with random parameters, at a place under a footprint of two texels."""
    entry = SPATIAL[name]
    sizes = entry.config()
    latents = {
        field.name: replace(getattr(sizes, field.name), height=16, width=16)
        for field in fields(sizes)
        if isinstance(getattr(sizes, field.name), LatentTexture)
    }
    model = entry.build(replace(sizes, **latents))
    params = jax.tree.map(jnp.asarray, demanding_params(jax.random.key(8), model))
    whole = Subject(
        Material("", Brdf(model.eval), params, False),
        reciprocal=entry.is_reciprocal,
        slack=partial(coordinate_slack, model, params),
    )
    return at_place(whole, (0.37, 0.61), 1.0 / 8.0)


def bundled() -> Subject:
    """A gated model with an energy scale and a sampler, as bundles have them."""
    config = with_isotropy(config_of("gated")(), True)
    model = MODELS["gated"].build(config)
    weights = jnp.asarray(np.random.default_rng(7).uniform(0.0, 0.5, (TERMS, 3)), jnp.float32)
    parts = Parts(EnergyScale(weights), over_views())
    params = jax.tree.map(jnp.asarray, BundleParams(demanding_params(jax.random.key(3), model), parts))
    return Subject(Material("", assembled(Brdf(model.eval), parts), params, True), reciprocal=True)


def _brightened(params: Params, factor: float) -> Params:
    """The parameters of a model of f times `factor`: the last layer's output is ln f."""
    biases = params.mlp.biases
    mlp = Mlp(params.mlp.weights, (*biases[:-1], biases[-1] + np.float32(np.log(factor))))
    return params._replace(mlp=mlp)


def drawn_by(proposal: Proposal, params: Params, *, loss: float = 1e-4) -> Subject:
    """A proposal whose own density is the reflectance, so that value, gradient and precision are asked of it too."""
    brdf = sampled_by(proposal, partial(_density_of, proposal), lambda own: Proposed(own, own))
    return Subject(Material("", brdf, params, False), conserving=True, loss=loss)


def _density_of(proposal: Proposal, params: Params, query: Query) -> jax.Array:
    density = proposal.pdf(params, query.wi, query.wo)
    return jnp.broadcast_to(density[..., None], (*density.shape, 3))


def proxy_numbers(*numbers: float) -> ProxyParams:
    return ProxyParams(*map(number, numbers))


LEANING = proxy_numbers(0.3, 0.4, -0.2, 0.7, 0.2, 0.5, 0.6, 0.3, -0.2)
UPRIGHT = proxy_numbers(0.5, 0.1, 0.0, 0.5, 0.3, 0.2, -0.3, 0.0, 0.1)
NEXT_CELL = "a rounding takes a direction into the next cell, where the density is another"
GRID = ViewGrid(elevations=8, rows=12, columns=16)


def over_views() -> ViewProxy:
    return ViewProxy(jnp.stack([to_unconstrained(UPRIGHT), to_unconstrained(LEANING)])[None])


def tabulated() -> Subject:
    glossy = facets(Ggx(ISOTROPIC))
    return drawn_by(conditional(GRID), tabulate_conditional(GRID, MICROFACET.eval, glossy), loss=np.nan)


def built_in(name: str) -> Subject:
    return Subject(MATERIALS[name](), reciprocal=True, conserving=True)


CLAY = OrenNayarParams(RED, number(0.4))
LEANING_FACETS = Ggx(STRETCHED, colour(0.3, -0.2))
MAPPED_METAL, RECIPROCAL_METAL = normal_mapped(MICROFACET), reciprocal_normal_mapped(MICROFACET)
LEANING_METAL = NormalMappedParams(colour(2 / 11, -6 / 11, 9 / 11), facets(Ggx(ISOTROPIC)))


def grazing_slack(query: Query) -> np.ndarray:
    """What a cosine to the leaning normal loses where a direction grazes it: its products are rounded, then cancel."""
    cosines = np.asarray(query[:2], np.float64) @ np.asarray(LEANING_METAL.normal, np.float64)
    return 2.0**-23 / np.maximum(np.abs(cosines).min(axis=0), 2.0**-23)


COATED_METAL, COATED_CLAY = layered(MICROFACET), layered(OREN_NAYAR, diffuse=True)

BRDFS: Mapping[str, Row] = MappingProxyType(
    {
        "Lambert": Row(
            LAMBERT, lambda: reciprocal(LAMBERT, LambertParams(RED), hard=tuple(map(LambertParams, LEAST_COLOURS)))
        ),
        "GGX isotropic, Schlick": Row(MICROFACET, lambda: microfacets(Ggx(ISOTROPIC), Schlick(PLAIN))),
        "GGX along axes": Row(MICROFACET, lambda: microfacets(Ggx(STRETCHED), hard=(Ggx(THIN),))),
        "GGX turned, F82": Row(
            MICROFACET,
            lambda: microfacets(
                Ggx(Turned(number(0.1), number(0.4), number(0.6))), SchlickF82(PLAIN, colour(0.95, 0.9, 0.85))
            ),
        ),
        "GGX tensor, dielectric": Row(
            MICROFACET,
            lambda: microfacets(Ggx(TENSOR), Dielectric(number(1.5)), hard=tuple(map(Ggx, SINGULAR))),
        ),
        "GGX mean slope": Row(MICROFACET, lambda: microfacets(Ggx(STRETCHED, colour(0.3, -0.2)))),
        "Beckmann tensor": Row(MICROFACET, lambda: microfacets(Beckmann(TENSOR), hard=tuple(map(Beckmann, SINGULAR)))),
        "separable masking": Row(
            SEPARABLE_MICROFACET, lambda: reciprocal(SEPARABLE_MICROFACET, facets(Ggx(STRETCHED), Schlick(PLAIN)))
        ),
        "multiple scattering": Row(
            MULTIPLE_SCATTERING, lambda: reciprocal(MULTIPLE_SCATTERING, facets(Ggx(ISOTROPIC)))
        ),
        "Ashikhmin-Shirley": Row(
            ASHIKHMIN_SHIRLEY,
            lambda: reciprocal(ASHIKHMIN_SHIRLEY, AshikhminShirleyParams(STRETCHED, Schlick(PLAIN))),
        ),
        "Oren-Nayar": Row(OREN_NAYAR, lambda: reciprocal(OREN_NAYAR, CLAY)),
        "sheen": Row(SHEEN, lambda: reciprocal(SHEEN, SheenParams(RED, number(0.5)))),
        "ABC": Row(
            ABC,
            lambda: Subject(
                Material("", ABC, AbcParams(RED, colour(3.0, 2.0, 1.0), number(5.0), number(1.2), number(1.5)), True),
                reciprocal=True,
            ),
        ),
        "SGD": Row(SGD, sgd),
        "principled": Row(PRINCIPLED, principled),
        "metallic-roughness": Row(
            METALLIC_ROUGHNESS,
            lambda: reciprocal(METALLIC_ROUGHNESS, MetallicRoughnessParams(PLAIN, number(0.5), number(0.4))),
        ),
        "metallic facets, a mean slope": Row(
            METALLIC_FACETS,
            lambda: reciprocal(METALLIC_FACETS, MetallicFacetsParams(PLAIN, number(1.0), LEANING_FACETS)),
        ),
        "metallic facets, a mean slope and a body": Row(
            METALLIC_FACETS,
            lambda: Subject(
                Material("", METALLIC_FACETS, MetallicFacetsParams(RED, number(0.2), LEANING_FACETS), False),
                conserving=True,
            ),
        ),
        "substrate": Row(SUBSTRATE, lambda: reciprocal(SUBSTRATE, SubstrateParams(RED, number(1.5)))),
        "normal-mapped metal": Row(
            normal_mapped,
            lambda: Subject(Material("", MAPPED_METAL, LEANING_METAL, False), conserving=True, slack=grazing_slack),
        ),
        "normal-mapped metal, reciprocal part": Row(
            reciprocal_normal_mapped,
            lambda: Subject(Material("", RECIPROCAL_METAL, LEANING_METAL, False), reciprocal=True),
        ),
        "rough interface": Row(
            ROUGH_INTERFACE,
            lambda: from_above(ROUGH_INTERFACE, InterfaceParams(Ggx(ISOTROPIC), number(1.5))),
        ),
        "rough interface, separable": Row(
            SEPARABLE_ROUGH_INTERFACE,
            lambda: from_above(SEPARABLE_ROUGH_INTERFACE, InterfaceParams(Beckmann(ISOTROPIC), number(0.7))),
        ),
        "coated metal": Row(
            layered,
            lambda: reciprocal(
                COATED_METAL, LayeredParams(Ggx(ISOTROPIC), number(1.5), facets(Ggx(STRETCHED))), loss=1e-5
            ),
        ),
        "coated clay": Row(
            layered,
            lambda: reciprocal(
                COATED_CLAY, LayeredParams(Ggx(ISOTROPIC), number(1.5), CLAY, colour(0.1, 0.4, 1.0)), loss=1e-5
            ),
        ),
        "effects: clay, sheen": Row(STACK, lambda: effects(CLAY, SheenParams(RED, number(0.4)))),
        "effects: film, multiple scattering, coat": Row(
            STACK,
            lambda: effects(
                facets(Ggx(ISOTROPIC)),
                Film(number(300.0), number(1.4)),
                MultipleScattering(),
                Coat(Ggx(Isotropic(number(0.1))), number(1.5)),
            ),
        ),
        **{f"built-in {name}": Row(name, lambda name=name: built_in(name)) for name in MATERIALS},
    }
)

LEARNED: Mapping[str, Row] = MappingProxyType(
    {
        **{f"model {name}": Row(name, lambda name=name: of_model(name)) for name in (*MODELS, *ANALYTIC)},
        **{f"surface {name}": Row(SPATIAL[name].bundle, lambda name=name: of_surface(name)) for name in SPATIAL},
        "bundle with scale and sampler": Row(assembled, bundled),
        "model gated, peaks of 1e6": Row("gated", lambda: of_model("gated", peak=1e6)),
    }
)

ALL = mixture(COSINE, UNIFORM, VISIBLE_NORMALS)

PROPOSALS: Mapping[str, Row] = MappingProxyType(
    {
        "draws: cosine": Row(COSINE, lambda: drawn_by(COSINE, None)),
        "draws: uniform": Row(UNIFORM, lambda: drawn_by(UNIFORM, None)),
        "draws: visible normals": Row(VISIBLE_NORMALS, lambda: drawn_by(VISIBLE_NORMALS, Ggx(TENSOR))),
        "draws: tilted cosine": Row(TILTED_COSINE, lambda: drawn_by(TILTED_COSINE, Tilt(number(0.4), number(-1.0)))),
        "draws: mirrored normals": Row(MIRRORED_NORMALS, lambda: drawn_by(MIRRORED_NORMALS, normals_of(LEANING))),
        "draws: proxy": Row(PROXY, lambda: drawn_by(PROXY, LEANING)),
        "draws: visible proxy": Row(VISIBLE_PROXY, lambda: drawn_by(VISIBLE_PROXY, LEANING)),
        "draws: view proxy": Row(VIEW_PROXY, lambda: drawn_by(VIEW_PROXY, over_views())),
        "draws: visible view proxy": Row(VISIBLE_VIEW_PROXY, lambda: drawn_by(VISIBLE_VIEW_PROXY, over_views())),
        "draws: conditional table": Row(conditional, tabulated, NEXT_CELL),
        "draws: mixture": Row(
            mixture, lambda: drawn_by(ALL, MixtureParams((None, None, Ggx(STRETCHED)), colour(1.0, 0.0, 2.0)))
        ),
        "draws: defensive": Row(defensive, lambda: drawn_by(defensive(VISIBLE_NORMALS), Ggx(STRETCHED))),
    }
)

SUBJECTS: Mapping[str, Row] = MappingProxyType({**BRDFS, **LEARNED, **PROPOSALS})
