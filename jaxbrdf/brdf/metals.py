"""Metals as `Conductor` records by name, from published measurements of their refractive index.

eta and k of a channel are no wavelength's: they are the pair with the metal's spectral reflectance at normal incidence
under D65, and the closest to it over the angles (`jaxbrdf.data.conductor`, experiments/derive_metals.py). Their
reflectance is within 0.001 of the spectral one at every angle, copper's within 0.004 and gold's within 0.009; gold's
red lies outside Rec.709, at 1.038, and is 0.999 here. A thin film on them is less exact, as its colour depends on how
the index changes within a channel: within 0.05 for most, 0.13 for copper and 0.23 for gold (0.03 in the root mean
square), for an index of 1.5 and up to 1000 nm.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType
from typing import NamedTuple

import jax.numpy as jnp

from jaxbrdf.core.fresnel import Conductor

Triple = tuple[float, float, float]


class Metal(NamedTuple):
    """A row of `INDICES`.

    Attributes:
        eta, k: real and imaginary part of the refractive index for R, G and B.
        file: of refractiveindex.info, that the numbers are from.
        source: authors and year of the measurement.
    """

    eta: Triple
    k: Triple
    file: str
    source: str


JOHNSON_1972, JOHNSON_1974 = "Johnson and Christy 1972", "Johnson and Christy 1974"

INDICES: Mapping[str, Metal] = MappingProxyType(
    {
        "aluminium": Metal((1.498, 0.9846, 0.6048), (7.643, 6.548, 5.345), "main_Al_nk_Rakic.yml", "Rakić 1995"),
        "chromium": Metal((3.247, 3.114, 2.285), (3.286, 3.336, 3.117), "main_Cr_nk_Johnson.yml", JOHNSON_1974),
        "cobalt": Metal((2.257, 2.035, 1.713), (4.228, 3.795, 3.238), "main_Co_nk_Johnson.yml", JOHNSON_1974),
        "copper": Metal((0.2241, 1.044, 1.296), (3.41, 2.625, 2.362), "main_Cu_nk_Johnson.yml", JOHNSON_1972),
        "gold": Metal((0.004198, 0.4983, 1.471), (3.973, 2.257, 1.776), "main_Au_nk_Johnson.yml", JOHNSON_1972),
        "iron": Metal((2.923, 2.919, 2.546), (3.077, 2.937, 2.75), "main_Fe_nk_Johnson.yml", JOHNSON_1974),
        "nickel": Metal((2.034, 1.903, 1.729), (4.202, 3.57, 2.896), "main_Ni_nk_Johnson.yml", JOHNSON_1974),
        "platinum": Metal((2.358, 2.068, 1.827), (4.254, 3.679, 3.092), "main_Pt_nk_Rakic-BB.yml", "Rakić et al. 1998"),
        "silver": Metal((0.05564, 0.05492, 0.04319), (4.45, 3.546, 2.588), "main_Ag_nk_Johnson.yml", JOHNSON_1972),
        "titanium": Metal((2.748, 2.508, 2.24), (3.844, 3.397, 3.015), "main_Ti_nk_Johnson.yml", JOHNSON_1974),
        "tungsten": Metal((3.636, 3.494, 3.314), (2.924, 2.748, 2.506), "main_W_nk_Weaver.yml", "Weaver et al. 1975"),
    }
)


def _conductor(metal: Metal) -> Conductor:
    return Conductor(jnp.array(metal.eta), jnp.array(metal.k))


METALS: Mapping[str, Callable[[], Conductor]] = MappingProxyType(
    {name: partial(_conductor, metal) for name, metal in INDICES.items()}
)
