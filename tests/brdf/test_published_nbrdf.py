from __future__ import annotations

import io
from pathlib import Path

import h5py
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.brdf import measured
from jaxbrdf.data import input as data_input
from jaxbrdf.types import Query
from tests.brdf.mitsuba_measured import cosine_directions
from tests.brdf.pairs import turned

ARCHIVE = Path("nbrdf") / "rgl-isotropic_nbrdf.zip"
COUNT = 400
PAIR = [cosine_directions(np.random.default_rng(seed), COUNT) for seed in (1, 2)]
QUERY = Query(jnp.asarray(PAIR[0]), jnp.asarray(PAIR[1]))


def reference(content: bytes, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """The network by hand: weights by their names in the file, float64, one pair."""
    half = (wi + wo) / np.linalg.norm(wi + wo)
    theta_h, phi_h = np.arccos(half[2]), np.arctan2(half[1], half[0])
    difference = turned(turned(wi, np.array([0.0, 0.0, 1.0]), -phi_h), np.array([0.0, 1.0, 0.0]), -theta_h)
    x = np.concatenate([[np.sin(theta_h), 0.0, np.cos(theta_h)], difference])
    with h5py.File(io.BytesIO(content)) as file:
        for name in ("dense_1", "dense_2", "dense_3"):
            x = np.asarray(file[f"{name}/{name}/kernel:0"]).T.astype(np.float64) @ x + file[f"{name}/{name}/bias:0"][()]
            x = np.exp(x) - 1.0 if name == "dense_3" else x
            x = np.maximum(x, 0.0)
    return x


def test_agrees_with_the_network_by_hand(data_dir: Path) -> None:
    path = data_dir / ARCHIVE / "cg_sunflower_rgb.h5"
    material = measured.load(path)
    value = jax.jit(material.brdf.eval)(material.params, QUERY)
    content = data_input.read(path)
    expected = [reference(content, *(w.astype(np.float64) for w in pair)) for pair in zip(*PAIR, strict=True)]
    np.testing.assert_allclose(value, expected, rtol=2e-4, atol=1e-5)


# Above what a wrong order of inputs, layers or channels reaches, below what the published networks were measured at.
@pytest.mark.parametrize(
    ("name", "bound"), [("paper_white", 0.05), ("cg_sunflower", 0.08), ("vch_golden_yellow", 0.25)]
)
def test_is_close_to_the_material_it_was_fitted_to(name: str, bound: float, data_dir: Path) -> None:
    values = []
    for path in (data_dir / ARCHIVE / f"{name}_rgb.h5", data_dir / "rgl" / f"{name}_rgb.bsdf"):
        material = measured.load(path)
        values.append(np.asarray(jax.jit(material.brdf.eval)(material.params, QUERY)))
    assert np.mean(2.0 * np.abs(values[0] - values[1]) / (values[0] + values[1] + 1e-3)) < bound


def test_zero_below_the_horizon(data_dir: Path) -> None:
    material = measured.load(data_dir / ARCHIVE / "paper_white_rgb.h5")
    down = QUERY.wi * jnp.array([[1.0, 1.0, -1.0]])
    assert not np.any(material.brdf.eval(material.params, Query(down, QUERY.wo)))
    assert material.isotropic
