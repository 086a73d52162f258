"""How much noise each way of drawing light leaves in the radiance of measured materials, and what a draw costs.

    python experiments/bench_samplers.py                       # the RGL files: about a minute each on two cores
    python experiments/bench_samplers.py --bundles FOLDER      # fitted bundles FOLDER/NAME, by the samplers they carry
    python experiments/bench_samplers.py cg_sunflower --nodes 64 --plain

A view's radiance is the integral of f cos(wi) L(wi) over wi, L from an environment turned four ways about the surface.
The luminance of one draw, X = f cos L / p, has the variance integral (f cos L)^2 / p - (E X)^2; with the balance
heuristic and one draw of the light each (density q), integral (f cos L)^2 / (p + q) less the squared means of both
draws. All these integrals are estimated from the same points, drawn by a mixture of all samplers and the light, so
ratios between samplers have little noise of their own; one material's variances are also measured by drawing.

Writes experiments/results/samplers.json, or bundle_samplers.json.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from scipy.spatial.transform import Rotation

from jaxbrdf.brdf.measured import load, symmetrised
from jaxbrdf.brdf.proposed import Proposed, sampled_by
from jaxbrdf.brdf.sampler import sampler_of
from jaxbrdf.core.colour import luminance
from jaxbrdf.core.ggx import Ggx
from jaxbrdf.core.numerics import safe_divide
from jaxbrdf.core.roughness import Isotropic
from jaxbrdf.data.hdr import read
from jaxbrdf.export import bundle
from jaxbrdf.fit.proxy import LEAST_DENSITY, ProxyFit, cross_entropy, fit_proxy, light_of_views
from jaxbrdf.render.environment import Environment, light_density, look_up, make_environment, sample_light
from jaxbrdf.sampling.conditional import ISOTROPIC, conditional, memory, tabulate_conditional
from jaxbrdf.sampling.defensive import defensive
from jaxbrdf.sampling.hemisphere import square_to_cosine
from jaxbrdf.sampling.proposal import COSINE, VISIBLE_NORMALS, Proposal
from jaxbrdf.sampling.proxy import PROXY
from jaxbrdf.sampling.sobol import sobol_points
from jaxbrdf.sampling.view_proxy import VIEW_PROXY, VISIBLE_VIEW_PROXY, ViewProxy
from jaxbrdf.types import Brdf, Material, Params, Query

RESULTS = Path(__file__).parent / "results"
VIEWS, TURNS = 64, 4
POINTS = 1024
DRAWS = 4096
BUNDLE = "bundle.safetensors"
QUERIES, ROUNDS = 2**17, 7
WIDTHS = np.geomspace(2e-3, 1.0, 40)


class Scene(NamedTuple):
    """An environment, turns of the surface's frame into the world `(TURNS, 3, 3)`, and views `(VIEWS, 3)`."""

    environment: Environment
    turns: jax.Array
    views: jax.Array


class Way(NamedTuple):
    """One way to draw light for a material: its BRDF, parameters, the bytes of these and the seconds they took."""

    brdf: Brdf
    params: Params
    bytes: int
    seconds: float


def scene(path: Path) -> Scene:
    """The city, surfaces turned at random but the same each time, and views spread by the cosine."""
    turns = Rotation.random(TURNS, rng=0).as_matrix()
    views = square_to_cosine(jnp.asarray(sobol_points(VIEWS, 2) + 0.5 / VIEWS))
    return Scene(make_environment(read(path.read_bytes(), path)), jnp.asarray(turns, jnp.float32), views)


def ways(material: Material, own: Material, config: ProxyFit, stored: ViewProxy | None) -> dict[str, Way]:
    """Every sampler of the material; `own` is the measured file, whose sampler comes with it.

    The proxy is the one that is stored, or fitted here.
    """
    evaluate, params = material.brdf.eval, material.params
    brdfs = sampled_brdfs(evaluate, own.brdf, config.proposal)
    made = {
        "cosine": lambda: None,
        "GGX": lambda: best_lobe(config, evaluate, params),
        "table": lambda: tabulate_conditional(ISOTROPIC, evaluate, params),
        "proxy": lambda: stored or fit_proxy(evaluate, params, config=config),
        "file": lambda: own.params,
    }
    found = {}
    for name, make in made.items():
        start = time.perf_counter()
        of_proposal = jax.block_until_ready(make())
        seconds = time.perf_counter() - start
        kept = (own.params.vndf, own.params.luminance) if name == "file" else of_proposal
        found[name] = Way(brdfs[name], Proposed(params, of_proposal), memory(kept), seconds)
    return found


@cache
def sampled_brdfs(evaluate: Callable, own: Brdf, proxy: Proposal) -> dict[str, Brdf]:
    """The reflectance with light drawn in each way; the same functions each time, so that files share compilations."""
    file = Proposal(
        lambda tables, wo, u: own.sample(tables, Query(wo, wo), u).wi,
        lambda tables, wi, wo: own.pdf(tables, Query(wi, wo)),
    )
    lobe, table = defensive(VISIBLE_NORMALS), conditional(ISOTROPIC)
    proposals = {
        "cosine": COSINE,
        "GGX": lobe,
        "table": table,
        "proxy": VIEW_PROXY if proxy is PROXY else VISIBLE_VIEW_PROXY,
        "file": file,
    }
    return {name: sampled_by(proposal, evaluate, Proposed._make) for name, proposal in proposals.items()}


