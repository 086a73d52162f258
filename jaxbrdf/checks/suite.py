"""All checks of a material, one function each over one kind of subject: what tests and `jaxbrdf stability` run."""

from __future__ import annotations

from collections.abc import Callable
from types import MappingProxyType
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.checks.chi_square import chi_square, expected_mass, significance_of_each
from jaxbrdf.checks.derivative import derivative_mismatch
from jaxbrdf.checks.finite import find_faults
from jaxbrdf.checks.furnace import directional_albedo
from jaxbrdf.checks.hard import HARD_QUERIES
from jaxbrdf.checks.parity import demanding_queries
from jaxbrdf.checks.partition import Partition, partition_around
from jaxbrdf.checks.precision import relative_loss
from jaxbrdf.checks.reciprocity import asymmetry
from jaxbrdf.checks.sampler import sampler_mismatch
from jaxbrdf.core.directions import spherical
from jaxbrdf.types import Material, Query

VIEWERS = (0.0, 0.6, 1.1, 1.45)
"""Angles of the viewer in radians, at azimuth 0.7."""

SEEDS, SIGNIFICANCE = 3, 0.01
SLOPE_BOUND = 1e-4
DENSITY_BOUND = 5e-3
"""A density that is off by 2 % is seen; the quadrature over the cells leaves a thousandth at most."""


class Subject(NamedTuple):
    """A material and what it promises; what it does not promise is measured and told.

    Attributes:
        material: what is checked.
        reciprocal: f(wi, wo) = f(wo, wi) by construction.
        conserving: no more light leaves than comes.
        loss: the largest relative difference of float32 to float64.
        slack: `query -> (n,)`, what is allowed beyond that, if anything is.
    """

    material: Material
    reciprocal: bool = False
    conserving: bool = False
    loss: float = 1e-4
    slack: Callable[[Query], np.ndarray] | None = None


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


def run_checks(key: jax.Array, subject: Subject) -> list[Verdict]:
    """Every check that the subject admits: without a sampler, those of samplers are left out."""
    keys = jax.random.split(key, len(CHECKS))
    verdicts = [check(k, subject) for k, check in zip(keys, CHECKS.values(), strict=True)]
    return [verdict for verdict in verdicts if verdict is not None]


def _finite(key: jax.Array, subject: Subject) -> Verdict:
    """Values and gradients on the hard queries; values are not negative, and zero below the horizon."""
    del key
    _, brdf, params, _ = subject.material
    floating = all(jnp.issubdtype(jnp.asarray(leaf).dtype, jnp.floating) for leaf in jax.tree.leaves(params))
    faults = find_faults(brdf, params, through_params=floating)
    note = f"{faults[0].query.name}: {faults[0].fault}" if faults else f"{len(HARD_QUERIES)} hard queries"
    return Verdict("finite", not faults, float(len(faults)), 0.0, note)


def _precision(key: jax.Array, subject: Subject) -> Verdict:
    query = demanding_queries(key, count=2048)
    loss = relative_loss(subject.material.brdf, subject.material.params, query)
    if subject.slack is not None:
        loss = np.maximum(loss - subject.slack(query), 0.0)
    worst = int(np.argmax(loss))
    return _at_most("precision", float(loss[worst]), subject.loss, _place(query, worst))


def _derivative(key: jax.Array, subject: Subject) -> Verdict:
    """Nine of ten slopes must agree: a step may cross a kink of interpolated tables."""
    key_query, key_turn = jax.random.split(key)
    query = _ordinary_pairs(key_query, 256)
    mismatch = derivative_mismatch(key_turn, subject.material.brdf, subject.material.params, query)
    return _at_most("derivative", float(np.quantile(mismatch, 0.9)), SLOPE_BOUND, "slopes of ln f, 90th percentile")


def _reciprocity(key: jax.Array, subject: Subject) -> Verdict:
    query = demanding_queries(key, count=2048)
    found = np.asarray(jax.jit(asymmetry, static_argnums=0)(*subject.material[1:3], query)).max(axis=-1)
    worst = int(np.argmax(found))
    bound = subject.loss if subject.reciprocal else np.nan
    return _at_most("reciprocity", float(found[worst]), bound, _place(query, worst))


