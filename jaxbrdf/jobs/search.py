"""Fit the cheapest model that meets a budget of time, of error, or of both."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import NamedTuple

import pyopencl as cl

from jaxbrdf.errors import BudgetError, FitError, OpenCLError
from jaxbrdf.export.bundle import Bundle
from jaxbrdf.jobs import judge
from jaxbrdf.jobs.budget import Budget, Rejected, check_budget, within_price
from jaxbrdf.jobs.candidate import Candidate
from jaxbrdf.jobs.candidate_prices import candidate_prices, forget_prices
from jaxbrdf.jobs.finishing import finished
from jaxbrdf.jobs.fit import FitResult, write_fit
from jaxbrdf.jobs.fit_config import FitConfig, FitPaths, output_paths, prepare_output
from jaxbrdf.jobs.grid import CAPABILITY
from jaxbrdf.jobs.price import Price
from jaxbrdf.jobs.progress import Reporter
from jaxbrdf.jobs.recipe import preset_of
from jaxbrdf.jobs.reference import open_reference
from jaxbrdf.jobs.store import Store, clear, obtain
from jaxbrdf.opencl.platform import choose, context_of


class Choice(NamedTuple):
    """The candidate that was taken, its bundle as fitted, and the others."""

    candidate: Candidate
    bundle: Bundle
    rejected: list[Rejected]


def search(config: FitConfig, budget: Budget, reporter: Reporter) -> FitResult:
    """Fits the cheapest candidate that meets the budget, and writes it as `fit` does, with what was rejected.

    Without a bound on the error, the most capable candidate within the time is fitted, alone. With one, candidates are
    fitted from the cheapest upwards until one meets it. Fits lie in a folder beside the output until the result is
    there.

    Raises:
        BudgetError: if no candidate meets the budget; what was fitted stays.
        JaxbrdfError: if the input, the output or the request cannot be used.
    """
    check_budget(budget)
    preset_of(config.recipe)
    context = _context()
    reference = open_reference(config.source)
    paths = output_paths(config.output)
    folder = candidates_folder(paths)
    _prepare(folder, paths, config.resume)
    store = Store(folder, reference, config.recipe, functools.cache(lambda: judge.draw(reference.material)))
    candidates = considered(config, budget)
    isotropic = reference.material.isotropic
    prices = candidate_prices(folder, candidates, context, isotropic=isotropic, reporter=reporter)
    choice = _choose(store, candidates, prices, budget, reporter)
    result = _write(config, budget, choice, store, paths, reporter)
    clear(folder)
    return result


def considered(config: FitConfig, budget: Budget) -> list[Candidate]:
    """The candidates that the request leaves, from the least to the most capable, in the precision that it names."""
    left = [c for c in CAPABILITY if budget.model in (None, c.model) and not (config.paper_sizes and c.hidden)]
    return [replace(candidate, precision=config.precision) for candidate in left]


def candidates_folder(paths: FitPaths) -> Path:
    """Where a search keeps its fits until it ends."""
    return paths.checkpoint.with_suffix(".candidates")


def _context() -> cl.Context:
    try:
        return context_of(choose())
    except OpenCLError as error:
        raise OpenCLError(f"candidates are priced by OpenCL: {error}") from None


def _prepare(folder: Path, paths: FitPaths, resume: bool) -> None:
    if resume and not folder.is_dir():
        raise FitError(f"{folder}: no search to resume")
    prepare_output(paths)
    if not resume:
        clear(folder)


def _choose(
    store: Store, candidates: Sequence[Candidate], prices: Mapping[str, Price], budget: Budget, reporter: Reporter
) -> Choice:
    try:
        affordable, slow = within_price(candidates, prices, budget.max_ns)
    except BudgetError:
        forget_prices(store.folder)
        raise
    if budget.max_error is not None:
        return _cheapest(store, affordable, slow, prices, budget, reporter)
    *others, best = affordable
    less = [Rejected(c.name, prices[c.name].ns, None, f"less capable than {best.name}") for c in others]
    reporter.say(f"{best.name} is the most capable within {budget.max_ns:g} ns")
    return Choice(best, obtain(store, best, reporter), less + slow)


def _cheapest(
    store: Store,
    affordable: Sequence[Candidate],
    slow: list[Rejected],
    prices: Mapping[str, Price],
    budget: Budget,
    reporter: Reporter,
) -> Choice:
    """The first candidate that meets the bound on the error, from the cheapest upwards."""
    rising = sorted(affordable, key=lambda candidate: prices[candidate.name].ns)
    rejected = []
    for place, candidate in enumerate(rising):
        ns = prices[candidate.name].ns
        found = _fitted(store, candidate, ns, budget, reporter)
        if not isinstance(found, Rejected):
            reason = f"dearer than {candidate.name}: not fitted"
            dearer = [Rejected(c.name, prices[c.name].ns, None, reason) for c in rising[place + 1 :]]
            return Choice(candidate, found, rejected + dearer + slow)
        rejected.append(found)
    raise _nothing(store, rejected, affordable, budget)


def _fitted(store: Store, candidate: Candidate, ns: float, budget: Budget, reporter: Reporter) -> Bundle | Rejected:
    """The candidate's bundle if it meets the bound on the error."""
    try:
        bundle = obtain(store, candidate, reporter)
    except FitError as error:
        return Rejected(candidate.name, ns, None, str(error))
    error = bundle.manifest.errors[judge.METRICS[budget.metric]]
    reporter.say(f"{candidate.name}: {budget.metric} {error:.4g} at {ns:.1f} ns")
    if budget.max_error is None or error <= budget.max_error:
        return bundle
    return Rejected(candidate.name, ns, error, f"{budget.metric} above {budget.max_error:g}")


def _nothing(
    store: Store, rejected: Sequence[Rejected], candidates: Sequence[Candidate], budget: Budget
) -> BudgetError | FitError:
    """What is to be said when no candidate meets the bound on the error."""
    judged = [one for one in rejected if one.error is not None]
    if not judged:
        return FitError(f"no candidate could be fitted: {rejected[0].candidate}: {rejected[0].reason}")
    closest = min(judged, key=lambda one: one.error or 0.0)
    file = next(store.file(candidate) for candidate in candidates if candidate.name == closest.candidate)
    return BudgetError(
        f"no candidate reaches {budget.metric} {budget.max_error:g}: {closest.candidate} is closest with "
        f"{closest.error:.4g} at {closest.ns:.1f} ns, kept in {file}; with another budget, --resume takes it as it is"
    )


def _write(
    config: FitConfig, budget: Budget, choice: Choice, store: Store, paths: FitPaths, reporter: Reporter
) -> FitResult:
    candidate = choice.candidate
    done = replace(config, model=candidate.model, paper_sizes=candidate.hidden is None and not candidate.is_analytic)
    whole = finished(choice.bundle, done, store.draws(), reporter)
    rejected = [one._asdict() for one in choice.rejected]
    more = {"candidate": candidate.name, "budget": asdict(budget), "rejected": rejected}
    return write_fit(done, store.reference, whole, paths, more=more)
