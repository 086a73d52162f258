"""Reflection and transmission at a rough dielectric interface, for directions anywhere on the sphere.

The medium above (z > 0) has index 1 and the one below eta; n(w) is the index on w's side. With the facet's normal wh

    f_r = D F G2 / (4 |cos_i| |cos_o|)                                         wh along wi + wo
    f_t = n(wo)^2 D (1 - F) G2 |wi . wh| |wo . wh| / (|cos_i| |cos_o| |s|^2)    wh along s = n(wi) wi + n(wo) wo

(Walter et al. 2007, Eqs. 16, 20 and 21; their denominator is |s|, as wh is along s).

Convention: f takes radiance to radiance, and radiance grows by n^2 on its way into a medium. So f_t(wi, wo) / n(wo)^2
is symmetric, and the weights of `sample`, which follows radiance back from wo, hold n(wo)^2 / n(wi)^2. A `Crossing` is
without it and tells what becomes of a flux along wo. Through a whole stack between equal media the factors cancel.

Masking and shadowing are correlated by height in reflection, as in `MICROFACET`, and independent in transmission, as
in Walter et al.; facets scatter once, so the interface keeps at most what falls on it.

At an index of one everything that facets do not shadow passes straight on, which `sample` does and no f can say. `eval`
and `pdf` are too low where |eta - 1| < sqrt(eps), 3e-4 in float32: the half vector is then rounding errors.

Parameters: `InterfaceParams`. Facets are sampled by visible normals, then reflection or refraction by Fresnel.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.brdf.domain import within_ranges
from jaxbrdf.core.directions import dot, reflect
from jaxbrdf.core.fresnel import INDEX, LOW_INDEX, dielectric
from jaxbrdf.core.numerics import match_rank, safe_divide, safe_norm, safe_normalize, safe_sqrt, sum_of_squares
from jaxbrdf.core.smith import (
    Distribution,
    correlated_visibility,
    lift,
    masked_area,
    reflected_density,
    separable_visibility,
)
from jaxbrdf.types import Brdf, Query, Sample

Visibility = Callable[[Distribution, jax.Array, jax.Array], jax.Array]


class InterfaceParams(NamedTuple):
    """distribution: of the facets' normals. eta: index of the medium below over that above, `()` or `(...)`."""

    distribution: Distribution
    eta: Annotated[jax.Array, INDEX]


class Crossing(NamedTuple):
    """A direction that one facet sends light to, either by reflection or by refraction.

    Attributes:
        wi: `(..., 3)`.
        pdf: density of wi given wo and which of the two it is, `(...)`.
        share: of the facet's light that goes this way, F or 1 - F.
        passed: share of it that no other facet stops, G2 / G1; zero where wi is on the wrong side.
    """

    wi: jax.Array
    pdf: jax.Array
    share: jax.Array
    passed: jax.Array


class _Refraction(NamedTuple):
    """The facet between a direction above and one below: its upward normal, both cosines to it, |s|^2."""

    wh: jax.Array
    cos_above: jax.Array
    cos_below: jax.Array
    squared: jax.Array


def turned_up(w: jax.Array) -> jax.Array:
    """w or its opposite, whichever lies above: how a microsurface that is turned over sees w."""
    return jnp.where(w[..., 2:] < 0, -w, w)


def index_across(params: InterfaceParams, w: jax.Array) -> jax.Array:
    """The index of the far side over that of w's side, `(...)`."""
    return jnp.where(w[..., 2] < 0, 1.0 / params.eta, params.eta)


def facet_transmittance(cos: jax.Array, eta: jax.Array) -> jax.Array:
    """1 - F of a smooth interface without the difference, which cancels at grazing angles; zero under total reflection.

    With g as in `jaxbrdf.core.fresnel.dielectric`, the two polarisations let 4 p g / (p + g)^2 pass, p = cos and
    p = eta^2 cos; exactly one for eta = 1.
    """
    squared = jnp.where(eta < LOW_INDEX, eta * eta - (1.0 - cos) * (1.0 + cos), (eta - 1.0) * (eta + 1.0) + cos * cos)
    g, dense = safe_sqrt(squared), eta * eta * cos
    across = safe_divide(cos, cos + g) * safe_divide(g, cos + g)
    along = safe_divide(dense, dense + g) * safe_divide(g, dense + g)
    return 2.0 * (across + along)


