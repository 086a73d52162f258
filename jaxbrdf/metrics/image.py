"""Errors of one rendering against another, as a viewer sees them: exposed, clipped and sRGB-encoded alike.

SSIM by scikit-image (Wang et al. 2004, with the authors' Gaussian window), FLIP for LDR images (Andersson et al. 2020)
by its authors' package, MAE and RMSE of the encoded values.
"""

from __future__ import annotations

from typing import NamedTuple

import flip_evaluator
import jax.numpy as jnp
import numpy as np
from skimage.metrics import structural_similarity

from jaxbrdf.core.colour import REC709_LUMINANCE, srgb_encode


class ImageErrors(NamedTuple):
    """SSIM (one is equal), FLIP, MAE and RMSE (zero is equal), and the exposure at which both images were judged."""

    ssim: float
    flip: float
    mae: float
    rmse: float
    exposure: float


def auto_exposure(reference: np.ndarray) -> float:
    """The factor that brings the 99th percentile of the lit pixels' luminance to one; one for a black image."""
    lit = np.asarray(reference, np.float64) @ np.array(REC709_LUMINANCE)
    lit = lit[lit > 0]
    return float(1.0 / np.percentile(lit, 99.0)) if lit.size else 1.0


def tonemap(image: np.ndarray, exposure: float) -> np.ndarray:
    """A linear image `(H, W, 3)` times exposure, clipped to [0, 1] and sRGB-encoded, float32."""
    # a copy, for FLIP takes no read-only array
    return np.array(srgb_encode(jnp.asarray(np.asarray(image, np.float32) * np.float32(exposure))))


def image_errors(predicted: np.ndarray, reference: np.ndarray, *, exposure: float | None = None) -> ImageErrors:
    """Compare two linear HDR images `(H, W, 3)`.

    Args:
        predicted, reference: linear Rec.709 radiance.
        exposure: factor for both, by default `auto_exposure(reference)`.

    Raises:
        ValueError: images of different or unusable shapes; SSIM's window needs 11 pixels a side.
    """
    predicted, reference = np.asarray(predicted), np.asarray(reference)
    if predicted.shape != reference.shape or reference.ndim != 3 or reference.shape[-1] != 3:
        raise ValueError(f"images have shapes {predicted.shape} and {reference.shape}; both must be the same (H, W, 3)")
    if min(reference.shape[:2]) < 11:
        raise ValueError(f"images have shape {reference.shape}; they must be at least 11 pixels a side")
    exposure = auto_exposure(reference) if exposure is None else exposure
    shown, wanted = tonemap(predicted, exposure), tonemap(reference, exposure)
    difference = shown.astype(np.float64) - wanted
    rmse = float(np.sqrt(np.mean(np.square(difference))))
    return ImageErrors(_ssim(shown, wanted), flip(shown, wanted), float(np.mean(np.abs(difference))), rmse, exposure)


def _ssim(shown: np.ndarray, wanted: np.ndarray) -> float:
    options = {"gaussian_weights": True, "sigma": 1.5, "use_sample_covariance": False}
    return float(np.mean(structural_similarity(wanted, shown, data_range=1.0, channel_axis=2, **options)))


def flip(shown: np.ndarray, wanted: np.ndarray) -> float:
    """Mean FLIP of sRGB-encoded images in [0, 1] at the package's default viewing distance, 67 pixels a degree."""
    _, mean, _ = flip_evaluator.evaluate(
        wanted, shown, "LDR", inputsRGB=True, applyMagma=False, computeMeanError=True, parameters={}
    )
    return float(mean)
