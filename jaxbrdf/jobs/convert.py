"""Any material resampled into a MERL or UTIA table."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.brdf.measured import symmetrised
from jaxbrdf.core.directions import above_horizon, from_half_difference, spherical
from jaxbrdf.data import merl, utia
from jaxbrdf.data.output import check_writable, write_atomically
from jaxbrdf.errors import JaxbrdfError
from jaxbrdf.jobs.source import open_source
from jaxbrdf.types import Material, Query

CHUNK = 2**17
MERL_SUFFIX, UTIA_SUFFIX = ".binary", ".bin"


def convert(source: str, output: str) -> Path:
    """Evaluates the material at the format's cells and writes the file, which is returned.

    The suffix chooses: `.binary` for MERL, which knows no azimuth of the half vector and is reciprocal, so that the
    symmetrised material goes there; `.bin` for UTIA.

    Raises:
        JaxbrdfError: if a file cannot be used, or an anisotropic material is to become a MERL file.
    """
    path = Path(output)
    if path.suffix not in (MERL_SUFFIX, UTIA_SUFFIX):
        raise JaxbrdfError(f"{output}: a table's name must end in {MERL_SUFFIX} (MERL) or {UTIA_SUFFIX} (UTIA)")
    check_writable(path)
    material = open_source(source).material
    if path.suffix == UTIA_SUFFIX:
        content = utia.write(utia.Utia(_values(material, utia_directions()).reshape(*utia.SHAPE, 3)))
    elif material.isotropic:
        content = merl.write(_to_merl(symmetrised(material)))
    else:
        raise JaxbrdfError(f"{source}: is anisotropic, which a MERL file cannot hold; write a UTIA {UTIA_SUFFIX}")
    write_atomically(path, content)
    return path


def merl_directions() -> Query:
    """Directions at the centres of MERL's cells, `(cells, 3)`, in the file's order; some are below the horizon."""
    h, d, p = (((np.arange(n) + 0.5) / n).astype(np.float32) for n in merl.SHAPE)
    theta_h, theta_d, phi_d = np.meshgrid(h**2 * np.pi / 2, d * np.pi / 2, p * np.pi, indexing="ij")
    wh = spherical(jnp.asarray(theta_h.ravel()), jnp.zeros(theta_h.size))
    return Query(*from_half_difference(wh, spherical(jnp.asarray(theta_d.ravel()), jnp.asarray(phi_d.ravel()))))


def utia_directions() -> Query:
    """UTIA's directions to light and viewer, `(cells, 3)`, in the file's order."""
    theta = np.radians(np.arange(utia.THETAS) * 15.0).astype(np.float32)
    phi = np.radians(np.arange(utia.PHIS) * 7.5).astype(np.float32)
    w = spherical(jnp.asarray(np.repeat(theta, len(phi))), jnp.asarray(np.tile(phi, len(theta))))
    return Query(jnp.repeat(w, len(w), axis=0), jnp.tile(w, (len(w), 1)))


def _to_merl(material: Material) -> merl.Merl:
    query = merl_directions()
    valid = np.asarray(above_horizon(query.wi, query.wo)).reshape(merl.SHAPE)
    return merl.Merl(_values(material, query).reshape(*merl.SHAPE, 3), valid)


def _values(material: Material, query: Query) -> np.ndarray:
    evaluate = jax.jit(partial(material.brdf.eval, material.params))
    chunks = range(0, len(query.wi), CHUNK)
    return np.concatenate([evaluate(Query(query.wi[i : i + CHUNK], query.wo[i : i + CHUNK])) for i in chunks])
