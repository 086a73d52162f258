"""Refractive indices as refractiveindex.info publishes them: YAML with tables or dispersion formulas.

`DATA` lists at most one entry that gives n and one that gives k, or one that gives both. Known are the types
`tabulated nk`, `tabulated n`, `tabulated k`, `formula 1` and `formula 2` (Sellmeier's equation); without k the medium
is transparent. Wavelengths are micrometres in the file and nanometres here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from os import PathLike
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import yaml

from jaxbrdf.errors import DataError

MOST_BYTES = 2**22
"""Four MiB: many times the largest table of the database."""

NEEDED = (400.0, 700.0)
"""Nanometres that a file must cover: the observer sees less than 0.1 % outside."""

WIDEST_GAP = 75.0
"""Nanometres between neighbouring samples: Johnson and Christy's tables have 52, which linear interpolation bears."""

MOST_INDEX = 1e3
"""More than any medium has at visible wavelengths; a larger number in the file is a mistake."""

SAMPLES = np.arange(360.0, 781.0, 5.0)
"""Nanometres at which a formula is tabulated, where it is valid."""

Path = str | PathLike[str]


class RefractiveIndex(NamedTuple):
    """n + i k of a medium, float64.

    Attributes:
        wavelengths: nanometres, increasing, `(N,)`.
        n, k: real and imaginary part, not negative, `(N,)`.
    """

    wavelengths: np.ndarray
    n: np.ndarray
    k: np.ndarray


class _Curve(NamedTuple):
    """One part of the index over wavelengths in nanometres."""

    wavelengths: np.ndarray
    values: np.ndarray


def read(content: bytes, path: Path) -> RefractiveIndex:
    """The index in the bytes of a YAML file.

    Raises:
        DataError: naming `path` and the first thing that is wrong.
    """
    curves: dict[str, _Curve] = {}
    for i, entry in enumerate(_entries(content, path)):
        for part, curve in _curves(entry, f"DATA[{i}]", path).items():
            if part in curves:
                raise DataError(path, f"DATA[{i}] gives {part} a second time")
            curves[part] = curve
    if "n" not in curves:
        raise DataError(path, "nothing in DATA gives n")
    return _joined(curves["n"], curves.get("k"), path)


def interpolate(index: RefractiveIndex, wavelengths: np.ndarray) -> np.ndarray:
    """n + i k at `wavelengths` (nanometres), linear between samples and constant outside them, complex128."""
    n, k = (np.interp(wavelengths, index.wavelengths, part) for part in (index.n, index.k))
    return n + 1j * k


def _entries(content: bytes, path: Path) -> list[dict]:
    if len(content) > MOST_BYTES:
        raise DataError(path, f"has {len(content)} bytes, more than the {MOST_BYTES} of any known table")
    try:
        # Nothing but strings, lists and mappings: the safe loader also expands merge keys, in exponential time.
        document = yaml.load(content, Loader=yaml.BaseLoader)
    except RecursionError:
        raise DataError(path, "is nested too deeply") from None
    except yaml.YAMLError as error:
        raise DataError(path, f"is not YAML: {_one_line(error)}") from None
    entries = document.get("DATA") if isinstance(document, dict) else None
    if not isinstance(entries, list) or not entries or not all(isinstance(entry, dict) for entry in entries):
        raise DataError(path, "has no list DATA of tables")
    return entries


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())


def _curves(entry: Mapping, place: str, path: Path) -> dict[str, _Curve]:
    kind = entry.get("type")
    reader = _READERS.get(kind) if isinstance(kind, str) else None
    if reader is None:
        known = ", ".join(_READERS)
        raise DataError(path, f"{place} is of type '{_quoted(kind)}'; known are {known}")
    return reader(entry, place, path)


def _quoted(value: object) -> str:
    return _one_line(Exception(value))[:40]


def _table(parts: tuple[str, ...]) -> Callable:
    """Reader of a table with a column of wavelengths and one for each of `parts`."""

    def read_table(entry: Mapping, place: str, path: Path) -> dict[str, _Curve]:
        text = entry.get("data")
        rows = [line.split() for line in text.splitlines() if line.strip()] if isinstance(text, str) else []
        if len(rows) < 2:
            raise DataError(path, f"{place} has fewer than two rows")
        wrong = next((row for row in rows if len(row) != 1 + len(parts)), None)
        if wrong is not None:
            raise DataError(path, f"{place} has a row of {len(wrong)} numbers where {1 + len(parts)} belong")
        numbers = np.stack([_numbers(row, place, path) for row in rows])
        # a row written twice, as in the published tungsten, says nothing else
        repeated = np.all(numbers[1:] == numbers[:-1], axis=-1)
        columns = numbers[~np.concatenate([[False], repeated])].T
        wavelengths = 1e3 * columns[0]
        _check_wavelengths(wavelengths, place, path)
        return {part: _Curve(wavelengths, column) for part, column in zip(parts, columns[1:], strict=True)}

    return read_table


