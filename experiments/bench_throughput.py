"""Training throughput of the gated model (general variant): this project beside eager PyTorch, in one interleaved run.

    pip install torch==2.13.0
    python experiments/bench_throughput.py            # about two minutes

Both train the same network on the same batch of 2^16 queries with Adam, on two threads; textures, warps, decoder and
loss are the same. Coordinates and targets are given: neither side draws. Each has a process of its own, since their
thread pools would get in each other's way, and the rounds are interleaved. The FMA ceiling is
`jaxbrdf.opencl.ceiling`'s. Writes experiments/results/throughput.json.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from functools import partial
from itertools import pairwise
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pyopencl as cl
import torch

from jaxbrdf.fit import loop, losses
from jaxbrdf.fit.batch import Batch
from jaxbrdf.fit.optimiser import OptimiserConfig, adam, cosine
from jaxbrdf.models.gated import GatedConfig, GatedCoordinates, gated
from jaxbrdf.models.half_difference import HalfDifferencePolar, TextureSizes
from jaxbrdf.opencl import ceiling
from jaxbrdf.opencl.platform import choose, context_of, describe
from jaxbrdf.texture.angular import Polar

BATCH = 2**16
ROUNDS = 9
STEPS = 12
RATES = OptimiserConfig(texture_rate=2e-2, network_rate=5e-3, beta1=0.9, smoothing=0.0)


def jax_trainer(data: dict[str, np.ndarray]):
    """A function that takes `STEPS` steps and returns when they are done."""
    model = gated(GatedConfig(TextureSizes(isotropic=False)))
    at = HalfDifferencePolar(Polar(data["r_h"], data["turn_h"]), Polar(data["r_d"], data["turn_d"]))
    pool = Batch(GatedCoordinates(at, None), data["f"], data["importance"])
    scale = losses.scale_of(pool)
    optimiser = adam(RATES)
    config = loop.LoopConfig(batch=BATCH)

    def loss(params, batch):
        return jnp.mean(losses.balanced(model.decode(params, batch.coordinates), batch, scale))

    advance = loop.compile_advance(loss, optimiser, cosine, config, jax.devices())
    placed, state = advance.place_data(pool), advance.place_state(loop.start(model.init(jax.random.key(0)), optimiser))
    counts = jnp.int32(STEPS), jnp.int32(1000)
    return lambda: jax.block_until_ready(advance.run(state, placed, *counts))


class TorchGated(torch.nn.Module):
    """The same model: textures as (1, channels, n_r, n_phi + 1), their first column repeated, read by grid_sample."""

    def __init__(self) -> None:
        super().__init__()
        self.textures = torch.nn.ParameterList([0.1 * torch.randn(1, 6, 32, 32) for _ in range(2)])
        self.warps = torch.nn.ParameterList([torch.zeros(2, 2) for _ in range(2)])
        sizes = (12, 12, 12, 3)
        self.layers = torch.nn.ModuleList([torch.nn.Linear(a, b) for a, b in pairwise(sizes)])

    def fetch(self, index: int, r: torch.Tensor, turn: torch.Tensor) -> torch.Tensor:
        logits, exponents = self.warps[index]
        share, exponent = torch.softmax(logits, 0), 0.5 + torch.nn.functional.softplus(exponents)
        warped = (share[:, None] * r[None] ** exponent[:, None]).sum(0)
        texture = self.textures[index]
        centre = texture[:, :, :1, :1].expand(-1, -1, 1, texture.shape[3])
        closed = torch.cat([centre, texture[:, :, 1:]], 2)
        padded = torch.cat([closed, closed[:, :, :, :1]], 3)
        grid = torch.stack([2 * turn - 1, 2 * warped - 1], -1)[None, None]
        return torch.nn.functional.grid_sample(padded, grid, align_corners=True)[0, :, 0].T

    def forward(self, r_h: torch.Tensor, turn_h: torch.Tensor, r_d: torch.Tensor, turn_d: torch.Tensor) -> torch.Tensor:
        x = torch.cat([self.fetch(0, r_h, turn_h), self.fetch(1, r_d, turn_d)], 1)
        for layer in self.layers[:-1]:
            x = torch.nn.functional.silu(layer(x))
        return self.layers[-1](x)


def torch_trainer(data: dict[str, np.ndarray]):
    """The same in eager PyTorch."""
    torch.set_num_threads(2)
    tensors = {name: torch.from_numpy(np.array(value)) for name, value in data.items()}
    f, importance = tensors["f"].T.contiguous(), tensors["importance"][:, None]
    mean, square = (importance * f).mean(), (importance * f * f).mean()
    model = TorchGated()
    groups = [{"params": model.textures.parameters(), "lr": RATES.texture_rate}]
    groups += [{"params": [*model.warps.parameters(), *model.layers.parameters()], "lr": RATES.network_rate}]
    optimiser = torch.optim.Adam(groups, betas=(RATES.beta1, RATES.beta2))
    average = [p.detach().clone() for p in model.parameters()]

    def step() -> None:
        optimiser.zero_grad()
        p = torch.exp(model(*(tensors[name] for name in ("r_h", "turn_h", "r_d", "turn_d"))))
        difference = (p - f).abs()
        relative = 2 * difference / (p + f + losses.SMAPE_OFFSET)
        loss = (importance * (relative + difference / mean + difference**2 / square)).mean()
        loss.backward()
        optimiser.step()
        torch._foreach_lerp_(average, [p.detach() for p in model.parameters()], 0.005)

    return lambda: [step() for _ in range(STEPS)]


def ceiling_of_the_device() -> Callable[[], float]:
    """A function that measures GFLOP/s of chains of multiply-adds on the best device."""
    context = context_of(choose())
    chains, queue = ceiling.all_chains(context), cl.CommandQueue(context)
    return lambda: ceiling.gflops(chains, queue)


def serve(name: str, pipe: Connection) -> None:
    """Sends one measurement for each message received: seconds of training, or GFLOP/s."""
    jax.config.update("jax_num_cpu_devices", 2)
    generator = np.random.default_rng(0)
    data = {name: generator.random(BATCH, np.float32) for name in ("r_h", "turn_h", "r_d", "turn_d")}
    data |= {"f": generator.random((3, BATCH), np.float32), "importance": np.ones(BATCH, np.float32)}
    if name == "fma":
        measure = ceiling_of_the_device()
    else:
        train = {"jax": jax_trainer, "torch": torch_trainer}[name](data)
        measure = partial(seconds, train)
    measure()
    while pipe.recv():
        pipe.send(measure())


def seconds(run) -> float:
    clock = time.perf_counter()
    run()
    return time.perf_counter() - clock


def interleaved() -> dict[str, list[float]]:
    """Measurements of all three, round by round."""
    context = get_context("spawn")
    pipes: dict[str, Connection] = {}
    for name in ("jax", "torch", "fma"):
        pipes[name], theirs = context.Pipe()
        context.Process(target=serve, args=(name, theirs), daemon=True).start()
    values: dict[str, list[float]] = {name: [] for name in pipes}
    # the first round waits for compilation and is left out
    for index in range(ROUNDS + 1):
        for name, pipe in pipes.items():
            pipe.send(True)
            value = pipe.recv()
            values[name] += [value] if index else []
    for pipe in pipes.values():
        pipe.send(False)
    return values


def main() -> None:
    values = interleaved()
    rates = {name: BATCH * STEPS / float(np.median(values[name])) for name in ("jax", "torch")}
    ceiling = max(values["fma"])
    result = {
        "device": describe(choose()),
        "batch": BATCH,
        "jax_queries_per_second": rates["jax"],
        "torch_queries_per_second": rates["torch"],
        "ratio": rates["jax"] / rates["torch"],
        "fma_ceiling_gflops": ceiling,
        "queries_per_second_per_gflops": rates["jax"] / ceiling,
        "spread": {name: [min(of), max(of)] for name, of in values.items()},
    }
    path = Path(__file__).parent / "results" / "throughput.json"
    path.write_text(json.dumps(result, indent=1) + "\n")
    print(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
