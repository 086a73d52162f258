"""Queries on which reflectance code likes to break, each with its reason."""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax.typing import DTypeLike

from jaxbrdf.types import Query

_HALF = float(np.sqrt(0.5))


class HardQuery(NamedTuple):
    """A pair of directions and what is hard about it."""

    name: str
    wi: tuple[float, float, float]
    wo: tuple[float, float, float]
    reason: str


HARD_QUERIES = (
    HardQuery("both at the normal", (0, 0, 1), (0, 0, 1), "half vector at the pole, difference vector at its pole"),
    HardQuery("retroreflection", (0.6, 0, 0.8), (0.6, 0, 0.8), "difference vector at its pole, phi_d undefined"),
    HardQuery("mirror", (_HALF, 0, _HALF), (-_HALF, 0, _HALF), "half vector exactly the normal, phi_h undefined"),
    HardQuery("almost mirror", (_HALF, 1e-7, _HALF), (-_HALF, 0, _HALF), "half vector one rounding from the normal"),
    HardQuery("mirror across y", (0, 0.6, 0.8), (0, -0.6, 0.8), "azimuth at plus and minus pi / 2"),
    HardQuery("azimuth seam", (-0.6, 0.0, 0.8), (-0.6, -0.0, 0.8), "atan2 jumps between pi and -pi at a signed zero"),
    HardQuery("across the seam", (-0.6, 1e-8, 0.8), (-0.6, -1e-8, 0.8), "azimuths a turn apart, directions 2e-8 apart"),
    HardQuery("a subnormal turn", (1e-40, 0, 1), (0, 1e-40, 1), "compiled code takes these numbers as zero"),
    HardQuery("light at the horizon", (1, 0, 0), (0, 0, 1), "cosine exactly zero, the value's discontinuity"),
    HardQuery("viewer at the horizon", (0, 0, 1), (0, 1, 0), "cosine exactly zero, the value's discontinuity"),
    HardQuery("both at the horizon", (1, 0, 0), (0, 1, 0), "both cosines exactly zero"),
    HardQuery("opposed at the horizon", (1, 0, 0), (-1, 0, 0), "the half vector has length zero"),
    HardQuery("opposed, just above", (1, 0, 1e-8), (-1, 0, 1e-8), "the half vector is made of rounding errors"),
    HardQuery("opposed to 1e-7", (1, 1e-7, 1e-7), (-1, 0, 1e-7), "the half vector lies along a difference of 1e-7"),
    HardQuery("opposed, tiny", (1, 0, 1e-30), (-1, 0, 1e-30), "squares of the half vector underflow"),
    HardQuery("grazing", (0.8, 0.6, 1e-4), (-0.8, 0.6, 1e-4), "1 / (cos cos) is 1e8"),
    HardQuery("grazing mirror", (1, 0, 1e-6), (-1, 0, 1e-6), "1 / (cos cos) is 1e12 at the lobe's peak"),
    HardQuery("grazing retro", (1, 0, 1e-7), (1, 0, 1e-7), "half vector at the horizon"),
    HardQuery("least cosine", (0.6, 0.8, 1e-7), (0, 0, 1), "a masking term divides by it"),
    HardQuery("half precision's last", (0.8, -0.6, 6e-8), (-0.6, 0, 0.8), "the least number that float16 holds"),
    HardQuery("light tiny above", (1, 0, 1e-38), (0, 0, 1), "the cosine is subnormal"),
    HardQuery("light below", (0.6, 0, -0.8), (0, 0, 1), "below the horizon, the value must be zero"),
    HardQuery("both below", (0, 0.6, -0.8), (0, -0.6, -0.8), "below the horizon, squares hide the sign"),
    HardQuery("opposed through the surface", (0.6, 0, 0.8), (-0.6, 0, -0.8), "the half vector has length zero"),
    HardQuery("not quite unit", (0.6000001, 0, 0.8000001), (0.6000001, 0, 0.8000001), "inner products exceed one"),
)


def hard_queries(*, dtype: DTypeLike = jnp.float32) -> Query:
    """The table's directions as arrays `(n, 3)`."""
    return Query(jnp.array([q.wi for q in HARD_QUERIES], dtype), jnp.array([q.wo for q in HARD_QUERIES], dtype))
