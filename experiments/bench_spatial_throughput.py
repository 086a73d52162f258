"""Training throughput of the spatially varying gated model: this project beside eager PyTorch, in one interleaved run.

    pip install torch==2.13.0
    python -m experiments.bench_spatial_throughput            # about five minutes

Both train the same network as the presets "quick" and "standard" do, in steps of 4096 queries: all but the latents are
updated after every 512. 256^2 texels of latents with all levels, up to 16 probes, Adam, and a moving average of the
parameters: once on given queries and targets, and once with queries and targets of 8 points drawn in every turn.
PyTorch draws all light by the cosine, which is less work than drawing half of it as facets scatter it. Values of both
are compared before any is timed.

Each runs on one core and on two, where PyTorch's threads wait for each other after every operation: beside other
programs that can take longer than one core. They wait without spinning (OMP_WAIT_POLICY), which then costs less. The
ratio is that of the better of both. Each has a process of its own, and
rounds are interleaved. Writes experiments/results/spatial_throughput.json.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable
from functools import partial
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import torch

from experiments import torch_spatial
from jaxbrdf.data.pbr import PbrTextures
from jaxbrdf.fit import loop, losses
from jaxbrdf.fit.batch import Batch
from jaxbrdf.fit.feed import POOLED, Feed
from jaxbrdf.fit.optimiser import adam
from jaxbrdf.fit.presets import SURFACE_PRESETS
from jaxbrdf.jobs.supply import Wanted, draws_of
from jaxbrdf.models.spatial import LatentTexture
from jaxbrdf.models.spatial_gated import SpatialGatedConfig, SpatialGatedParams, spatial_gated
from jaxbrdf.surface.draws import draw_targets
from jaxbrdf.surface.textured import reciprocal_textured, surface_of
from jaxbrdf.texture.pyramid import Layout, Pyramid
from jaxbrdf.types import Query

SIZE = 256
PROBES = 16
ROUNDS = 7
STEPS = 4
FLOOR, MOST = 0.3, 10.0
"""Of `losses.tempered`."""

PRESET = SURFACE_PRESETS["quick"]()
BATCH, TURN = PRESET.training.loop.batch, PRESET.training.loop.turn or 0
TURNS = BATCH // TURN
LAYOUT = Layout(SIZE, SIZE)
MODEL = spatial_gated(SpatialGatedConfig(latents=LatentTexture(SIZE, SIZE, probes=PROBES)))


def given() -> dict[str, Any]:
    """Parameters, a surface, queries with targets, and what both sides must compute of them, as NumPy arrays."""
    rng = np.random.default_rng(0)
    normal = np.concatenate([rng.normal(size=(SIZE, SIZE, 2)) * 0.2, np.ones((SIZE, SIZE, 1))], axis=2)
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    maps = [rng.random((SIZE, SIZE, 3)), 0.2 + 0.8 * rng.random((SIZE, SIZE)), rng.random((SIZE, SIZE)) > 0.5, normal]
    layout, surface = surface_of("noise", PbrTextures(*(np.asarray(m, np.float32) for m in maps), told=()))
    first = MODEL.init(jax.random.key(1))
    params = jax.tree.map(lambda leaf: leaf + 0.1 * rng.normal(size=leaf.shape).astype(np.float32), first)
    query, f = jax.jit(draw_targets(layout, PRESET.draws), static_argnums=2)(jax.random.key(2), surface.params, BATCH)
    values = jax.jit(MODEL.decode)(params, MODEL.encode(query))
    points = reciprocal_textured(layout).eval(surface.params, query._replace(footprint=None))
    found = {"params": params, "texels": surface.params, "query": query._asdict(), "f": f, "values": values.T}
    found["at"] = points
    return jax.tree.map(np.asarray, found)


def jax_trainers(data: dict[str, Any]) -> dict[str, Callable[[], Any]]:
    query = Query(**data["query"])
    pool = Batch(MODEL.encode(query), data["f"].T, jnp.ones(BATCH))
    supply = draws_of(Pyramid(LAYOUT, jnp.asarray(data["texels"])), PRESET.draws)(Wanted(MODEL, PRESET.training, 0))
    scale, optimiser = losses.scale_of(pool), adam(PRESET.training.optimiser)
    state = loop.start(jax.tree.map(jnp.asarray, data["params"]), optimiser)

    def loss(params: SpatialGatedParams, batch: Batch) -> jax.Array:
        return jnp.mean(PRESET.training.loss(MODEL.decode(params, batch.coordinates), batch, scale))

    def trainer(feed: Feed, source: Any) -> Callable[[], Any]:
        schedule, config = PRESET.training.schedule, PRESET.training.loop
        advance = loop.compile_advance(loss, optimiser, schedule, config, jax.devices(), feed=feed)
        placed, start = advance.place_data(source), advance.place_state(state)
        return lambda: jax.block_until_ready(advance.run(start, placed, jnp.int32(STEPS), jnp.int32(1000)))

    return {"model": trainer(POOLED, pool), "whole": trainer(supply.feed, supply.load(0))}


def torch_trainers(data: dict[str, Any]) -> dict[str, Callable[[], Any]]:
    """Raises AssertionError where PyTorch's values are not JAX's."""
    rates = PRESET.training.optimiser
    query = [torch.from_numpy(data["query"][name].copy()) for name in ("wi", "wo", "uv", "footprint")]
    texels, given_f = torch.from_numpy(data["texels"].copy()), torch.from_numpy(data["f"].copy())
    model = torch_spatial.Spatial(named(data["params"]), SIZE, PROBES)
    with torch.no_grad():
        np.testing.assert_allclose(model(*query).numpy(), data["values"], atol=1e-4)
    check_points(data, texels, model.pyramid, query)
    arrays = model.arrays
    shared = [
        {"params": [arrays["h"], arrays["d"]], "lr": rates.texture_rate},
        {"params": [p for name, p in arrays.items() if name not in "shd"], "lr": rates.network_rate},
    ]
    adam_of = partial(torch.optim.Adam, betas=(rates.beta1, rates.beta2), eps=rates.epsilon, fused=True)
    of_shared, of_latents = adam_of(shared), adam_of([arrays["s"]], lr=rates.spatial_rate)
    parameters = [p.detach() for p in model.parameters()]
    average = [p.clone() for p in parameters]
    floor = FLOOR * given_f.mean()

    def step(source: Callable[[int], Any]) -> None:
        of_latents.zero_grad()
        for turn in range(TURNS):
            (wi, wo, uv, footprint), f = source(turn)
            of_shared.zero_grad()
            p = model(wi, wo, uv, footprint).clamp_max(losses.LARGEST_LOG).exp()
            held = p.detach()
            bright = held + floor
            square = (torch.minimum(f, MOST * bright) - p) ** 2
            # the latents' gradient is summed over the turns
            (square / ((held + losses.SMAPE_OFFSET) * bright)).mean().backward()
            of_shared.step()
        arrays["s"].grad.div_(TURNS)
        of_latents.step()
        torch._foreach_lerp_(average, parameters, PRESET.training.loop.ema)  # pyright: ignore[reportPrivateImportUsage]

    draws, turns = PRESET.draws, [[part[k * TURN : (k + 1) * TURN] for part in (*query, given_f)] for k in range(TURNS)]
    sources = {
        "model": lambda turn: (turns[turn][:4], turns[turn][4]),
        "whole": lambda _: torch_spatial.draw(texels, model.pyramid, TURN, draws.samples, draws.crowding),
    }
    return {name: partial(repeat, partial(step, source)) for name, source in sources.items()}


def repeat(step: Callable[[], None]) -> None:
    for _ in range(STEPS):
        step()


def named(params: SpatialGatedParams) -> dict[str, np.ndarray]:
    """Arrays by the names that `torch_spatial.Spatial` has for them."""
    assert params.warps is not None
    assert params.frame is not None
    of_layers = {f"w{n}": w for n, w in enumerate(params.mlp.weights)} | {
        f"b{n}": b for n, b in enumerate(params.mlp.biases)
    }
    warps = {"warp_weights": params.warps.weights, "warp_biases": params.warps.biases}
    arrays = {"s": params.s.texels, "h": params.h, "d": params.d, "frame": params.frame} | warps | of_layers
    return {name: np.asarray(value) for name, value in arrays.items()}


def check_points(data: dict[str, Any], texels: torch.Tensor, pyramid: torch_spatial.Levels, query: list) -> None:
    """That PyTorch's targets are of the same surface."""
    wi, wo, uv, _ = query
    index, weight = torch_spatial.corners(pyramid, uv, torch.zeros(BATCH, dtype=torch.long))
    maps = torch.nn.functional.embedding_bag(index, texels, mode="sum", per_sample_weights=weight)
    np.testing.assert_allclose(torch_spatial.shade(maps, wi, wo).numpy(), data["at"], rtol=2e-3, atol=1e-4)


