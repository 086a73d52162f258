"""A material as the list of the effects it has, from the bottom up.

An effect is a record of parameters, and its type says what it does. Bodies and lobes are added to what is there; what
lies on top dims what is beneath, on the light's way in and on its way out, and adds its own light:

    f = f_top + passed(wi) passed(wo) f_beneath

`Film` and `MultipleScattering` belong to the facets before them in the list: one changes their reflectance, one gives
back what they lose. So

    compose(ggx(alpha, alpha, Conductor(eta, k)), Film(thickness, index), MultipleScattering(), SheenParams(colour, r))

is a tarnished metal under dust. The types of the records decide what is traced: what a material does not have costs
nothing, and an effect at its neutral value gives what its absence gives.

Each layer is as good as its own file says. What is put together here is reciprocal if they are, and a stack returns no
more than it gets if its body does not and each top returns no more than it keeps from passing.

A new effect is a function from a record and the layers beneath it to the layers with it, and a row in `EFFECTS`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial, reduce
from types import MappingProxyType
from typing import Annotated, Any, NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.brdf.lambert import LAMBERT, LambertParams
from jaxbrdf.brdf.microfacet import MICROFACET, MicrofacetParams
from jaxbrdf.brdf.multiple_scattering import MULTIPLE_SCATTERING
from jaxbrdf.brdf.oren_nayar import OREN_NAYAR, OrenNayarParams
from jaxbrdf.brdf.sampler import sampler_of
from jaxbrdf.brdf.sheen import SHEEN, SheenParams
from jaxbrdf.brdf.substrate import SUBSTRATE, SubstrateParams
from jaxbrdf.core.directions import cos_theta
from jaxbrdf.core.fresnel import Conductor, Dielectric, dielectric
from jaxbrdf.core.numerics import match_rank, safe_divide
from jaxbrdf.core.ranges import Range, clamp
from jaxbrdf.core.smith import Distribution, lift
from jaxbrdf.core.thin_film import FILM_INDEX, THICKNESS, ThinFilm
from jaxbrdf.sampling.mixture import blend, choose
from jaxbrdf.types import Brdf, Params, Query, Sample

LEAST_CHANCE = 0.01
"""Of a layer, up to the common factor: black at the viewer's angle does not mean black at the facet's."""


class Film(NamedTuple):
    """A transparent film on the facets beneath, which must be of a `Conductor` or a `Dielectric`; none at thickness 0.

    Attributes:
        thickness: nanometres, `()` or `(...)`.
        eta: refractive index over that of the outside, `()` or `(...)`.
    """

    thickness: Annotated[jax.Array, THICKNESS]
    eta: Annotated[jax.Array, FILM_INDEX]


class MultipleScattering(NamedTuple):
    """What the facets beneath lose by scattering once only; they have no mean slope."""


class Coat(NamedTuple):
    """A clear coat on all that is beneath; none at eta = 1.

    Light passes it straight on, by the smooth surface's Fresnel share on its way in and out, and none comes back down.

    Attributes:
        distribution: of its facets.
        eta: refractive index over that of the outside, `()` or `(...)`.
    """

    distribution: Distribution
    eta: Annotated[jax.Array, Range(1.0, 1e3)]


class Layer(NamedTuple):
    """One reflecting part of a stack.

    Attributes:
        brdf, params: what it reflects itself.
        albedo: about how much that is, `query -> (..., 3)`, by which draws are shared out.
        passed: share of the light along w that reaches what is beneath or leaves it, `w -> (..., 3)` or `(..., 1)`;
            None for what lies beside it and takes nothing away.
    """

    brdf: Brdf
    params: Params
    albedo: Callable[[Query], jax.Array]
    passed: Callable[[jax.Array], jax.Array] | None = None


Layers = tuple[Layer, ...]


def compose(*effects: Any) -> tuple[Brdf, Params]:
    """The BRDF of these effects, from the bottom up, and its parameters: the effects themselves.

    Raises:
        ValueError: no effects, one of an unknown type, or one that needs other facets beneath it.
    """
    if not effects:
        raise ValueError("effects is empty; a material needs at least one")
    for index, effect in enumerate(effects):
        if type(effect) not in EFFECTS:
            known = ", ".join(sorted(kind.__name__ for kind in EFFECTS))
            raise ValueError(f"effects[{index}] is a {type(effect).__name__}; it must be one of {known}")
    _layers(effects)
    return STACK, effects


def _layers(effects: tuple[Any, ...]) -> Layers:
    return reduce(lambda beneath, effect: EFFECTS[type(effect)](effect, beneath), effects, ())


def _eval(effects: tuple[Any, ...], query: Query) -> jax.Array:
    first, *rest = _layers(effects)
    f = first.brdf.eval(first.params, query)
    for layer in rest:
        dimmed = f if layer.passed is None else f * layer.passed(query.wi) * layer.passed(query.wo)
        f = layer.brdf.eval(layer.params, query) + dimmed
    return f


def _pdf(effects: tuple[Any, ...], query: Query) -> jax.Array:
    layers = _layers(effects)
    densities = [sampler_of(layer.brdf).pdf(layer.params, query) for layer in layers]
    return densities[0] if len(layers) == 1 else blend(_chances(layers, query), densities)


def _sample(effects: tuple[Any, ...], query: Query, u: jax.Array) -> Sample:
    layers = _layers(effects)
    if len(layers) == 1:
        return sampler_of(layers[0].brdf).sample(layers[0].params, query, u)
    wi = choose(_chances(layers, query), [partial(_draw, layer, query) for layer in layers], u)
    drawn = query._replace(wi=wi)
    density = _pdf(effects, drawn)
    gain = safe_divide(jnp.maximum(cos_theta(wi), 0.0), density)
    return Sample(wi, density, _eval(effects, drawn) * gain[..., None])


def _draw(layer: Layer, query: Query, u: jax.Array) -> jax.Array:
    return sampler_of(layer.brdf).sample(layer.params, query, u).wi


def _chances(layers: Layers, query: Query) -> jax.Array:
    """About what each layer adds to the light towards wo, `(..., n)`."""
    shares: list[jax.Array] = []
    for layer in layers:
        if layer.passed is not None:
            # on the way in too, as if at the same angle
            passed = layer.passed(query.wo)
            shares = [share * passed * passed for share in shares]
        shares.append(layer.albedo(query))
    whole = query.wo.shape
    grey = [jnp.mean(jnp.broadcast_to(share, whole), axis=-1) for share in shares]
    return jnp.maximum(jnp.stack(grey, axis=-1), LEAST_CHANCE)


STACK = Brdf(_eval, _sample, _pdf)
"""Of every list of effects; its parameters are the list, a tuple of records."""


def _lambert(own: LambertParams, beneath: Layers) -> Layers:
    return (*beneath, Layer(LAMBERT, own, partial(_body_albedo, own)))


def _substrate(own: SubstrateParams, beneath: Layers) -> Layers:
    return (*beneath, Layer(SUBSTRATE, own, partial(_body_albedo, own)))


def _body_albedo(own: LambertParams | SubstrateParams, query: Query) -> jax.Array:
    return match_rank(own.albedo, query.wo.ndim)


def _oren_nayar(own: OrenNayarParams, beneath: Layers) -> Layers:
    return (*beneath, Layer(OREN_NAYAR, own, partial(_own_albedo, OREN_NAYAR, own)))


def _microfacet(own: MicrofacetParams, beneath: Layers) -> Layers:
    return (*beneath, Layer(MICROFACET, own, lambda query: own.fresnel.reflectance(_cosine(query.wo))))


def _film(own: Film, beneath: Layers) -> Layers:
    facets = _facets(own, beneath)
    base = facets.fresnel
    if isinstance(base, Dielectric):
        base = Conductor(base.eta[..., None], jnp.zeros_like(base.eta)[..., None])
    if not isinstance(base, Conductor):
        raise ValueError(f"Film lies on facets of {type(base).__name__}; they must be of Conductor or Dielectric")
    coated = facets._replace(fresnel=ThinFilm(own.thickness, own.eta, base))
    return _microfacet(coated, beneath[:-1])


def _multiple_scattering(own: MultipleScattering, beneath: Layers) -> Layers:
    facets = _facets(own, beneath)
    return (*beneath, Layer(MULTIPLE_SCATTERING, facets, partial(_own_albedo, MULTIPLE_SCATTERING, facets)))


def _sheen(own: SheenParams, beneath: Layers) -> Layers:
    albedo = partial(_own_albedo, SHEEN, own)
    # the integral over either direction is that over the other
    return (*beneath, Layer(SHEEN, own, albedo, lambda w: 1.0 - albedo(Query(w, w))))


def _coat(own: Coat, beneath: Layers) -> Layers:
    own = clamp(own)

    def reflected(w: jax.Array) -> jax.Array:
        return dielectric(_cosine(w), own.eta)[..., None]

    surface = MicrofacetParams(own.distribution, Dielectric(own.eta))
    return (*beneath, Layer(MICROFACET, surface, lambda query: reflected(query.wo), lambda w: 1.0 - reflected(w)))


def _facets(own: Any, beneath: Layers) -> MicrofacetParams:
    """The parameters of the facets that an effect belongs to."""
    last = beneath[-1] if beneath else None
    if last is not None and last.brdf is MICROFACET and last.passed is None:
        return last.params
    raise ValueError(f"{type(own).__name__} must follow microfacets in the list of effects")


def _own_albedo(brdf: Brdf, own: Params, query: Query) -> jax.Array:
    if brdf.albedo is None:
        raise ValueError("brdf has no albedo; a layer that is weighed by its albedo needs one")
    return brdf.albedo(own, query)


def _cosine(w: jax.Array) -> jax.Array:
    return jnp.minimum(cos_theta(lift(w)), 1.0)


EFFECTS: Mapping[type, Callable[[Any, Layers], Layers]] = MappingProxyType(
    {
        LambertParams: _lambert,
        OrenNayarParams: _oren_nayar,
        SubstrateParams: _substrate,
        MicrofacetParams: _microfacet,
        Film: _film,
        MultipleScattering: _multiple_scattering,
        SheenParams: _sheen,
        Coat: _coat,
    }
)
"""What each kind of record does to the layers beneath it."""