@cache
def reciprocal(brdf: Brdf) -> Brdf:
    """The reciprocal part of a file's BRDF, likewise the same functions for all files of one layout."""
    return symmetrised(Material("", brdf, None, True)).brdf


def best_lobe(config: ProxyFit, evaluate: Callable, params: Params) -> Ggx:
    """The width of one GGX lobe for all views, of the least cross-entropy."""
    target = light_of_views(config, evaluate, params)
    lobe, wo = defensive(VISIBLE_NORMALS), jnp.broadcast_to(target.wo, target.wi.shape)

    def loss(alpha: jax.Array) -> jax.Array:
        return jnp.mean(cross_entropy(target, lobe.pdf(Ggx(Isotropic(alpha)), target.wi, wo) + LEAST_DENSITY))

    losses = jax.lax.map(loss, jnp.asarray(WIDTHS, jnp.float32))
    return Ggx(Isotropic(jnp.float32(WIDTHS[int(np.argmin(losses))])))


def variances(found: dict[str, Way], scene: Scene) -> dict[str, np.ndarray]:
    """Of one draw's luminance for each sampler, `(views turns, samplers)`: alone, and with one draw of the light.

    And by drawing, alone, as a check; and the radiance itself, `(views turns,)`.
    """
    brdfs, params = tuple(way.brdf for way in found.values()), tuple(way.params for way in found.values())
    keys = jax.random.split(jax.random.key(0), (VIEWS, TURNS))
    results = [
        view_variances(brdfs, params, scene.environment, keys[i, j], wo, turn)
        for i, wo in enumerate(scene.views)
        for j, turn in enumerate(scene.turns)
    ]
    parts = [np.asarray(jnp.stack(part), float) for part in zip(*results, strict=True)]
    return dict(zip(("alone", "with_light", "by_drawing", "radiance"), parts, strict=True))


@partial(jax.jit, static_argnums=0)
def view_variances(
    brdfs: tuple[Brdf, ...],
    params: tuple[Params, ...],
    environment: Environment,
    key: jax.Array,
    wo: jax.Array,
    turn: jax.Array,
) -> tuple[jax.Array, ...]:
    """The parts of `variances` for one viewer and one turn of the surface."""
    u = jax.random.uniform(key, (len(brdfs) + 1, DRAWS, 3))
    viewer, samplers = jnp.broadcast_to(wo, (DRAWS, 3)), [sampler_of(brdf) for brdf in brdfs]
    drawn = [s.sample(own, Query(viewer, viewer), v) for s, own, v in zip(samplers, params, u[:-1], strict=True)]
    by_drawing = jnp.stack([jnp.var(luminance(d.weight * look_up(environment, d.wi @ turn.T))) for d in drawn])
    light = sample_light(environment, u[-1, :, :2]).direction @ turn
    wi = jnp.concatenate([w[:POINTS] for w in (*(d.wi for d in drawn), light)])
    query, world = Query(wi, jnp.broadcast_to(wo, wi.shape)), wi @ turn.T
    densities = jnp.stack([s.pdf(own, query) for s, own in zip(samplers, params, strict=True)])
    # below the horizon nothing is lit, and no density is needed
    by_light = jnp.where(wi[:, 2] > 0, light_density(environment, world), 0.0)
    mean = (jnp.sum(densities, axis=0) + by_light) / len(u)
    weight = safe_divide(jnp.ones_like(mean), mean * len(wi))
    f = brdfs[0].eval(params[0], query)
    x = luminance(f * look_up(environment, world)) * jnp.maximum(wi[:, 2], 0.0)
    return *moments(x, densities, by_light, weight), by_drawing, jnp.sum(x * weight)


