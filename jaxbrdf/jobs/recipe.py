"""How candidates are trained: what all fits of one command have in common."""

from __future__ import annotations

from dataclasses import dataclass

from jaxbrdf.errors import JaxbrdfError
from jaxbrdf.fit.presets import PRESETS, Preset


@dataclass(frozen=True)
class Recipe:
    """A preset, and what it leaves open.

    Attributes:
        preset: a key of `fit.presets.PRESETS`.
        seed: of every draw.
        budget_seconds: if given, the number of steps is chosen to fit it.
    """

    preset: str = "quick"
    seed: int = 0
    budget_seconds: float | None = None


def preset_of(recipe: Recipe) -> Preset:
    """The preset that a recipe names.

    Raises:
        JaxbrdfError: if there is no such preset, or the budget is no time.
    """
    if recipe.preset not in PRESETS:
        raise JaxbrdfError(f"no preset is called {recipe.preset!r}; there are {', '.join(PRESETS)}")
    if recipe.budget_seconds is not None and not 0 < recipe.budget_seconds < float("inf"):
        raise JaxbrdfError(f"--budget-seconds is {recipe.budget_seconds}; it must be a positive number")
    return PRESETS[recipe.preset]()
