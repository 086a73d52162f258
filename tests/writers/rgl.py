"""Writes RGL tensor files for the kinds that no real file at hand covers: spectral and anisotropic ones."""

from __future__ import annotations

import struct
from collections.abc import Mapping

import numpy as np

CODES = {"u1": 1, "u4": 5, "f4": 10}


def tensor_file(fields: Mapping[str, np.ndarray]) -> bytes:
    """The container's bytes: the table of fields, then the data, each array at a multiple of eight."""
    table_size = 18 + sum(13 + len(name) + 8 * array.ndim for name, array in fields.items())
    table, body = [b"tensor_file\0" + struct.pack("<BBI", 1, 0, len(fields))], bytearray()
    for name, array in fields.items():
        body.extend(b"\0" * (-(table_size + len(body)) % 8))
        head = struct.pack("<H", len(name)) + name.encode()
        place = struct.pack("<HBQ", array.ndim, CODES[array.dtype.str[1:]], table_size + len(body))
        table.append(head + place + struct.pack(f"<{array.ndim}Q", *array.shape))
        body.extend(array.tobytes())
    return b"".join(table) + bytes(body)


def fields(*, azimuths: int = 1, sectors: int = 1, wavelengths: np.ndarray | None = None, seed: int = 0) -> dict:
    """A smooth made-up material, slightly noisy: `azimuths` of 1 is isotropic, `wavelengths` make it spectral."""
    rng = np.random.default_rng(seed)
    thetas, fine, coarse = 4, (12, 16), (8, 8)
    phi = np.linspace(-np.pi, -np.pi + 2.0 * np.pi / sectors, azimuths, dtype=np.float32)
    channels = 3 if wavelengths is None else len(wavelengths)
    made = {
        "version": np.array([1, 0], np.uint32),
        "description": np.frombuffer(b"made for a test", np.uint8),
        "phi_i": phi if azimuths > 1 else np.zeros(1, np.float32),
        "theta_i": np.linspace(0.0, 0.5 * np.pi, thetas, dtype=np.float32),
        # an isotropic surface shows the same area from every azimuth
        "sigma": np.array(np.broadcast_to(_positive(rng, (6 if azimuths > 1 else 1, 10)), (6, 10))),
        "ndf": _positive(rng, (6, 10)),
        # a density per solid angle that is finite at the pole rises as the cube of the first coordinate
        "vndf": _positive(rng, (azimuths, thetas, *fine)) * np.linspace(0.0, 1.0, fine[1], dtype=np.float32) ** 3,
        "luminance": _positive(rng, (azimuths, thetas, *coarse)),
        "jacobian": np.ones(1, np.uint8),
    }
    values = _positive(rng, (azimuths, thetas, channels, *coarse)) - np.float32(0.3)
    if wavelengths is None:
        return made | {"rgb": values}
    return made | {"wavelengths": wavelengths.astype(np.float32), "spectra": values}


def _positive(rng: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
    return (0.2 + rng.random(shape)).astype(np.float32)
