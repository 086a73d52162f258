"""Compare the closed-form BRDFs with Mitsuba's plugins, value and density, and write the figures.

Usage: python experiments/check_brdfs_against_mitsuba.py [OUTPUT.json]
Both sides get the same pairs, half of them cosine-distributed and half crowded about the mirror direction, with cosines
above 1e-3. A difference is relative to the larger value. Where the two are known to differ by a factor, the figures are
given with the difference as it is and with the factor taken out. Beside them stands how far this project's float32 is
from its own float64 on the same rounded numbers, which tells whose rounding a difference is.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import drjit as dr
import jax
import jax.numpy as jnp
import mitsuba as mi
import numpy as np
from scipy.special import erf

from jaxbrdf.brdf.lambert import LAMBERT, LambertParams
from jaxbrdf.brdf.microfacet import SEPARABLE_MICROFACET, MicrofacetParams
from jaxbrdf.brdf.principled import PRINCIPLED, PrincipledParams
from jaxbrdf.brdf.substrate import SUBSTRATE, SubstrateParams
from jaxbrdf.core.beckmann import Beckmann
from jaxbrdf.core.fresnel import Conductor, Dielectric, diffuse_reflectance
from jaxbrdf.core.ggx import Ggx
from jaxbrdf.core.roughness import Axes
from jaxbrdf.sampling.pairs import draw_pairs
from jaxbrdf.types import Brdf, Query

PAIRS = 100_000
SEED = 0
LEAST_COSINE = 1e-3
LIBRARY = "/usr/lib/x86_64-linux-gnu/libLLVM.so.19.1"
OUTPUT = Path(__file__).parent / "results" / "mitsuba_brdfs.json"

GOLD = ((0.223, 0.428, 1.335), (3.204, 2.460, 1.872))
ALBEDO = (0.7, 0.3, 0.05)
ETA = 1.5
ALPHAS = ((0.01, 0.01), (0.1, 0.1), (0.3, 0.3), (1.0, 1.0), (0.08, 0.35), (0.5, 0.05))
SHADED = ("metallic", "anisotropic", "spec_tint", "sheen", "sheen_tint", "flatness", "clearcoat", "clearcoat_gloss")
LEAST_ROUGHNESS = (1e-3 / 0.1**0.5) ** 0.5
"""From here on no alpha of the plugin's is raised to its least, 1e-3, at any anisotropy."""


class Answer(NamedTuple):
    """f `(n, 3)` without a cosine, and the density of wi given wo, `(n,)`."""

    value: np.ndarray
    density: np.ndarray


class Case(NamedTuple):
    """A plugin and what is compared with it.

    Attributes:
        plugin: as Mitsuba's dictionary.
        brdf, params: this project's.
        lobes: name of the flag of those that the plugin is asked for.
        factor: `query -> Answer`, theirs over ours where that is known.
        why: what the factor is.
    """

    plugin: dict[str, Any]
    brdf: Brdf
    params: Any
    lobes: str = "All"
    factor: Callable[[Query], Answer] | None = None
    why: str = ""


def draw_queries(count: int, seed: int) -> Query:
    """Pairs with cosines above `LEAST_COSINE`."""
    pairs = jax.jit(draw_pairs, static_argnums=1)(jax.random.key(seed), 3 * count)
    high = np.flatnonzero((pairs.wi[:, 2] > LEAST_COSINE) & (pairs.wo[:, 2] > LEAST_COSINE))
    pick = np.random.default_rng(seed).permutation(high)[:count]
    return Query(pairs.wi[pick], pairs.wo[pick])


def cases() -> dict[str, Case]:
    """Every comparison with parameters of its own, by name."""
    found = {}
    for alpha in ALPHAS:
        for name, normals in (("ggx", Ggx), ("beckmann", Beckmann)):
            found[f"roughconductor {name} {alpha[0]:g} {alpha[1]:g}"] = _rough_conductor(name, normals, alpha)
    for alpha in (0.05, 0.4):
        found[f"roughdielectric ggx {alpha:g}"] = _interface("roughdielectric", alpha)
        found[f"roughplastic ggx {alpha:g}, interface"] = _interface("roughplastic", alpha)
    found["plastic, body"] = _plastic()
    found["diffuse"] = Case({"type": "diffuse", "reflectance": _rgb(ALBEDO)}, LAMBERT, LambertParams(jnp.array(ALBEDO)))
    return found


def _rough_conductor(name: str, normals: type, alpha: tuple[float, float]) -> Case:
    eta, k = GOLD
    plugin = {"type": "roughconductor", "distribution": name, "eta": _rgb(eta), "k": _rgb(k)}
    plugin |= {"alpha_u": alpha[0], "alpha_v": alpha[1]}
    params = MicrofacetParams(normals(Axes(*map(jnp.array, alpha))), Conductor(jnp.array(eta), jnp.array(k)))
    if normals is Ggx:
        return Case(plugin, SEPARABLE_MICROFACET, params)
    why = "Walter et al.'s rational masking over the exact one"
    return Case(plugin, SEPARABLE_MICROFACET, params, "All", lambda query: _rational_masking(query, alpha), why)


