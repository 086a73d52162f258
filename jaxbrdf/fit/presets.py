"""How long and how a fit trains: three presets, from a minute to the paper's own numbers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from jaxbrdf.fit import losses, optimiser
from jaxbrdf.fit.loop import LoopConfig, Schedule
from jaxbrdf.fit.losses import Loss, LossWeights
from jaxbrdf.fit.optimiser import OptimiserConfig


@dataclass(frozen=True)
class Preset:
    """A training recipe.

    Attributes:
        name: as the command line knows it.
        steps: of the optimiser.
        loop: batch size and averaging.
        optimiser: rates and preconditioner.
        loss: see `jaxbrdf.fit.losses`.
        schedule: factor of the rates over the steps.
        pool: queries drawn at a time.
        passes: how often a pool is read before the next is drawn; zero keeps the first.
        highlights: whether half of the draws are made in half/difference space; otherwise all are cosine-distributed.
    """

    name: str
    steps: int
    loop: LoopConfig
    optimiser: OptimiserConfig
    loss: Loss
    schedule: Schedule
    pool: int = 2**21
    passes: int = 0
    highlights: bool = True


def _own(name: str, steps: int, pool: int) -> Preset:
    return Preset(
        name,
        steps,
        LoopConfig(batch=2**13, ema=0.005),
        OptimiserConfig(texture_rate=2e-2, network_rate=5e-3, beta1=0.9, smoothing=0.0),
        partial(losses.balanced, weights=LossWeights()),
        optimiser.cosine,
        pool,
    )


def _paper() -> Preset:
    """Timonen et al., sections 4.2 to 4.5, for measured materials."""
    loop = LoopConfig(batch=2**18, ema=0.005)
    return Preset(
        "paper",
        100_000,
        loop,
        OptimiserConfig(),
        losses.mixture,
        optimiser.staircase,
        pool=2**22,
        passes=8,
        highlights=False,
    )


PRESETS: dict[str, Callable[[], Preset]] = {
    "quick": lambda: _own("quick", 16_000, 2**21),
    "standard": lambda: _own("standard", 40_000, 2**22),
    "paper": _paper,
}