def reflection(params: InterfaceParams, wi: jax.Array, wo: jax.Array, *, visibility: Visibility) -> jax.Array:
    """f_r `(...)` for two directions on one side; zero for others."""
    light, view = lift(turned_up(wi)), lift(turned_up(wo))
    both = light + view
    cos = jnp.minimum(0.5 * safe_norm(both), 1.0)
    reflectance = dielectric(cos, index_across(params, wo))
    lobe = params.distribution.density(safe_normalize(both)) * visibility(params.distribution, light, view)
    return jnp.where(_on_one_side(wi, wo), reflectance * lobe, 0.0)


def transmission(params: InterfaceParams, wi: jax.Array, wo: jax.Array) -> jax.Array:
    """f_t / n(wo)^2, `(...)`, for directions on two sides, the same to the last bit when they change places."""
    above, below = _above_and_below(wi, wo)
    facet = _refracting_facet(params.eta, above, below)
    passed = 4.0 * separable_visibility(params.distribution, above, below) * params.distribution.density(facet.wh)
    share = facet_transmittance(facet.cos_above, params.eta)
    f = passed * share * facet.cos_above * facet.cos_below / facet.squared
    return jnp.where(_on_two_sides(wi, wo), f, 0.0)


def transmitted_density(params: InterfaceParams, wi: jax.Array, wo: jax.Array) -> jax.Array:
    """Density of wi among what is refracted from wo, `(...)`: visible facets by Walter et al.'s Eq. 17."""
    above, below = _above_and_below(wi, wo)
    facet = _refracting_facet(params.eta, above, below)
    from_above = wo[..., 2] > 0
    view = jnp.where(from_above[..., None], above, below)
    # n(wi)^2 <wi, wh> and <wo, wh>
    stretched = jnp.where(from_above, params.eta * params.eta * facet.cos_below, facet.cos_above)
    facing = jnp.where(from_above, facet.cos_above, facet.cos_below)
    visible = 4.0 * reflected_density(params.distribution, facet.wh, view)
    return jnp.where(_on_two_sides(wi, wo), visible * facing * stretched / facet.squared, 0.0)


def reflect_at(params: InterfaceParams, wo: jax.Array, wh: jax.Array, *, visibility: Visibility) -> Crossing:
    """wo reflected by the facet of upward normal wh, which wo sees."""
    view = lift(turned_up(wo))
    cos = jnp.clip(dot(view, wh), 0.0, 1.0)
    light = reflect(view, wh)
    right = light[..., 2] > 0
    seen = 4.0 * params.distribution.projected_area(view) * light[..., 2]
    passed = seen * visibility(params.distribution, lift(light), view)
    density = reflected_density(params.distribution, wh, view)
    share = dielectric(cos, index_across(params, wo))
    return Crossing(_as_side_of(wo, light), jnp.where(right, density, 0.0), share, jnp.where(right, passed, 0.0))


def refract_at(params: InterfaceParams, wo: jax.Array, wh: jax.Array) -> Crossing:
    """wo refracted by the facet of upward normal wh, which wo sees; of share zero under total reflection."""
    view = lift(turned_up(wo))
    eta = index_across(params, wo)
    cos = jnp.clip(dot(view, wh), 0.0, 1.0)
    excess = (eta - 1.0) * (eta + 1.0)
    far = safe_sqrt(excess + cos * cos)  # eta times the cosine beyond
    light = (cos - far)[..., None] * wh - view
    light = safe_normalize(light)
    right = (light[..., 2] < 0) & (far > 0)
    passed = -light[..., 2] / masked_area(params.distribution, lift(-light))
    passed = passed * params.distribution.projected_area(view) / masked_area(params.distribution, view)
    # |s| / n(wo) = |cos - far|, by the difference of their squares
    length = safe_divide(excess, cos + far)
    squared = jnp.maximum(length * length, jnp.finfo(view.dtype).eps)
    density = 4.0 * reflected_density(params.distribution, wh, view) * cos * eta * far / squared
    share = facet_transmittance(cos, eta)
    return Crossing(_as_side_of(wo, light), jnp.where(right, density, 0.0), share, jnp.where(right, passed, 0.0))


