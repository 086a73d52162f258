"""All checks of a material, one function each over one kind of subject: what tests and `jaxbrdf stability` run."""

from __future__ import annotations

from collections.abc import Callable
from types import MappingProxyType
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.checks.chi_square import chi_square_of_draws, expected_mass, significance_of_each
from jaxbrdf.checks.compiled import draws
from jaxbrdf.checks.derivative import derivative_mismatch, parameter_mismatch
from jaxbrdf.checks.extremes import extremes
from jaxbrdf.checks.finite import find_faults, find_faults_of_any
from jaxbrdf.checks.furnace import directional_albedo
from jaxbrdf.checks.hard import HARD_QUERIES
from jaxbrdf.checks.parity import demanding_queries
from jaxbrdf.checks.partition import partition_around
from jaxbrdf.checks.precision import relative_loss
from jaxbrdf.checks.reciprocity import asymmetry
from jaxbrdf.checks.sampler import sampler_mismatch
from jaxbrdf.core.directions import spherical
from jaxbrdf.types import Material, Params, Query

VIEWERS = (0.0, 0.6, 1.1, 1.45)
"""Angles of the viewer in radians, at azimuth 0.7."""

SEEDS, SIGNIFICANCE = 3, 0.01
DRAWS = 2**16
PLACED = 2**14
"""Draws that decide where the cells are."""

POINTS = (16, 32, 96)
"""Along each side of a cell, to sum the density: at first, and one after the other for what does not pass."""

SLOPE_BOUND = 1e-4
DENSITY_BOUND = 5e-3
"""A density that is off by 2 % is seen; the share of 2^16 draws of three seeds that are lost has a standard error of
1.1e-3 at most, and the quadrature over the cells leaves some thousandths."""


class Subject(NamedTuple):
    """A material and what it promises; what it does not promise is measured and told.

    Attributes:
        material: what is checked.
        reciprocal: f(wi, wo) = f(wo, wi) by construction.
        conserving: no more light leaves than comes.
        loss: the largest relative difference of float32 to float64.
        slack: `query -> (n,)`, what is allowed beyond that, if anything is.
        hard: more parameters at which value and gradient must be finite, as at the ends of the declared ranges.
    """

    material: Material
    reciprocal: bool = False
    conserving: bool = False
    loss: float = 1e-4
    slack: Callable[[Query], np.ndarray] | None = None
    hard: tuple[Params, ...] = ()


class Verdict(NamedTuple):
    """What a check found.

    Attributes:
        check: its name.
        passed: None where the subject promises nothing.
        value: the worst that was found.
        bound: what is allowed; NaN where nothing is.
        note: where or how, in a few words.
    """

    check: str
    passed: bool | None
    value: float
    bound: float
    note: str


def run_checks(key: jax.Array, subject: Subject, *, tell: Callable[[int, str], None] | None = None) -> list[Verdict]:
    """Every check that the subject admits: without a sampler, those of samplers are left out.

    Args:
        tell: called before each step, of `STEPS` in all, with the number of those done and the name of the next.
    """
    verdicts, keys = [], jax.random.split(key, len(STEPS))
    for done, (name, k) in enumerate(zip(STEPS, keys, strict=True)):
        if tell is not None:
            tell(done, name)
        verdicts += CHECKS[name](k, subject)
    return verdicts


def _finite(key: jax.Array, subject: Subject) -> list[Verdict]:
    """Values and gradients on the hard queries; values are not negative, and zero below the horizon."""
    del key
    _, brdf, params, _ = subject.material
    if _is_floating(params):
        faults = find_faults_of_any(brdf, extremes(params, hard=subject.hard))
    else:
        faults = find_faults(brdf, params, through_params=False)
    note = f"{len(HARD_QUERIES)} hard queries"
    if faults:
        note = f"{faults[0].query.name}: {faults[0].fault}, variant {faults[0].variant} of the parameters"
    return [Verdict("finite", not faults, float(len(faults)), 0.0, note)]


def _precision(key: jax.Array, subject: Subject) -> list[Verdict]:
    query = demanding_queries(key, count=2048)
    loss = relative_loss(subject.material.brdf, subject.material.params, query)
    if subject.slack is not None:
        loss = np.maximum(loss - subject.slack(query), 0.0)
    worst = int(np.argmax(loss))
    return [_at_most("precision", float(loss[worst]), subject.loss, _place(query, worst))]


def _derivative(key: jax.Array, subject: Subject) -> list[Verdict]:
    """By the parameters, and by directions nine of ten slopes: a step may cross a kink of interpolated tables."""
    key_query, key_turn = jax.random.split(key)
    query = _ordinary_pairs(key_query, 256)
    brdf, params = subject.material[1:3]
    worst = {"directions, 90th percentile": float(np.quantile(derivative_mismatch(key_turn, brdf, params, query), 0.9))}
    if _is_floating(params):
        worst["parameters"] = parameter_mismatch(key_turn, brdf, params, query)
    note = max(worst, key=worst.__getitem__)
    return [_at_most("derivative", worst[note], SLOPE_BOUND, f"slopes of ln f by {note}")]


def _reciprocity(key: jax.Array, subject: Subject) -> list[Verdict]:
    query = demanding_queries(key, count=2048)
    found = asymmetry(*subject.material[1:3], query).max(axis=-1)
    worst = int(np.argmax(found))
    bound = subject.loss if subject.reciprocal else np.nan
    return [_at_most("reciprocity", float(found[worst]), bound, _place(query, worst))]


