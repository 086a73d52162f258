"""Refractive indices: published files, each kind of entry by hand, every refusal; the colours of metals."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from jaxbrdf.data.conductor import channel_index, rgb_reflectance
from jaxbrdf.data.ior import RefractiveIndex, interpolate, read
from jaxbrdf.data.spectrum import VISIBLE, to_rgb, visible_response
from jaxbrdf.errors import DataError

GRID = np.arange(0.38, 0.79, 0.05)


def rows(*columns: np.ndarray) -> str:
    return "\n".join("        " + " ".join(f"{x:.6g}" for x in row) for row in zip(*columns, strict=True))


def table(kind: str, *columns: np.ndarray) -> str:
    return f"  - type: tabulated {kind}\n    data: |\n{rows(*columns)}\n"


def document(*entries: str) -> bytes:
    return ("REFERENCES: |\n    made\nDATA:\n" + "".join(entries)).encode()


NK = table("nk", GRID, 1.0 + GRID, 3.0 * GRID)


@pytest.mark.parametrize(
    ("name", "wavelength", "n", "k"),
    [
        # rows of the cited tables, by eye
        ("main_Au_nk_Johnson", 548.6, 0.43, 2.455),
        ("main_Al_nk_Rakic", 563.57, 1.0728, 6.7839),
        ("main_Au_nk_Olmon-ev", 550.0, 0.3256, 2.507),
    ],
)
def test_published_files(name: str, wavelength: float, n: float, k: float, data_dir: Path):
    path = data_dir / "ior" / f"{name}.yml"
    index = read(path.read_bytes(), path)
    place = int(np.argmin(np.abs(index.wavelengths - wavelength)))
    assert index.wavelengths[place] == pytest.approx(wavelength, abs=0.05)
    assert (index.n[place], index.k[place]) == (n, k)


def test_every_published_file_is_read(data_dir: Path):
    paths = sorted((data_dir / "ior").glob("*.yml"))
    assert len(paths) > 10
    for path in paths:
        index = read(path.read_bytes(), path)
        assert np.all(np.diff(index.wavelengths) > 0)


def test_separate_tables_are_joined_where_both_are_given():
    finer = np.arange(0.36, 0.74, 0.02)
    index = read(document(table("n", GRID, 1 + GRID), table("k", finer, 3 * finer)), "made")
    assert (index.wavelengths[0], index.wavelengths[-1]) == (380.0, pytest.approx(720.0))
    np.testing.assert_allclose(index.n, 1 + 1e-3 * index.wavelengths, rtol=1e-6)
    np.testing.assert_allclose(index.k, 3e-3 * index.wavelengths, rtol=1e-6)


@pytest.mark.parametrize("kind", ["formula 1", "formula 2"])
def test_sellmeier_gives_the_published_indices_of_glass(kind: str):
    """BK7: n_d = 1.51680, n_F = 1.52238, n_C = 1.51432 (Schott's data sheet)."""
    c = [0.00600069867, 0.0200179144, 103.560653]
    c = np.sqrt(c) if kind == "formula 1" else c
    words = f"0 1.03961212 {c[0]} 0.231792344 {c[1]} 1.01046945 {c[2]}"
    index = read(document(f"  - type: {kind}\n    wavelength_range: 0.3 2.5\n    coefficients: {words}\n"), "made")
    got = interpolate(index, np.array([587.5618, 486.1327, 656.2725]))
    np.testing.assert_allclose(got.real, [1.51680, 1.52238, 1.51432], atol=2e-5)
    assert not got.imag.any()


def test_a_repeated_row_is_one():
    doubled = np.insert(GRID, 3, GRID[3])
    assert len(read(document(table("n", doubled, doubled)), "made").n) == len(GRID)


@pytest.mark.parametrize(
    ("content", "fault"),
    [
        (b"DATA: [", "is not YAML"),
        (b"\xff\xfe\x00", "is not YAML"),
        (b"[" * 20000, "nested too deeply"),
        (b"x: 1", "no list DATA"),
        (b"DATA: 3", "no list DATA"),
        (b"DATA: [3]", "no list DATA"),
        (document("  - type: formula 3\n"), "of type 'formula 3'"),
        (document("  - type: !!python/object/apply:os.system ['ls']\n"), "of type"),
        (document(NK, NK), "a second time"),
        (document(table("k", GRID, GRID)), "gives n"),
        (document(table("nk", GRID, GRID)), "row of 2 numbers where 3"),
        (document("  - type: tabulated n\n    data: |\n        0.3 1\n        0.4 x\n"), "'0.4 x'"),
        (document("  - type: tabulated n\n    data: 0.3 1\n"), "fewer than two rows"),
        (document(table("n", GRID[::-1], GRID)), "do not increase after"),
        (document(table("n", GRID - 0.38, GRID)), "the wavelength 0 nm"),
        (document(table("n", GRID, np.where(GRID > 0.5, -1.0, 1.0))), "n is -1 at"),
        (document(table("n", GRID, np.where(GRID > 0.5, 1e4, 1.0))), "n is 10000 at"),
        (document(table("nk", GRID, GRID, -GRID)), "k is -0.38 at 380 nm"),
        (document(table("n", GRID, np.where(GRID > 0.5, np.nan, 1.0))), "not finite"),
        (document(table("n", GRID[2:], GRID[2:])), "given from 480"),
        (document(table("n", GRID[:-4], GRID[:-4])), "given from 380 to 580 nm"),
        (document(table("n", np.delete(GRID, 4), np.delete(GRID, 4))), "no sample between 530 and 630"),
        (document("  - type: formula 2\n    wavelength_range: 0.3\n    coefficients: 0 1 0\n"), "two increasing"),
        (document("  - type: formula 2\n    wavelength_range: 0.3 1\n    coefficients: 0 1\n"), "should be odd"),
        (document("  - type: formula 2\n    wavelength_range: 0.3 1\n    coefficients: 0 1 0.25\n"), "n is"),
        (document("  - type: formula 2\n    coefficients: 0 1 0\n"), "no wavelength_range"),
        (b"#" * 2**23, "more than the"),
    ],
)
def test_refusals(content: bytes, fault: str):
    with pytest.raises(DataError, match=fault) as failure:
        read(content, "made.yml")
    assert str(failure.value).startswith("made.yml: ")
    assert "\n" not in str(failure.value)


def test_merge_keys_are_not_expanded():
    """Forty doublings of a mapping, which PyYAML's safe loader would spell out without end."""
    merges = "".join(f"b{i}: &a{i} {{<<: [*a{i - 1}, *a{i - 1}]}}\n" for i in range(1, 41))
    assert len(read(b"a: &a0 {x: 1}\n" + merges.encode() + document(NK), "made").n) == len(GRID)


def gold(data_dir: Path) -> RefractiveIndex:
    path = data_dir / "ior" / "main_Au_nk_Johnson.yml"
    return read(path.read_bytes(), path)


def test_visible_response_is_the_limit_of_coarser_weights():
    spectrum = 0.5 + 0.4 * np.sin(VISIBLE / 40.0)
    coarse = np.arange(360.0, 781.0, 5.0)
    np.testing.assert_allclose(visible_response().sum(axis=0), 1.0, rtol=1e-12)
    want = (0.5 + 0.4 * np.sin(coarse / 40.0)) @ to_rgb(coarse, "made")
    np.testing.assert_allclose(spectrum @ visible_response(), want, atol=2e-3)


def test_a_grey_metal_is_grey_and_keeps_its_index():
    flat = RefractiveIndex(np.array([300.0, 900.0]), np.array([1.2, 1.2]), np.array([5.0, 5.0]))
    normal = ((1.2 - 1) ** 2 + 25) / ((1.2 + 1) ** 2 + 25)
    np.testing.assert_allclose(rgb_reflectance(flat, np.ones(2)), normal, rtol=1e-12)
    found = channel_index(flat)
    np.testing.assert_allclose(found.eta, 1.2, rtol=1e-4)
    np.testing.assert_allclose(found.k, 5.0, rtol=1e-4)
    assert found.worst.max() < 1e-6


def test_gold_is_outside_the_gamut_and_is_fitted_inside(data_dir: Path):
    index = gold(data_dir)
    assert rgb_reflectance(index, np.ones(()))[0] > 1.02
    found = channel_index(index)
    normal = np.abs((found.eta + 1j * found.k - 1) / (found.eta + 1j * found.k + 1)) ** 2
    np.testing.assert_allclose(normal, np.clip(rgb_reflectance(index, np.ones(())), 0.0, 0.999), atol=1e-9)
    assert found.worst.max() < 0.01