def rough_interface(visibility: Visibility) -> Brdf:
    """The interface with this masking and shadowing of its reflection, as a `Brdf` record on the whole sphere."""

    def evaluate(params: InterfaceParams, query: Query) -> jax.Array:
        wi, wo = query.wi, query.wo
        through = jnp.where(wo[..., 2] < 0, params.eta * params.eta, 1.0) * transmission(params, wi, wo)
        f = reflection(params, wi, wo, visibility=visibility) + through
        return jnp.broadcast_to(f[..., None], (*f.shape, 3))

    def sample(params: InterfaceParams, query: Query, u: jax.Array) -> Sample:
        wo = query.wo
        wh = params.distribution.sample_visible(lift(turned_up(wo)), u[..., 1:])
        kept, passed = reflect_at(params, wo, wh, visibility=visibility), refract_at(params, wo, wh)
        back = u[..., 0] < kept.share
        eta = index_across(params, wo)
        weight = jnp.where(back, kept.passed, passed.passed / (eta * eta))
        density = jnp.where(back, kept.share * kept.pdf, passed.share * passed.pdf)
        wi = jnp.where(back[..., None], kept.wi, passed.wi)
        return Sample(wi, density, jnp.broadcast_to(weight[..., None], wi.shape))

    return within_ranges(Brdf(evaluate, sample, _pdf))


def _pdf(params: InterfaceParams, query: Query) -> jax.Array:
    wi, wo = query.wi, query.wo
    light, view = lift(turned_up(wi)), lift(turned_up(wo))
    both = light + view
    share = dielectric(jnp.minimum(0.5 * safe_norm(both), 1.0), index_across(params, wo))
    kept = share * reflected_density(params.distribution, safe_normalize(both), view)
    facet = _refracting_facet(params.eta, *_above_and_below(wi, wo))
    passed = facet_transmittance(facet.cos_above, params.eta) * transmitted_density(params, wi, wo)
    return jnp.where(_on_one_side(wi, wo), kept, passed)


def _refracting_facet(eta: jax.Array, above: jax.Array, below: jax.Array) -> _Refraction:
    """The facet between `above` and minus `below`, both of which point up; cosines zero where there is none.

    Everything is written in above - below, which is exact where the two almost meet, and eta - 1.
    """
    straight = above - below
    s = straight - match_rank((eta - 1.0)[..., None], below.ndim) * below
    up = jnp.where(s[..., 2:] < 0, -1.0, 1.0)
    squared = sum_of_squares(s)
    length = safe_sqrt(squared)
    opposed = 0.5 * sum_of_squares(straight)  # 1 - above . below
    cos_above = safe_divide(up[..., 0] * (opposed + (eta - 1.0) * (opposed - 1.0)), length)
    cos_below = safe_divide(-up[..., 0] * (opposed + (eta - 1.0)), length)
    exists = (cos_above > 0) & (cos_below > 0)
    floor = jnp.finfo(squared.dtype).eps
    return _Refraction(
        safe_normalize(up * s),
        jnp.where(exists, jnp.minimum(cos_above, 1.0), 0.0),
        jnp.where(exists, jnp.minimum(cos_below, 1.0), 0.0),
        jnp.maximum(squared, floor),
    )


def _above_and_below(wi: jax.Array, wo: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Of two directions on two sides the upper one, and the lower one turned up."""
    from_above = wo[..., 2:] > 0
    above, below = jnp.where(from_above, wo, wi), jnp.where(from_above, wi, wo)
    return lift(turned_up(above)), lift(turned_up(below))


def _as_side_of(wo: jax.Array, w: jax.Array) -> jax.Array:
    """w, given for a view from above, as it is for wo."""
    return jnp.where(wo[..., 2:] < 0, -w, w)


def _on_one_side(wi: jax.Array, wo: jax.Array) -> jax.Array:
    return ((wi[..., 2] > 0) & (wo[..., 2] > 0)) | ((wi[..., 2] < 0) & (wo[..., 2] < 0))


def _on_two_sides(wi: jax.Array, wo: jax.Array) -> jax.Array:
    return ((wi[..., 2] > 0) & (wo[..., 2] < 0)) | ((wi[..., 2] < 0) & (wo[..., 2] > 0))


ROUGH_INTERFACE = rough_interface(correlated_visibility)
"""Reflection with masking and shadowing correlated by height (Heitz 2014, Eq. 99)."""

SEPARABLE_ROUGH_INTERFACE = rough_interface(separable_visibility)
"""Reflection with masking and shadowing independent of each other, as in Walter et al. (2007)."""