def _sellmeier(*, squared: bool) -> Callable:
    """Reader of n^2 = 1 + C1 + sum of C_2i l^2 / (l^2 - p), p = C_2i+1 or, where `squared`, its square; l in um."""

    def read_formula(entry: Mapping, place: str, path: Path) -> dict[str, _Curve]:
        low, high = _valid_range(entry, place, path)
        first, *rest = _field(entry, "coefficients", place, path)
        if len(rest) % 2:
            raise DataError(path, f"{place} has {1 + len(rest)} coefficients; the number should be odd")
        wavelengths = np.unique(np.clip(SAMPLES, low, high))
        square = (wavelengths * 1e-3) ** 2
        with np.errstate(all="ignore"):
            poles = [p * p if squared else p for p in rest[1::2]]
            terms = [c * square / (square - pole) for c, pole in zip(rest[::2], poles, strict=True)]
            n = np.sqrt(1.0 + first + sum(terms))
        return {"n": _Curve(wavelengths, n)}

    return read_formula


def _valid_range(entry: Mapping, place: str, path: Path) -> tuple[float, float]:
    """Nanometres between which a formula holds."""
    name = "range" if "range" in entry else "wavelength_range"
    ends = 1e3 * _field(entry, name, place, path)
    if len(ends) != 2 or ends[0] >= ends[1]:
        raise DataError(path, f"{place} has a {name} that is not two increasing numbers")
    return float(ends[0]), float(ends[1])


def _field(entry: Mapping, name: str, place: str, path: Path) -> np.ndarray:
    text = entry.get(name)
    if not isinstance(text, str) or not text.split():
        raise DataError(path, f"{place} has no {name}")
    return _numbers(text.split(), place, path)


def _numbers(words: list[str], place: str, path: Path) -> np.ndarray:
    try:
        numbers = np.array([float(word) for word in words])
    except ValueError:
        raise DataError(path, f"{place} has '{_quoted(' '.join(words))}' where numbers belong") from None
    if not np.all(np.abs(numbers) < 1e30):
        raise DataError(path, f"{place} has a number that is not finite or above 1e30")
    return numbers


_READERS: Mapping[str, Callable] = MappingProxyType(
    {
        "tabulated nk": _table(("n", "k")),
        "tabulated n": _table(("n",)),
        "tabulated k": _table(("k",)),
        "formula 1": _sellmeier(squared=True),
        "formula 2": _sellmeier(squared=False),
    }
)


def _check_wavelengths(wavelengths: np.ndarray, place: str, path: Path) -> None:
    if wavelengths[0] <= 0.0:
        raise DataError(path, f"{place} has the wavelength {wavelengths[0]:g} nm")
    falling = np.flatnonzero(np.diff(wavelengths) <= 0.0)
    if falling.size:
        raise DataError(path, f"{place} has wavelengths that do not increase after {wavelengths[falling[0]]:g} nm")


def _joined(n: _Curve, k: _Curve | None, path: Path) -> RefractiveIndex:
    """Both parts at the wavelengths of either, where both are given."""
    for name, curve in (("n", n), ("k", k)):
        if curve is not None:
            _check_curve(name, curve, path)
    if k is None:
        return RefractiveIndex(n.wavelengths, n.values, np.zeros_like(n.values))
    either = np.union1d(n.wavelengths, k.wavelengths)
    low, high = (pick(n.wavelengths[end], k.wavelengths[end]) for pick, end in ((max, 0), (min, -1)))
    shared = either[(either >= low) & (either <= high)]
    return RefractiveIndex(shared, np.interp(shared, *n), np.interp(shared, *k))


def _check_curve(name: str, curve: _Curve, path: Path) -> None:
    wrong = ~((curve.values >= 0.0) & (curve.values <= MOST_INDEX))
    # X-ray and radio tables run on to where other magnitudes are real
    wrong &= (curve.wavelengths >= NEEDED[0]) & (curve.wavelengths <= NEEDED[1]) | ~(curve.values >= 0.0)
    if wrong.any():
        first = int(np.argmax(wrong))
        value, place = curve.values[first], curve.wavelengths[first]
        raise DataError(path, f"{name} is {value:g} at {place:g} nm; it must be from 0 to {MOST_INDEX:g}")
    if curve.wavelengths[0] > NEEDED[0] or curve.wavelengths[-1] < NEEDED[1]:
        extent = f"{curve.wavelengths[0]:g} to {curve.wavelengths[-1]:g} nm"
        raise DataError(path, f"{name} is given from {extent}; {NEEDED[0]:g} to {NEEDED[1]:g} are needed")
    _check_gaps(name, curve.wavelengths, path)


def _check_gaps(name: str, wavelengths: np.ndarray, path: Path) -> None:
    seen = (wavelengths[1:] > NEEDED[0]) & (wavelengths[:-1] < NEEDED[1])
    wide = np.flatnonzero(seen & (np.diff(wavelengths) > WIDEST_GAP))
    if wide.size:
        low, high = wavelengths[wide[0]], wavelengths[wide[0] + 1]
        raise DataError(path, f"{name} has no sample between {low:g} and {high:g} nm, a gap above {WIDEST_GAP:g} nm")
