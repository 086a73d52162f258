"""How long and how a fit trains: three presets, from a minute to the paper's own numbers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from jaxbrdf.fit import losses, optimiser
from jaxbrdf.fit.loop import LoopConfig, Schedule
from jaxbrdf.fit.losses import Loss
from jaxbrdf.fit.optimiser import OptimiserConfig
from jaxbrdf.surface.draws import SurfaceDraws


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
        hidden: widths of the gated model's decoder, unless the paper's sizes are asked for; None: the paper's.
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
    hidden: tuple[int, ...] | None = None
    highlights: bool = True


def _own(name: str, steps: int, pool: int, hidden: tuple[int, ...]) -> Preset:
    """Many small steps at rates that fall to zero, on raw textures: what converges in minutes.

    The averages of the paper's training take 100,000 steps to pay off, and so does its preconditioner.
    """
    return Preset(
        name,
        steps,
        LoopConfig(batch=2**13),
        OptimiserConfig(texture_rate=2e-2, network_rate=1e-2, beta1=0.9, smoothing=0.0, spatial_smoothing=0.0),
        losses.balanced,
        optimiser.cosine,
        pool,
        hidden=hidden,
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
    "quick": lambda: _own("quick", 8_000, 2**21, (16, 16)),
    "standard": lambda: _own("standard", 30_000, 2**22, (24, 24)),
    "paper": _paper,
}


@dataclass(frozen=True)
class SurfacePreset:
    """A recipe for spatially varying models.

    Attributes:
        training: as of other fits; its pools are not used.
        draws: how each step's queries are drawn.
        guided: whether latents start from the texture maps (`jaxbrdf.models.guided`) or from noise.
    """

    training: Preset
    draws: SurfaceDraws
    guided: bool


def _own_surface(name: str, steps: int) -> SurfacePreset:
    """Small steps from guided latents, and in each of them several still smaller ones of all that places share: what
    converges in minutes. Adam forgets squares within 100 steps: over 1000, a texel that few queries meet is moved
    three times as far by one large gradient. Angular textures learn as sums of coarser ones (docs/filtering.md).
    """
    rates = OptimiserConfig(
        1e-2, 1e-2, 0.9, 0.99, smoothing=0.0, multiresolution=True, spatial_rate=5e-3, spatial_smoothing=0.0
    )
    loop = LoopConfig(batch=2**12, turn=2**9)
    training = Preset(name, steps, loop, rates, losses.tempered, optimiser.cosine)
    return SurfacePreset(training, SurfaceDraws(samples=8, crowding=2.0), guided=True)


def _paper_surface() -> SurfacePreset:
    """Timonen et al., sections 4.2 to 4.5, for spatially varying materials."""
    loop = LoopConfig(batch=2**16, microbatch=2**12, ema=0.005)
    training = Preset("paper", 500_000, loop, OptimiserConfig(), losses.mixture, optimiser.staircase)
    return SurfacePreset(training, SurfaceDraws(samples=256, scattered=False), guided=False)


SURFACE_PRESETS: dict[str, Callable[[], SurfacePreset]] = {
    "quick": lambda: _own_surface("quick", 12_000),
    "standard": lambda: _own_surface("standard", 60_000),
    "paper": _paper_surface,
}