def _energy(key: jax.Array, subject: Subject) -> Verdict:
    """The largest directional albedo, less three standard errors."""
    found = []
    for k, theta in zip(jax.random.split(key, len(VIEWERS)), VIEWERS, strict=True):
        albedo = directional_albedo(k, *subject.material[1:3], viewer(theta), samples=2**15)
        found.append(float(np.max(albedo.value - 3.0 * albedo.standard_error)))
    bound = 1.0 + subject.loss if subject.conserving else np.nan
    return _at_most("energy", max(found), bound, f"viewer at {np.degrees(VIEWERS[int(np.argmax(found))]):.0f} degrees")


def _density(key: jax.Array, subject: Subject) -> Verdict | None:
    """The density over the hemisphere and the share of draws below it are one together."""
    if not _can_sample(subject):
        return None
    faults = [abs(_total(k, subject, viewer(t)) - 1.0) for k, t in zip(_keys(key), VIEWERS, strict=True)]
    note = f"viewer at {np.degrees(VIEWERS[int(np.argmax(faults))]):.0f} degrees"
    return _at_most("density", max(faults), DENSITY_BOUND, note)


def _sampler(key: jax.Array, subject: Subject) -> Verdict | None:
    """Chi-square of draws against the density: the least chance, and what it must not fall below."""
    if not _can_sample(subject):
        return None
    chances = []
    for theta in VIEWERS:
        partition = _partition(key, subject, viewer(theta))
        for seed in range(SEEDS):
            drawn = jax.random.fold_in(key, seed)
            found = chi_square(drawn, *subject.material[1:3], viewer(theta), partition=partition, points=32)
            chances.append(found.p_value)
    least = significance_of_each(SIGNIFICANCE, len(chances))
    return Verdict("sampler", min(chances) > least, min(chances), least, f"least chance of {len(chances)} chi-squares")


def _weight(key: jax.Array, subject: Subject) -> Verdict | None:
    """The drawn weight times the density is f cos: the 99th percentile, since rounding moves draws of narrow lobes."""
    if not _can_sample(subject):
        return None
    wo = jnp.repeat(jnp.stack([viewer(theta) for theta in VIEWERS]), 2048, axis=0)
    u = jax.random.uniform(key, (len(wo), 3))
    mismatch = jax.jit(sampler_mismatch, static_argnums=0)(*subject.material[1:3], wo, u)
    worst = float(np.quantile(np.maximum(mismatch.pdf, mismatch.weight), 0.99))
    return _at_most("weight", worst, 1e-2, "99th percentile")


CHECKS: MappingProxyType[str, Callable[[jax.Array, Subject], Verdict | None]] = MappingProxyType(
    {
        "finite": _finite,
        "precision": _precision,
        "derivative": _derivative,
        "reciprocity": _reciprocity,
        "energy": _energy,
        "density": _density,
        "sampler": _sampler,
        "weight": _weight,
    }
)


def _at_most(check: str, value: float, bound: float, note: str) -> Verdict:
    return Verdict(check, None if np.isnan(bound) else bool(value <= bound), value, bound, note)


def _can_sample(subject: Subject) -> bool:
    return subject.material.brdf.sample is not None and subject.material.brdf.pdf is not None


def viewer(theta: float) -> jax.Array:
    """The direction `(3,)` of a viewer that checks look from, by its angle in radians."""
    return spherical(jnp.array(theta), jnp.array(0.7))


def _keys(key: jax.Array) -> jax.Array:
    return jax.random.split(key, len(VIEWERS))


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
    viewer = jnp.broadcast_to(wo, (2**14, 3))
    u = jax.random.uniform(key, (2**14, 3))
    sample = subject.material.brdf.sample
    assert sample is not None
    return np.asarray(jax.jit(sample)(subject.material.params, Query(viewer, viewer), u).wi, np.float64)


def _partition(key: jax.Array, subject: Subject, wo: jax.Array) -> Partition:
    return partition_around(_draws(key, subject, wo), wo)


def _total(key: jax.Array, subject: Subject, wo: jax.Array) -> float:
    partition = _partition(key, subject, wo)
    mass = expected_mass(*subject.material[1:3], wo, partition=partition, cells=48, points=32)
    return float(mass.sum() + np.mean(_draws(key, subject, wo)[:, 2] <= 0))
