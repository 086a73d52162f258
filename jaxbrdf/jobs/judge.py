"""The judgement that every command shares: errors in BRDF space and of a rendering, and the time of an evaluation."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.brdf.measured import asymmetry, clamped_share
from jaxbrdf.brdf.sampler import sampler_of
from jaxbrdf.core.directions import cos_theta
from jaxbrdf.core.numerics import safe_divide
from jaxbrdf.errors import OpenCLError
from jaxbrdf.export.bundle import Bundle
from jaxbrdf.jobs.price import QUERIES, interleaved, jax_run, opencl_run, timed_query
from jaxbrdf.jobs.source import Source
from jaxbrdf.metrics.brdf_space import BrdfErrors, compare_many
from jaxbrdf.metrics.image import image_errors
from jaxbrdf.opencl.material import Material as DeviceMaterial
from jaxbrdf.opencl.platform import choose, context_of, describe
from jaxbrdf.render.environment import make_environment
from jaxbrdf.render.integrate import render_environment
from jaxbrdf.render.proposal import with_sampler
from jaxbrdf.render.studio import studio
from jaxbrdf.sampling.pairs import draw_weighted
from jaxbrdf.types import Brdf, Material, Params, Query, Sample

JUDGING_SEED = 20_260_101
"""Draws that no fit's seed reaches: fits fold their seed, judges do not."""

TIMED_RUNS = 7


class Pictures(NamedTuple):
    """The fit and its reference under one light, linear Rec.709 `(H, W, 3)`."""

    fit: np.ndarray
    reference: np.ndarray


def brdf_errors(materials: dict[str, Material], truth: Callable[[Query], jax.Array]) -> dict[str, BrdfErrors]:
    """Each material's errors against `truth` on the same pairs (docs/conventions.md)."""
    compiled = {name: jax.jit(partial(m.brdf.eval, m.params)) for name, m in materials.items()}
    return compare_many(jax.random.key(JUDGING_SEED), compiled, truth, draw_weighted)


def plain_errors(errors: BrdfErrors) -> dict[str, float]:
    """Values and standard errors by name, for reports."""
    estimates = {name: getattr(errors, name) for name in ("mae", "smape", "rmse", "log_rmse")}
    values = {name: float(e.value) for name, e in estimates.items()}
    return values | {f"{name}_standard_error": float(e.standard_error) for name, e in estimates.items()}


def render_pair(fit: Material, reference: Material, *, size: int = 192, samples: int = 64) -> Pictures:
    """Both on a sphere in the built-in studio, under the same light directions."""
    return render_many({"": fit}, reference, size=size, samples=samples)[""]


def render_many(
    fits: dict[str, Material], reference: Material, *, size: int = 192, samples: int = 64
) -> dict[str, Pictures]:
    """`render_pair` of several fits, the reference rendered once."""
    render = partial(
        render_environment,
        jax.random.key(JUDGING_SEED),
        environment=make_environment(studio()),
        height=size,
        width=size,
        samples=samples,
    )
    beside = render(reference)
    return {name: Pictures(render(drawn_as(reference, fit)), beside) for name, fit in fits.items()}


def drawn_as(reference: Material, material: Material) -> Material:
    """The material with the reference's draws of light, so that their pictures share their noise: it is no error."""
    draw, density = sampler_of(with_sampler(reference.brdf))

    def evaluate(params: Params, query: Query) -> jax.Array:
        return material.brdf.eval(params[0], query)

    def sample(params: Params, query: Query, u: jax.Array) -> Sample:
        wi, pdf, _ = draw(params[1], query, u)
        value = evaluate(params, query._replace(wi=wi))
        return Sample(wi, pdf, value * safe_divide(jnp.maximum(cos_theta(wi), 0.0), pdf)[..., None])

    brdf = Brdf(evaluate, sample, lambda params, query: density(params[1], query))
    return material._replace(brdf=brdf, params=(material.params, reference.params))


def picture_errors(pictures: Pictures) -> dict[str, float]:
    """Errors of the fit's rendering by name."""
    return {f"image_{name}": value for name, value in image_errors(*pictures)._asdict().items()}


def evaluation_cost(bundle: Bundle) -> dict[str, float]:
    """Nanoseconds an evaluation: jitted JAX on this processor, and OpenCL's best device where there is one."""
    query = timed_query()
    runs = {"jax": jax_run(bundle, query)}
    with contextlib.suppress(OpenCLError):
        run = opencl_run(DeviceMaterial.load(bundle, context_of(choose())), query)
        run()
        runs["opencl"] = run
    times = interleaved(runs, TIMED_RUNS)
    return {f"{name}_ns_per_evaluation": 1e9 * float(np.median(of)) / QUERIES for name, of in times.items()}


def opencl_device() -> str:
    """The name of the device that `evaluation_cost` times, or why there is none."""
    try:
        return describe(choose())
    except OpenCLError as error:
        return str(error)


def describe_truth(source: Source) -> dict[str, Any]:
    """What symmetrising and clamping change in a measured material."""
    return {
        "name": source.material.name,
        "isotropic": source.material.isotropic,
        "clamped_share": clamped_share(source.material),
        "asymmetry": asymmetry(source.material),
    }
