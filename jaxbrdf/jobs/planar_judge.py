"""Judges spatially varying materials: pictures of the planar scene, and values under random footprints.

After section 5.2 and Table 6 of Timonen et al. The reference is a material at points, averaged over footprints by Monte
Carlo in two independent halves. Their mean is what others are compared to; half their difference has its standard
error, and the errors of one half against the mean are therefore those that the reference's own noise makes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Any, NamedTuple

import jax
import numpy as np

from jaxbrdf.metrics.estimate import NO_DRAWS, Estimate, add_draws, mean, root
from jaxbrdf.metrics.image import ImageErrors, image_errors
from jaxbrdf.metrics.interval import mean_interval, mean_ratio
from jaxbrdf.render.planar_scene import PlanarScene, scene_footprints, scene_pictures
from jaxbrdf.sampling.footprints import draw_places
from jaxbrdf.sampling.hemisphere import square_to_cosine
from jaxbrdf.surface.prefilter import prefiltered
from jaxbrdf.types import Material, Params, Query

SAMPLES, DRAWS = 256, 2**16
"""Of the reference: points of a footprint, and random configurations beside the pictures."""

COARSE_TEXELS = 2.0
"""From which footprint on the filtered errors are also told alone: below it there is little to filter."""

WHITE = 0.5
"""What the brightest channel of a reference is exposed to. A picture of one colour at one would clip whatever is too
bright; so an error of a factor of two is still seen."""

CHUNK = 2**13


class Configurations(NamedTuple):
    """Random queries with footprints, `(n, ...)`, and two independent estimates of the reference, `(2, n, 3)`."""

    query: Query
    halves: np.ndarray


class PlanarReference(NamedTuple):
    """What materials are judged by; made once.

    Attributes:
        scene: of the pictures.
        samples: points of each footprint, both halves together.
        halves: two independent sets of all pictures, `(2, scales, cameras, lights, size, size, 3)`.
        configurations: for errors of f.
    """

    scene: PlanarScene
    samples: int
    halves: np.ndarray
    configurations: Configurations


class PlanarErrors(NamedTuple):
    """Errors of one material.

    Attributes:
        ssim, flip, mae, rmse: of every picture, tone-mapped, `(scales, cameras, lights)`.
        mae_hdr, rmse_hdr: of f [1/sr] over random configurations, the latter free of the reference's noise.
    """

    ssim: np.ndarray
    flip: np.ndarray
    mae: np.ndarray
    rmse: np.ndarray
    mae_hdr: Estimate
    rmse_hdr: Estimate


PICTURE_METRICS = ("ssim", "flip", "mae", "rmse")


def planar_reference(
    key: jax.Array, material: Material, scene: PlanarScene, *, samples: int = SAMPLES, draws: int = DRAWS
) -> PlanarReference:
    """The reference of a material at points.

    Args:
        key: of all draws.
        material: its eval takes uv and no footprint.
        scene: of the pictures.
        samples: points of a footprint, twice a power of two for the least noise.
        draws: random configurations; wi and wo with the cosine, places and footprints as training draws them.

    Raises:
        ValueError: an odd or too small number of samples.
    """
    if samples < 2 or samples % 2:
        raise ValueError(f"samples is {samples}; it must be even and at least 2, for there are two halves")
    half = samples // 2
    keys = [jax.random.fold_in(key, i) for i in range(3)]
    pictures = np.stack([scene_pictures(k, material, scene, samples=half) for k in keys[:2]])
    return PlanarReference(scene, samples, pictures, _configurations(keys[2], material, scene.texels, half, draws))


def _configurations(key: jax.Array, material: Material, texels: int, samples: int, draws: int) -> Configurations:
    key_query, *keys = jax.random.split(key, 3)
    query = _draw(key_query, texels, draws)
    estimate = jax.jit(prefiltered(material.brdf.eval, samples=samples))
    return Configurations(query, np.stack([_values(k, estimate, material.params, query) for k in keys]))


def _draw(key: jax.Array, texels: int, draws: int) -> Query:
    key_directions, key_places = jax.random.split(key)
    wi, wo = square_to_cosine(jax.random.uniform(key_directions, (2, draws, 2)))
    return Query(wi, wo, *draw_places(key_places, wo, texels=texels))


def _values(
    key: jax.Array, estimate: Callable[[jax.Array, Params, Query], jax.Array], params: Params, query: Query
) -> np.ndarray:
    """f piece by piece, so that lookups of many probes take little memory."""
    found = []
    for start in range(0, len(query.wi), CHUNK):
        piece = jax.tree.map(lambda part, start=start: part[start : start + CHUNK], query)
        found.append(np.asarray(estimate(jax.random.fold_in(key, start), params, piece)))
    return np.concatenate(found)


def planar_errors(material: Material, reference: PlanarReference) -> PlanarErrors:
    """Errors of a material whose eval takes uv and footprint."""
    # nothing is drawn by a material that filters by itself
    key, evaluate = jax.random.key(0), jax.jit(material.brdf.eval)
    pictures = scene_pictures(key, material, reference.scene)
    values = _values(key, lambda _, *at: evaluate(*at), material.params, reference.configurations.query)
    return errors_of(pictures, values, reference)


def noise_errors(reference: PlanarReference) -> PlanarErrors:
    """What the standard error of the reference's own values makes of each error."""
    return errors_of(reference.halves[0], reference.configurations.halves[0], reference)


