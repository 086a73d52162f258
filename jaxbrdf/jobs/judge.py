"""The judgement that every command shares: errors in BRDF space and of a rendering, and the time of an evaluation."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any, NamedTuple

import jax
import numpy as np

from jaxbrdf.brdf.measured import asymmetry, clamped_share
from jaxbrdf.errors import OpenCLError
from jaxbrdf.export.bundle import Bundle
from jaxbrdf.jobs.price import QUERIES, interleaved, jax_run, opencl_run, price_of, timed_query
from jaxbrdf.jobs.source import Source
from jaxbrdf.metrics.brdf_space import LEAST_PAIRS, BrdfErrors, TruePairs, compare_at, true_pairs
from jaxbrdf.metrics.image import image_errors
from jaxbrdf.metrics.residual_map import ResidualMap, residual_map
from jaxbrdf.opencl.material import Material as DeviceMaterial
from jaxbrdf.opencl.platform import choose, context_of, describe
from jaxbrdf.render.environment import make_environment
from jaxbrdf.render.paths import Paths, draw_paths, pictures_by
from jaxbrdf.render.studio import studio
from jaxbrdf.sampling.pairs import draw_weighted
from jaxbrdf.types import Material

JUDGING_SEED = 20_260_101
"""Draws that no fit's seed reaches: fits fold their seed, judges do not."""

PAIRS = LEAST_PAIRS
SIZE, SAMPLES = 192, 64
"""Of a judged picture: pixels a side, draws a pixel."""

TIMED_RUNS = 7

METRICS = {"mae": "mae", "smape": "smape", "rmse": "rmse", "log_rmse": "log_rmse", "flip": "image_flip"}
"""What a budget or a plot may name, and its name among a bundle's errors."""


class Pictures(NamedTuple):
    """The fit and its reference under one light, linear Rec.709 `(H, W, 3)`."""

    fit: np.ndarray
    reference: np.ndarray


class Lighting(NamedTuple):
    """The ways of light to a picture's pixels, and the reference by them."""

    paths: list[Paths]
    picture: np.ndarray


class Draws(NamedTuple):
    """What every fit of a material is judged on: drawn once, so that fits are comparable and a slow reference is cheap.

    Attributes:
        pairs: of directions, with the reference's f.
        lighting: of the sphere in the built-in studio.
    """

    pairs: list[TruePairs]
    lighting: Lighting


class Judgement(NamedTuple):
    """Errors by name, with their standard errors, the pictures that some of them are of, and where the fit is off."""

    errors: dict[str, float]
    pictures: Pictures
    residuals: ResidualMap


def draw(reference: Material) -> Draws:
    """The draws for fits of a material (docs/conventions.md): about 150 MB."""
    truth = jax.jit(partial(reference.brdf.eval, reference.params))
    pairs = true_pairs(jax.random.key(JUDGING_SEED), truth, draw_weighted, pairs=PAIRS)
    return Draws(list(pairs), light(reference))


def judgement(fit: Material, draws: Draws) -> Judgement:
    """All errors of one fit."""
    made = pictures({"": fit}, draws.lighting)[""]
    evaluate = jax.jit(partial(fit.brdf.eval, fit.params))
    errors = plain_errors(compare_at(draws.pairs, {"": evaluate})[""]) | picture_errors(made)
    return Judgement(errors, made, residual_map(draws.pairs, evaluate))


def brdf_errors(materials: Mapping[str, Material], draws: Draws) -> dict[str, BrdfErrors]:
    """Each material's errors on the same pairs."""
    compiled = {name: jax.jit(partial(m.brdf.eval, m.params)) for name, m in materials.items()}
    return compare_at(draws.pairs, compiled)


def plain_errors(errors: BrdfErrors) -> dict[str, float]:
    """Values and standard errors by name, for reports."""
    estimates = {name: getattr(errors, name) for name in ("mae", "smape", "rmse", "log_rmse")}
    values = {name: float(e.value) for name, e in estimates.items()}
    return values | {f"{name}_standard_error": float(e.standard_error) for name, e in estimates.items()}


def light(reference: Material) -> Lighting:
    """The reference in the studio; fits share its draws of light, for their noise is no error."""
    paths = list(_paths(reference, SIZE, SAMPLES))
    return Lighting(paths, pictures_by(paths, {"": reference}, height=SIZE, width=SIZE)[""])


def pictures(fits: Mapping[str, Material], lighting: Lighting) -> dict[str, Pictures]:
    """Each fit beside the reference."""
    height, width, _ = lighting.picture.shape
    made = pictures_by(lighting.paths, fits, height=height, width=width)
    return {name: Pictures(picture, lighting.picture) for name, picture in made.items()}


def render_pair(fit: Material, reference: Material, *, size: int = SIZE, samples: int = SAMPLES) -> Pictures:
    """Both in the studio, under the same light directions; memory stays bounded."""
    both = {"fit": fit, "reference": reference}
    return Pictures(**pictures_by(_paths(reference, size, samples), both, height=size, width=size))


def _paths(reference: Material, size: int, samples: int) -> Iterator[Paths]:
    key = jax.random.key(JUDGING_SEED)
    return draw_paths(key, reference, make_environment(studio()), height=size, width=size, samples=samples)


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
    return {f"{name}_ns_per_evaluation": price_of(of, QUERIES).ns for name, of in times.items()}


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
