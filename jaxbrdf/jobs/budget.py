"""A budget that a model has to meet, and which candidates fall to it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from jaxbrdf.errors import BudgetError, JaxbrdfError
from jaxbrdf.jobs.candidate import Candidate, check_model
from jaxbrdf.jobs.judge import METRICS
from jaxbrdf.jobs.price import Price


@dataclass(frozen=True)
class Budget:
    """What is asked of a model; one of the two at least.

    Attributes:
        max_ns: nanoseconds of an OpenCL evaluation.
        max_error: of the fit.
        metric: what that is an error of, a key of `judge.METRICS`.
        model: if given, only this one's candidates are considered.
    """

    max_ns: float | None = None
    max_error: float | None = None
    metric: str = "smape"
    model: str | None = None


class Rejected(NamedTuple):
    """A candidate that was not taken.

    Attributes:
        candidate: its name.
        ns: nanoseconds of an evaluation.
        error: of its fit, by the budget's metric; None if it was not fitted.
        reason: why not, in a few words.
    """

    candidate: str
    ns: float
    error: float | None
    reason: str


def check_budget(budget: Budget) -> None:
    """Finds out whether the budget can be met at all.

    Raises:
        JaxbrdfError: if a number is not positive and finite, or there is no such metric or model.
    """
    limits = {"--max-ns": budget.max_ns, "--max-error": budget.max_error}
    for option, value in limits.items():
        if value is not None and not (math.isfinite(value) and value > 0):
            raise JaxbrdfError(f"{option} is {value}; it must be a positive number")
    if budget.metric not in METRICS:
        raise JaxbrdfError(f"no metric is called {budget.metric!r}; there are {', '.join(METRICS)}")
    if budget.model is not None:
        check_model(budget.model)


def within_price(
    candidates: Sequence[Candidate], prices: Mapping[str, Price], max_ns: float | None
) -> tuple[list[Candidate], list[Rejected]]:
    """The candidates that are fast enough, in their order, and the others.

    Raises:
        BudgetError: if none is.
    """
    slow = [] if max_ns is None else [c for c in candidates if prices[c.name].ns > max_ns]
    if len(slow) == len(candidates):
        fastest = min(candidates, key=lambda c: prices[c.name].ns)
        ns = prices[fastest.name].ns
        raise BudgetError(
            f"no candidate evaluates within {max_ns:g} ns: {fastest.name} is the fastest with {ns:.1f} ns"
        )
    rejected = [Rejected(c.name, prices[c.name].ns, None, f"above {max_ns:g} ns") for c in slow]
    return [c for c in candidates if c not in slow], rejected