def errors_of(pictures: np.ndarray, values: np.ndarray, reference: PlanarReference) -> PlanarErrors:
    """Errors of pictures `(scales, cameras, lights, size, size, 3)` and of f `(n, 3)` at the configurations."""
    shape, wanted = reference.scene.shape, reference.halves.mean(axis=0)
    found = [_picture_errors(pictures[at], wanted[at]) for at in np.ndindex(shape)]
    mae, rmse = _value_errors(values, reference.configurations.halves)
    parts = {name: np.array([getattr(one, name) for one in found]).reshape(shape) for name in PICTURE_METRICS}
    return PlanarErrors(**parts, mae_hdr=mae, rmse_hdr=rmse)


def _picture_errors(picture: np.ndarray, reference: np.ndarray) -> ImageErrors:
    return image_errors(picture, reference, exposure=exposure_of(reference))


def exposure_of(reference: np.ndarray) -> float:
    """The factor that brings the 99th percentile of the brightest channel to `WHITE`; one for a black picture."""
    brightest = float(np.percentile(reference.max(axis=-1), 99.0))
    return WHITE / brightest if brightest > 0 else 1.0


def _value_errors(values: np.ndarray, halves: np.ndarray) -> tuple[Estimate, Estimate]:
    """MAE, and RMSE by the product of the differences to either half: their noise is independent and drops out."""
    off = values.astype(np.float64)[None] - halves
    squares = mean(add_draws(NO_DRAWS, np.prod(off, axis=0).mean(axis=-1)))
    rmse = root(Estimate(np.maximum(squares.value, 0.0), squares.standard_error))
    return mean(add_draws(NO_DRAWS, np.abs(off.mean(axis=0)).mean(axis=-1))), rmse


def planar_report(materials: Mapping[str, Material], reference: PlanarReference) -> dict[str, Any]:
    """Errors of materials beside each other, ready for JSON.

    An interval `[mean, low, high]` is of 95 % confidence over pairs of camera and light, each of which is a mean over
    scales: how far the mean would move with others of their kind. `from_two_texels` leaves out finer footprints.
    A ratio is a geometric mean over all pictures of a material's error over the first material's.

    Args:
        materials: by name; their eval takes uv and footprint.
        reference: what they are judged by.
    """
    scene = reference.scene
    errors = {name: planar_errors(material, reference) for name, material in materials.items()}
    first = next(iter(errors), None)
    return {
        "scene": asdict(scene),
        "footprint_texels": (scene_footprints(scene) * scene.texels).tolist(),
        "samples": reference.samples,
        "draws": len(reference.configurations.query.wi),
        "noise": planar_summary(noise_errors(reference), scene),
        "materials": {name: planar_summary(one, scene) for name, one in errors.items()},
        "ratios": {
            f"{name} / {first}": planar_ratios(one, errors[first], scene)
            for name, one in errors.items()
            if first is not None and name != first
        },
    }


def planar_summary(errors: PlanarErrors, scene: PlanarScene) -> dict[str, Any]:
    """Means of one material's errors with intervals: over all, from `COARSE_TEXELS` on, at each scale and camera."""
    pictures = {name: getattr(errors, name) for name in PICTURE_METRICS}
    coarse = _coarse(scene)
    hdr = {name: getattr(errors, name) for name in ("mae_hdr", "rmse_hdr")}
    return {
        **{name: _over_scales(part) for name, part in pictures.items()},
        **{name: float(one.value) for name, one in hdr.items()},
        **{f"{name}_standard_error": float(one.standard_error) for name, one in hdr.items()},
        "from_two_texels": {name: _over_scales(part[coarse]) for name, part in pictures.items()},
        "per_scale": {name: [list(mean_interval(one)) for one in part] for name, part in pictures.items()},
        "per_camera": {
            name: [_over_scales(part[:, [camera]]) for camera in range(part.shape[1])]
            for name, part in pictures.items()
        },
    }


def planar_ratios(errors: PlanarErrors, others: PlanarErrors, scene: PlanarScene) -> dict[str, Any]:
    """Geometric means of errors over others' on the same pictures, with intervals; of SSIM, of what one lacks."""
    parts = {name: (getattr(errors, name), getattr(others, name)) for name in ("flip", "mae", "rmse")}
    parts["one_minus_ssim"] = (1.0 - errors.ssim, 1.0 - others.ssim)
    coarse = _coarse(scene)
    return {
        **{name: list(mean_ratio(*map(_by_pair, pair))) for name, pair in parts.items()},
        "from_two_texels": {
            name: list(mean_ratio(*(_by_pair(part[coarse]) for part in pair))) for name, pair in parts.items()
        },
    }


def _coarse(scene: PlanarScene) -> np.ndarray:
    return scene_footprints(scene) * scene.texels >= COARSE_TEXELS


def _by_pair(part: np.ndarray) -> np.ndarray:
    """`(scales, cameras, lights)` as `(cameras * lights, scales)`."""
    return part.reshape(len(part), -1).T


def _over_scales(part: np.ndarray) -> list[float]:
    return list(mean_interval(_by_pair(part).mean(axis=1)))
