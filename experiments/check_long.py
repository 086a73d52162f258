"""A long search for values and gradients that are not finite, over every subject of tests/checks/subjects.py.

    python -m experiments.check_long [SUBJECT ...] [--count 100000000]

Parameters are drawn over their declared ranges, directions as `jaxbrdf.checks.parity.demanding_queries` has them. The
run time is measured on a few rounds of every subject, and told, before the search begins. Compiled as users compile.
"""

from __future__ import annotations

import argparse
import time
from typing import NamedTuple

import jax

from jaxbrdf.checks.search import search_faults
from jaxbrdf.checks.suite import Subject
from tests.checks.subjects import SUBJECTS

LEARNED, CLOSED = 2, 512
"""Parameters asked together: of networks with textures, whose gradients are large, and of others."""


class Pace(NamedTuple):
    """A subject, how many parameters it is asked at a time, and the seconds that a thousand evaluations take."""

    subject: Subject
    variants: int
    seconds: float


def search(pace: Pace, seed: int, count: int) -> int:
    _, brdf, params, _ = pace.subject.material
    return search_faults(jax.random.key(seed), brdf, params, count=count, variants=pace.variants)


def measured(subject: Subject) -> Pace:
    """The subject's pace, compilation left out."""
    size = sum(leaf.size for leaf in jax.tree.leaves(subject.material.params))
    pace = Pace(subject, LEARNED if size > 10_000 else CLOSED, 0.0)
    search(pace, 0, 1)
    count = 4 * 32 * pace.variants
    start = time.perf_counter()
    search(pace, 1, count)
    return pace._replace(seconds=(time.perf_counter() - start) / count * 1000.0)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("subjects", nargs="*", metavar="SUBJECT", help="search these alone, each as long as among all")
    parser.add_argument("--count", type=int, default=100_000_000, help="evaluations and gradients of all subjects")
    arguments = parser.parse_args()
    if unknown := set(arguments.subjects) - set(SUBJECTS):
        parser.error(f"no subject named {', '.join(sorted(unknown))}; there are {', '.join(SUBJECTS)}")
    count = arguments.count // len(SUBJECTS)
    paces = {name: measured(SUBJECTS[name].make()) for name in arguments.subjects or SUBJECTS}
    minutes = sum(pace.seconds for pace in paces.values()) * count / 1000.0 / 60.0
    print(f"{len(paces)} subjects, {count:,} evaluations and gradients each: about {minutes:.0f} minutes", flush=True)
    total = 0
    for index, (name, pace) in enumerate(paces.items()):
        found = search(pace, 2 + index, count)
        total += found
        print(f"{index + 1:3} of {len(paces)}  {name:44} {found} not finite", flush=True)
    raise SystemExit(f"{total} values or gradients are not finite" if total else 0)


if __name__ == "__main__":
    main()