def moments(x: jax.Array, densities: jax.Array, by_light: jax.Array, weight: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Variances alone and with light, `(samplers,)`, of x = f cos L at points of the given weights in a sum."""

    def integral(value: jax.Array) -> jax.Array:
        return jnp.sum(value * weight[None], axis=-1)

    radiance, both = jnp.sum(x * weight), densities + by_light[None]
    alone = integral(safe_divide(x[None] ** 2, densities)) - radiance**2
    by_sampler = integral(safe_divide(x[None] * densities, both))
    with_light = integral(safe_divide(x[None] ** 2, both)) - by_sampler**2 - (radiance - by_sampler) ** 2
    return alone, with_light


def nanoseconds(found: dict[str, Way]) -> dict[str, dict[str, float]]:
    """Median time of a draw with its density, and with the reflectance too, the samplers in turn."""
    wo = square_to_cosine(jax.random.uniform(jax.random.key(2), (QUERIES, 2)))
    u = jax.random.uniform(jax.random.key(3), (QUERIES, 3))

    calls = {
        (name, full): partial(draw, way.brdf, full, way.params, wo, u)
        for name, way in found.items()
        for full in (False, True)
    }
    times = {key: [] for key in calls}
    for call in calls.values():
        jax.block_until_ready(call())
    for _ in range(ROUNDS):
        for key, call in calls.items():
            start = time.perf_counter()
            jax.block_until_ready(call())
            times[key].append((time.perf_counter() - start) / QUERIES * 1e9)
    return {
        name: {"draw_ns": float(np.median(times[name, False])), "sample_ns": float(np.median(times[name, True]))}
        for name in found
    }


@partial(jax.jit, static_argnums=(0, 1))
def draw(brdf: Brdf, full: bool, params: Params, wo: jax.Array, u: jax.Array) -> tuple[jax.Array, ...]:
    sample = sampler_of(brdf).sample(params, Query(wo, wo), u)
    return sample if full else sample[:2]


def measure(path: Path, scene: Scene, arguments: argparse.Namespace) -> dict:
    """One material's row."""
    file = load(path)
    own, name = file._replace(brdf=reciprocal(file.brdf)), path.stem.removesuffix("_rgb")
    fitted = bundle.load(arguments.bundles / name / BUNDLE) if arguments.bundles else None
    material, stored = (own, None) if fitted is None else (bundle.material(fitted), fitted.parts.sampler)
    config = ProxyFit(elevations=arguments.nodes, objective=arguments.objective, steps=arguments.steps)
    found = ways(material, own, replace(config, proposal=PROXY) if arguments.plain else config, stored)
    noise, clock = variances(found, scene), nanoseconds(found)
    row = {"material": name, "mean_radiance": float(noise["radiance"].mean()), "samplers": {}}
    for i, (sampler, way) in enumerate(found.items()):
        variance = float(noise["alone"][:, i].mean())
        row["samplers"][sampler] = {
            "bytes": way.bytes,
            "seconds_to_make": way.seconds,
            "variance": variance,
            "variance_by_drawing": float(noise["by_drawing"][:, i].mean()),
            "variance_with_light": float(noise["with_light"][:, i].mean()),
            **clock[sampler],
            "ns_to_unit_variance": variance * clock[sampler]["sample_ns"],
        }
    return row


def summary(rows: list[dict]) -> dict:
    """Geometric means over the materials of each figure relative to the cosine's, and of the proxy to the table."""

    def ratio(figure: str, one: str, other: str) -> float:
        values = [row["samplers"][one][figure] / row["samplers"][other][figure] for row in rows]
        return float(np.exp(np.mean(np.log(values))))

    figures = ("variance", "variance_with_light", "ns_to_unit_variance")
    names = list(rows[0]["samplers"])
    means = {figure: {name: ratio(figure, name, "cosine") for name in names} for figure in figures}
    return {
        "relative_to_cosine": means,
        "proxy_over_table": {figure: ratio(figure, "proxy", "table") for figure in figures},
        "proxy_bytes_over_table": rows[0]["samplers"]["proxy"]["bytes"] / rows[0]["samplers"]["table"]["bytes"],
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("materials", nargs="*")
    parser.add_argument("--bundles", type=Path, help="a folder of fitted bundles, NAME/bundle.safetensors each")
    parser.add_argument("--nodes", type=int, default=ProxyFit().elevations)
    parser.add_argument("--steps", type=int, default=ProxyFit().steps)
    parser.add_argument("--objective", default=ProxyFit().objective)
    parser.add_argument("--plain", action="store_true", help="all normals instead of the visible ones")
    parser.add_argument("-o", "--output", type=Path)
    arguments = parser.parse_args()
    output = arguments.output or RESULTS / ("bundle_samplers.json" if arguments.bundles else "samplers.json")
    data = Path(os.environ["JAXBRDF_DATA"])
    city = scene(data / "env" / "polyhaven_city.hdr")
    paths = sorted((data / "rgl").glob("*.bsdf"))
    chosen = [p for p in paths if not arguments.materials or p.stem.removesuffix("_rgb") in arguments.materials]
    rows = []
    for path in chosen:
        rows.append(measure(path, city, arguments))
        of = rows[-1]["samplers"]
        print(rows[-1]["material"], {k: round(v["variance"] / of["cosine"]["variance"], 4) for k, v in of.items()})
        print(
            " " * 8,
            {k: round(v["variance_with_light"] / of["cosine"]["variance_with_light"], 4) for k, v in of.items()},
            {k: round(v["variance_by_drawing"] / v["variance"], 3) for k, v in of.items()},
            {k: round(v["sample_ns"]) for k, v in of.items()},
            {k: round(v["seconds_to_make"], 1) for k, v in of.items()},
            flush=True,
        )
    settings = {"views": VIEWS, "turns": TURNS, "points": POINTS, "nodes": arguments.nodes}
    settings |= {"objective": arguments.objective, "normals": "all" if arguments.plain else "visible"}
    report = {"settings": settings, "summary": summary(rows), "materials": rows}
    output.write_text(json.dumps(report, indent=1) + "\n")
    print(json.dumps(report["summary"], indent=1))


if __name__ == "__main__":
    main()
