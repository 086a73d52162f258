"""The grids of candidates that are compared and chosen from, from the least to the most capable."""

from __future__ import annotations

from dataclasses import replace

from jaxbrdf.errors import JaxbrdfError
from jaxbrdf.jobs.candidate import Candidate

ANALYTIC = tuple(Candidate(name) for name in ("ggx-only", "ggx", "ggx2", "principled", "abc"))
"""The cheap end of every comparison, by the SMAPE that experiments/bench_least_squares.py finds."""

CAPABILITY = (
    *ANALYTIC,
    Candidate("naive-mlp"),
    Candidate("naive-mlp", (32, 32)),
    Candidate("nbrdf"),
    Candidate("nbrdf", (24, 24, 24)),
    Candidate("tripleplane"),
    Candidate("gated"),
    Candidate("gated", (8, 8)),
    Candidate("tripleplane", (24, 24)),
    Candidate("gated", (12, 12)),
    Candidate("gated", (16, 16), d_texels=20),
    Candidate("gated", (16, 16)),
    Candidate("gated", (16, 16), d_texels=80),
    Candidate("gated", (32, 32)),
)
"""What there is to choose from, by the geometric mean of the errors that short fits reach (docs/pareto.md). Of one
model, wide stands above narrow and fine above coarse, which pays in longer fits."""

TEXTURED = ("gated", "tripleplane")
"""Models that there is a float16 variant of: texels are stored so, the weights of a network are not."""


def _with_halves(candidates: tuple[Candidate, ...]) -> tuple[Candidate, ...]:
    """Each candidate, and behind it the same in float16 where it has texels."""
    precisions = {one: ("float32", "float16") if one.model in TEXTURED else ("float32",) for one in candidates}
    return tuple(replace(one, precision=precision) for one in candidates for precision in precisions[one])


GRIDS = {
    "small": (
        *ANALYTIC,
        Candidate("naive-mlp"),
        Candidate("nbrdf"),
        Candidate("tripleplane"),
        Candidate("gated"),
        *_with_halves((Candidate("gated", (16, 16)),)),
    ),
    "full": _with_halves(CAPABILITY),
}


def grid_of(name: str) -> tuple[Candidate, ...]:
    """The grid of a name.

    Raises:
        JaxbrdfError: if there is none.
    """
    if name not in GRIDS:
        raise JaxbrdfError(f"no grid is called {name!r}; there are {', '.join(GRIDS)}")
    return GRIDS[name]