def serve(name: str, cores: int, data: dict[str, Any], pipe: Connection) -> None:
    """Sends seconds of training for every trainer's name received."""
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:cores])
    torch.set_num_threads(cores)
    jax.config.update("jax_num_cpu_devices", cores)
    trainers = {"jax": jax_trainers, "torch": torch_trainers}[name](data)
    for train in trainers.values():
        train()
    while asked := pipe.recv():
        clock = time.perf_counter()
        trainers[asked]()
        pipe.send(time.perf_counter() - clock)


def interleaved() -> dict[str, dict[str, list[float]]]:
    """Seconds a step of every trainer, by part and by who runs it, round by round."""
    os.environ["OMP_WAIT_POLICY"] = "passive"
    context, data = get_context("spawn"), given()
    pipes: dict[str, Connection] = {}
    for cores in (1, 2):
        for name in ("jax", "torch"):
            pipes[f"{name} {cores}"], theirs = context.Pipe()
            context.Process(target=serve, args=(name, cores, data, theirs), daemon=True).start()
    values: dict[str, dict[str, list[float]]] = {part: {name: [] for name in pipes} for part in ("model", "whole")}
    # the first round waits for compilation and is left out
    for index in range(ROUNDS + 1):
        for part, times in values.items():
            for name, pipe in pipes.items():
                pipe.send(part)
                value = pipe.recv() / STEPS
                times[name] += [value] if index else []
    for pipe in pipes.values():
        pipe.send("")
    return values


def summary(times: dict[str, list[float]]) -> dict[str, Any]:
    """Rates and ratios of one part."""
    median = {name: float(np.median(of)) for name, of in times.items()}
    best = {name: min(median[f"{name} 1"], median[f"{name} 2"]) for name in ("jax", "torch")}
    return {
        "samples_per_second": {name: BATCH / seconds for name, seconds in median.items()},
        "least_and_most_ms": {name: [1e3 * min(of), 1e3 * max(of)] for name, of in times.items()},
        "ratio": best["torch"] / best["jax"],
        "ratio_on_cores": {cores: median[f"torch {cores}"] / median[f"jax {cores}"] for cores in (1, 2)},
    }


def main() -> None:
    result: dict[str, Any] = {"batch": BATCH, "texels": SIZE}
    result |= {part: summary(times) for part, times in interleaved().items()}
    result["load"] = os.getloadavg()[0]
    path = Path(__file__).parent / "results" / "spatial_throughput.json"
    path.write_text(json.dumps(result, indent=1) + "\n")
    print(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