def _energy(key: jax.Array, subject: Subject) -> list[Verdict]:
    """The largest directional albedo, less three standard errors."""
    found = []
    for k, theta in zip(jax.random.split(key, len(VIEWERS)), VIEWERS, strict=True):
        albedo = directional_albedo(k, *subject.material[1:3], viewer(theta), samples=2**15)
        found.append(float(np.max(albedo.value - 3.0 * albedo.standard_error)))
    bound = 1.0 + subject.loss if subject.conserving else np.nan
    return [
        _at_most("energy", max(found), bound, f"viewer at {np.degrees(VIEWERS[int(np.argmax(found))]):.0f} degrees")
    ]


def _sampler(key: jax.Array, subject: Subject) -> list[Verdict]:
    """Density and share of draws below the horizon are one together; chi-square of draws against the density."""
    if not _can_sample(subject):
        return []
    least = significance_of_each(SIGNIFICANCE, SEEDS * len(VIEWERS))
    faults, chances = [], []
    for k, theta in zip(jax.random.split(key, len(VIEWERS)), VIEWERS, strict=True):
        fault, own = _against_density(subject, viewer(theta), _draws(k, subject, viewer(theta)), least)
        faults.append(fault)
        chances += own
    note = f"viewer at {np.degrees(VIEWERS[int(np.argmax(faults))]):.0f} degrees"
    found = Verdict("sampler", min(chances) > least, min(chances), least, f"least chance of {len(chances)} chi-squares")
    return [_at_most("density", max(faults), DENSITY_BOUND, note), found]


def _against_density(subject: Subject, wo: jax.Array, drawn: np.ndarray, least: float) -> tuple[float, list[float]]:
    """How far density and lost draws are from one together, and the chance of each seed's draws `(SEEDS, DRAWS, 3)`.

    Draws that do not pass are held against a finer sum over the cells, which thin lobes at grazing views need.
    """
    partition, fault, chances = partition_around(drawn[0, :PLACED], wo), np.inf, [0.0]
    for points in POINTS:
        mass = expected_mass(*subject.material[1:3], wo, partition=partition, points=points)
        fault = abs(float(mass.sum() + np.mean(drawn[..., 2] <= 0)) - 1.0)
        chances = [chi_square_of_draws(wi, mass, partition=partition).p_value for wi in drawn]
        if fault <= DENSITY_BOUND and min(chances) > least:
            break
    return fault, chances


def _weight(key: jax.Array, subject: Subject) -> list[Verdict]:
    """The drawn weight times the density is f cos: the 99th percentile, since rounding moves draws of narrow lobes."""
    if not _can_sample(subject):
        return []
    brdf, params = subject.material[1:3]
    wo = jnp.repeat(jnp.stack([viewer(theta) for theta in VIEWERS]), 2048, axis=0)
    mismatch = sampler_mismatch(brdf, params, wo, jax.random.uniform(key, wo.shape))
    worst = float(np.quantile(np.maximum(*mismatch), 0.99))
    return [_at_most("weight", worst, 1e-2, "99th percentile")]


CHECKS: MappingProxyType[str, Callable[[jax.Array, Subject], list[Verdict]]] = MappingProxyType(
    {
        "finite": _finite,
        "precision": _precision,
        "derivative": _derivative,
        "reciprocity": _reciprocity,
        "energy": _energy,
        "density": _sampler,
        "sampler": _sampler,
        "weight": _weight,
    }
)


STEPS = tuple(name for name in CHECKS if name != "sampler")
"""The functions of `CHECKS`, each by one name: density and sampler are checked by the same."""


def _is_floating(params: Params) -> bool:
    kinds = [jnp.asarray(leaf).dtype for leaf in jax.tree.leaves(params)]
    return bool(kinds) and all(jnp.issubdtype(kind, jnp.floating) for kind in kinds)


def _at_most(check: str, value: float, bound: float, note: str) -> Verdict:
    return Verdict(check, None if np.isnan(bound) else bool(value <= bound), value, bound, note)


def _can_sample(subject: Subject) -> bool:
    return subject.material.brdf.sample is not None and subject.material.brdf.pdf is not None


def viewer(theta: float) -> jax.Array:
    """The direction `(3,)` of a viewer that checks look from, by its angle in radians."""
    return spherical(jnp.array(theta), jnp.array(0.7))


def _ordinary_pairs(key: jax.Array, count: int) -> Query:
    """Pairs at least 0.1 radian from normal and horizon, and as far from each other's mirror image as may be."""
    u = np.asarray(jax.random.uniform(key, (4, count)), np.float64)
    theta, phi = 0.1 + 1.3 * u[:2], 2.0 * np.pi * u[2:]
    wi, wo = spherical(jnp.asarray(theta, jnp.float32), jnp.asarray(phi, jnp.float32))
    return Query(wi, wo)


def _place(query: Query, index: int) -> str:
    wi, wo = (np.asarray(w[index]) for w in query[:2])
    return f"wi {_plain(wi)}, wo {_plain(wo)}"


def _plain(w: np.ndarray) -> str:
    return "(" + ", ".join(f"{c:.3g}" for c in w) + ")"


def _draws(key: jax.Array, subject: Subject, wo: jax.Array) -> np.ndarray:
    """Directions `(SEEDS, DRAWS, 3)`."""
    u = jax.random.uniform(key, (SEEDS, DRAWS, 3))
    return np.asarray(draws(*subject.material[1:3], jnp.broadcast_to(wo, u.shape), u).wi, np.float64)