def _interface(plugin: str, alpha: float) -> Case:
    params = MicrofacetParams(Ggx(Axes(jnp.array(alpha), jnp.array(alpha))), Dielectric(jnp.array(ETA)))
    names = {"type": plugin, "distribution": "ggx", "alpha": alpha, "int_ior": ETA, "ext_ior": 1.0}
    return Case(names, SEPARABLE_MICROFACET, params, "GlossyReflection")


def _plastic() -> Case:
    names = {"type": "plastic", "diffuse_reflectance": _rgb(ALBEDO), "int_ior": ETA, "ext_ior": 1.0, "nonlinear": True}
    why = "their fit of the diffuse reflectance from within over its integral"
    params = SubstrateParams(jnp.array(ALBEDO), jnp.array(ETA))
    return Case(names, SUBSTRATE, params, "DiffuseReflection", _fitted_reflectance, why)


def _rgb(values: tuple[float, ...]) -> dict[str, Any]:
    return {"type": "rgb", "value": list(values)}


def _rational_masking(query: Query, alpha: tuple[float, float]) -> Answer:
    """Walter et al.'s (2007) rational fit of G1 over G1 itself, at wi and wo; the density has wo's alone."""

    def ratio(w: jax.Array) -> np.ndarray:
        x, y, z = np.asarray(w, np.float64).T
        a = z / np.maximum(np.hypot(alpha[0] * x, alpha[1] * y), 1e-30)
        rational = np.where(a < 1.6, (3.535 * a + 2.181 * a**2) / (1 + 2.276 * a + 2.577 * a**2), 1.0)
        return rational * 0.5 * (1 + erf(a) + np.exp(-(np.minimum(a, 30.0) ** 2)) / (a * np.sqrt(np.pi)))

    return Answer((ratio(query.wi) * ratio(query.wo))[:, None], ratio(query.wo))


def _fitted_reflectance(query: Query) -> Answer:
    """(1 - albedo R) of the integral over the same of Mitsuba's fit."""
    within = 1.0 - (1.0 - float(diffuse_reflectance(jnp.array(ETA)))) / ETA**2
    fitted = float(np.asarray(mi.fresnel_diffuse_reflectance(mi.Float(1.0 / ETA))).ravel()[0])
    albedo = np.array(ALBEDO)
    value = np.broadcast_to((1.0 - albedo * within) / (1.0 - albedo * fitted), query.wi.shape)
    return Answer(value, np.ones(len(query.wi)))


def random_principled(count: int, seed: int) -> PrincipledParams:
    """Parameters for every query, each uniform."""
    rng = np.random.default_rng(seed)
    shares = {name: rng.random(count) for name in SHADED}
    roughness, eta = rng.uniform(LEAST_ROUGHNESS, 1.0, count), rng.uniform(1.01, 2.0, count)
    params = PrincipledParams(rng.random((count, 3)), roughness, eta, **shares)
    return jax.tree.map(lambda x: jnp.asarray(x, jnp.float32), params)


def mitsubas(plugin: mi.BSDF, query: Query, *, lobes: str = "All", uv: np.ndarray | None = None) -> Answer:
    """All queries at once, in a variant for arrays."""
    context, surface = mi.BSDFContext(), dr.zeros(mi.SurfaceInteraction3f, len(query.wi))
    context.type_mask = getattr(mi.BSDFFlags, lobes)
    surface.wi = mi.Vector3f(np.asarray(query.wo).T)
    if uv is not None:
        surface.uv = mi.Point2f(uv.T)
    light = mi.Vector3f(np.asarray(query.wi).T)
    value = np.asarray(plugin.eval(context, surface, light)).T / np.asarray(query.wi)[:, 2:]
    return Answer(value, np.asarray(plugin.pdf(context, surface, light)))


def textured_principled(params: PrincipledParams) -> tuple[mi.BSDF, np.ndarray]:
    """The plugin with a texel for every query, and where it lies."""
    count = len(params.roughness)
    textures = {name: _texture(value) for name, value in params._asdict().items() if name != "eta"}
    plugin = mi.load_dict({"type": "principled", "eta": ETA} | textures)
    scene = mi.traverse(plugin)
    scene["eta"] = mi.Float(np.asarray(params.eta))
    scene.update()
    return plugin, np.stack([(np.arange(count) + 0.5) / count, np.full(count, 0.5)], axis=-1)


def _texture(values: jax.Array) -> dict[str, Any]:
    bitmap = mi.Bitmap(np.array(values).reshape(1, len(values), -1))
    return {"type": "bitmap", "bitmap": bitmap, "raw": True, "filter_type": "nearest", "format": "variant"}


