"""The steps of every fit: a candidate's task, its bundle, and the judgement of what is stored."""

from __future__ import annotations

import math
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

import jax
import numpy as np

from jaxbrdf.checks.parity import random_params
from jaxbrdf.errors import FitError
from jaxbrdf.export import bundle as bundles
from jaxbrdf.export.bundle import Bundle, Precision
from jaxbrdf.export.manifest import Manifest, Provenance
from jaxbrdf.jobs import judge
from jaxbrdf.jobs.candidate import Candidate
from jaxbrdf.jobs.progress import Reporter
from jaxbrdf.jobs.recipe import Recipe, preset_of
from jaxbrdf.jobs.reference import Reference
from jaxbrdf.jobs.solving import Problem, solve_for
from jaxbrdf.jobs.supply import pools_of
from jaxbrdf.jobs.training import Task, Trained
from jaxbrdf.models.table import MODELS, first_params


class Judged(NamedTuple):
    """A bundle as a reader of its file gets it, its manifest with its errors, and what it is judged by."""

    bundle: Bundle
    judgement: judge.Judgement


def solved(candidate: Candidate, reference: Reference, recipe: Recipe, reporter: Reporter) -> Trained:
    """An analytic candidate's parameters by least squares, for which the recipe's seed alone counts.

    Raises:
        JaxbrdfError: if the recipe cannot be used, or the fit fails.
    """
    preset_of(recipe)
    return solve_for(problem_of(candidate, reference, recipe), reporter)


def problem_of(candidate: Candidate, reference: Reference, recipe: Recipe) -> Problem:
    """What an analytic candidate's parameters solve."""
    config = candidate.sizes(isotropic=reference.material.isotropic)
    return Problem(candidate.model, config, reference.evaluate, recipe.seed)


def task_of(candidate: Candidate, reference: Reference, recipe: Recipe, checkpoint: Path) -> Task:
    """What is to be trained, with its running state in `checkpoint`.

    Raises:
        JaxbrdfError: if the recipe cannot be used.
    """
    sizes = candidate.sizes(isotropic=reference.material.isotropic)
    record = {"input": reference.identity, "model": repr(sizes), "preset": recipe.preset}
    return Task(
        model=MODELS[candidate.model].build(sizes),
        supplier=pools_of(reference.evaluate),
        preset=preset_of(recipe),
        seed=recipe.seed,
        checkpoint=checkpoint,
        record={**record, "seed": recipe.seed, "devices": len(jax.devices())},
    )


def bundle_of(candidate: Candidate, reference: Reference, recipe: Recipe, trained: Trained) -> Bundle:
    """The result of a training with where it comes from; not judged yet."""
    source = reference.source
    provenance = Provenance(
        input=source.path.name if source.path else source.material.name,
        sha256=source.sha256,
        version=version("jaxbrdf"),
        seed=recipe.seed,
        preset="least-squares" if candidate.is_analytic else recipe.preset,
        steps=trained.steps,
    )
    sizes = candidate.sizes(isotropic=source.material.isotropic)
    manifest = Manifest(source.material.name, candidate.model, sizes, provenance, errors={}, cost=trained.cost)
    return Bundle(manifest, trained.params)


def unfitted(candidate: Candidate, *, isotropic: bool) -> Bundle:
    """A bundle of the candidate with random numbers, which costs an evaluation what a fitted one does; a little more
    where the range of a fit's numbers makes clamps superfluous."""
    sizes = candidate.sizes(isotropic=isotropic)
    nowhere = Provenance("", "", version("jaxbrdf"), 0, "", 0)
    if candidate.is_analytic:
        params = jax.tree.map(np.asarray, first_params(jax.random.key(0), candidate.model, sizes))
    else:
        params = random_params(0, MODELS[candidate.model].build(sizes))
    bundle = Bundle(Manifest(candidate.name, candidate.model, sizes, nowhere, errors={}, cost={}), params)
    return bundles.from_bytes(bundles.to_bytes(bundle, precision=candidate.precision), candidate.name)


def judged_as_stored(bundle: Bundle, precision: Precision, draws: judge.Draws) -> Judged:
    """The bundle rounded to its precision, which its errors include.

    Raises:
        FitError: if the precision does not hold it, or an error is not finite.
    """
    try:
        stored = bundles.from_bytes(bundles.to_bytes(bundle, precision=precision), bundle.manifest.name)
    except ValueError as error:
        raise FitError(str(error)) from None
    judgement = judge.judgement(bundles.material(stored), draws)
    for name, value in judgement.errors.items():
        if not math.isfinite(value):
            raise FitError(f"the fit's {name} is {value}")
    return Judged(stored._replace(manifest=stored.manifest._replace(errors=judgement.errors)), judgement)
