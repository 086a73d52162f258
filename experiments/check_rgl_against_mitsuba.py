"""Compare the RGL evaluation with Mitsuba's `measured` plugin on every file of a folder, and write the figures.

Usage: python experiments/check_rgl_against_mitsuba.py [FOLDER] [OUTPUT.json], the folder $JAXBRDF_DATA/rgl by default.
Both sides get the same cosine-distributed pairs and are clamped at zero; a difference is relative to the larger value.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import drjit as dr
import jax
import jax.numpy as jnp
import mitsuba as mi
import numpy as np

from jaxbrdf.brdf import rgl
from jaxbrdf.data.rgl import read
from jaxbrdf.types import Query

PAIRS = 100_000
SEED = 0
LIBRARY = "/usr/lib/x86_64-linux-gnu/libLLVM.so.19.1"
OUTPUT = Path(__file__).parent / "results" / "rgl_mitsuba.json"


def cosine_directions(rng: np.random.Generator, count: int) -> np.ndarray:
    """Cosine-distributed unit vectors, `(count, 3)`."""
    square, turn = rng.random(count), 2.0 * np.pi * rng.random(count)
    radius = np.sqrt(square)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), np.sqrt(1.0 - square)], axis=-1).astype(np.float32)


def relative(ours: np.ndarray, theirs: np.ndarray) -> dict[str, float]:
    """Quantiles of |ours - theirs| / max(ours, theirs), zero where both are zero."""
    larger = np.maximum(ours, theirs)
    error = np.abs(ours - theirs) / np.where(larger > 0, larger, 1.0)
    return {"median": float(np.median(error)), "p99": float(np.quantile(error, 0.99)), "max": float(error.max())}


def compare(path: Path) -> dict[str, dict[str, float] | float]:
    """The figures of one file: value, density, and direction and weight from the same random numbers."""
    rng = np.random.default_rng(SEED)
    wi, wo, u = cosine_directions(rng, PAIRS), cosine_directions(rng, PAIRS), rng.random((PAIRS, 3), dtype=np.float32)
    material = rgl.material(read(path.read_bytes(), path), path.stem)
    query = Query(jnp.asarray(wi), jnp.asarray(wo))
    value = np.asarray(jax.jit(material.brdf.eval)(material.params, query))
    density = np.asarray(jax.jit(material.brdf.pdf)(material.params, query))
    drawn = np.asarray(jax.jit(material.brdf.sample)(material.params, query, jnp.asarray(u)).wi)

    plugin, context = mi.load_dict({"type": "measured", "filename": str(path)}), mi.BSDFContext()
    surface = dr.zeros(mi.SurfaceInteraction3f, PAIRS)
    surface.wi = mi.Vector3f(wo.T)
    light = mi.Vector3f(wi.T)
    their_value = np.maximum(np.asarray(plugin.eval(context, surface, light)).T, 0.0) / wi[:, 2:]
    their_density = np.asarray(plugin.pdf(context, surface, light))
    sample, _ = plugin.sample(context, surface, mi.Float(u[:, 0]), mi.Point2f(u[:, 1:].T))
    distance = np.linalg.norm(drawn - np.asarray(sample.wo).T, axis=-1)
    return {
        "value": relative(value, their_value),
        "density": relative(density, their_density),
        "drawn direction": {"median": float(np.median(distance)), "p99": float(np.quantile(distance, 0.99))},
        "clamped share": float(np.mean(value == 0)),
    }


def main() -> None:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(os.environ["JAXBRDF_DATA"]) / "rgl"
    output = Path(sys.argv[2]) if len(sys.argv) > 2 else OUTPUT
    os.environ.setdefault("DRJIT_LIBLLVM_PATH", LIBRARY)
    mi.set_variant("llvm_ad_rgb")
    files = {path.name: compare(path) for path in sorted(folder.glob("*.bsdf"))}
    for name, figures in files.items():
        print(f"{name:32} median {figures['value']['median']:.1e}  p99 {figures['value']['p99']:.1e}")
    report = {"reference": f"Mitsuba {mi.__version__}, llvm_ad_rgb", "pairs": PAIRS, "seed": SEED, "files": files}
    output.parent.mkdir(parents=True, exist_ok=True)
    output.write_text(json.dumps(report, indent=1) + "\n")


if __name__ == "__main__":
    main()