def ours(brdf: Brdf, params: Any, query: Query) -> Answer:
    """This project's answer, in the dtype of its arguments."""
    return Answer(np.asarray(jax.jit(brdf.eval)(params, query)), np.asarray(jax.jit(brdf.pdf)(params, query)))


def in_float64(brdf: Brdf, params: Any, query: Query) -> Answer:
    """The same rounded numbers, in float64."""
    with jax.enable_x64(True):
        params, query = jax.tree.map(lambda x: jnp.asarray(np.asarray(x), jnp.float64), (params, query))
        return ours(brdf, params, query)


def relative(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """|one - other| / max(one, other), zero where both are zero."""
    larger = np.maximum(one, other)
    return np.abs(one - other) / np.where(larger > 0, larger, 1.0)


def figures(one: Answer, other: Answer, *, kept: np.ndarray) -> dict[str, dict[str, float]]:
    """Quantiles of the relative differences of value and density, over the pairs that are kept."""
    pairs = zip(Answer._fields, one, other, strict=True)
    return {name: _quantiles(relative(mine[kept], theirs[kept])) for name, mine, theirs in pairs}


def _quantiles(error: np.ndarray) -> dict[str, float]:
    return {"median": float(np.median(error)), "p99": float(np.quantile(error, 0.99)), "max": float(error.max())}


def lit(theirs: Answer) -> np.ndarray:
    """Where the plugin has a value: it gives none where its density of normals is below 1e-20."""
    return (theirs.density > 0) & (theirs.value > 0).all(-1)


def compare(case: Case, query: Query) -> dict[str, Any]:
    """The figures of one case."""
    theirs = mitsubas(mi.load_dict(case.plugin), query, lobes=case.lobes)
    mine = ours(case.brdf, case.params, query)
    kept = lit(theirs)
    # max of an empty selection: nothing is left out
    left_out = float(np.max(mine.value[~kept], initial=0.0))
    report: dict[str, Any] = {"share": float(kept.mean()), "largest value left out": left_out}
    report["difference"] = figures(mine, theirs, kept=kept)
    if case.factor is not None:
        factor = case.factor(query)
        scaled = Answer(mine.value * factor.value, mine.density * factor.density)
        report |= {"factor": case.why, "difference without the factor": figures(scaled, theirs, kept=kept)}
    return report | {"own rounding": figures(mine, in_float64(case.brdf, case.params, query), kept=kept)}


def compare_principled(query: Query) -> dict[str, Any]:
    """The figures of the principled BRDF with parameters of its own for every pair.

    The plugin writes the denominator of the coat's GTR1, sin_h^2 + alpha^2 cos_h^2, as 1 + (alpha^2 - 1) cos_h^2, which
    leaves an error of float32's epsilon over it; pairs where it is above 1e-3 are given apart.
    """
    params = random_principled(len(query.wi), SEED)
    plugin, uv = textured_principled(params)
    theirs, mine = mitsubas(plugin, query, uv=uv), ours(PRINCIPLED, params, query)
    every, kept = np.ones(len(query.wi), bool), coat_spread(params, query) > 1e-3
    return {
        "difference": figures(mine, theirs, kept=every),
        "share without the coat's cancellation": float(kept.mean()),
        "difference without the coat's cancellation": figures(mine, theirs, kept=kept),
        "own rounding": figures(mine, in_float64(PRINCIPLED, params, query), kept=every),
    }


def coat_spread(params: PrincipledParams, query: Query) -> np.ndarray:
    """sin_h^2 + alpha^2 cos_h^2 of the coat, `(n,)`."""
    wh = np.asarray(query.wi, np.float64) + np.asarray(query.wo, np.float64)
    wh /= np.linalg.norm(wh, axis=-1, keepdims=True)
    alpha = 0.1 - 0.099 * np.asarray(params.clearcoat_gloss)
    return wh[:, 0] ** 2 + wh[:, 1] ** 2 + (alpha * wh[:, 2]) ** 2


def main() -> None:
    output = Path(sys.argv[1]) if len(sys.argv) > 1 else OUTPUT
    os.environ.setdefault("DRJIT_LIBLLVM_PATH", LIBRARY)
    mi.set_variant("llvm_ad_rgb")
    query = draw_queries(PAIRS, SEED)
    found = {name: compare(case, query) for name, case in cases().items()}
    found["principled, random parameters"] = compare_principled(query)
    for name, report in found.items():
        for kind, values in report.items():
            if isinstance(values, dict):
                shown = (f"{part} {values[part]['median']:.1e} {values[part]['p99']:.1e}" for part in Answer._fields)
                print(f"{name:36} {kind:44} {'  '.join(shown)}")
    report = {"reference": f"Mitsuba {mi.__version__}, llvm_ad_rgb", "pairs": PAIRS, "seed": SEED, "cases": found}
    output.parent.mkdir(parents=True, exist_ok=True)
    output.write_text(json.dumps(report, indent=1) + "\n")


if __name__ == "__main__":
    main()
