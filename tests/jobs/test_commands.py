"""What the commands give for what they can use, each once as a user runs it, with `--json`."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.brdf import builtin, measured
from jaxbrdf.core.directions import half_vector
from jaxbrdf.data import exr, merl, png, utia
from jaxbrdf.export import bundle as bundles
from jaxbrdf.jobs import judge
from jaxbrdf.jobs.render import SUN_DIRECTION, SUN_ON_FLOOR
from jaxbrdf.render.plane import FLOOR
from jaxbrdf.render.shading import to_local
from jaxbrdf.sampling.hemisphere import square_to_cosine
from jaxbrdf.types import Material, Query
from tests.jobs.tiny import hasten_judge, run_json
from tests.writers import rgl

COUNT = 4096


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of its own for every test, where directions lie."""
    monkeypatch.chdir(tmp_path)
    wi, wo = directions()
    np.savez("dirs.npz", wi=wi, wo=wo)
    np.savez("swapped.npz", wi=wo, wo=wi)
    return tmp_path


def directions(seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Cosine-distributed pairs, some turned below the horizon."""
    wi, wo = np.array(square_to_cosine(jax.random.uniform(jax.random.key(seed), (2, COUNT, 2))))
    wi[:20, 2] *= -1
    return wi, wo


def values(material: Material, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    return np.asarray(jax.jit(material.brdf.eval)(material.params, Query(jnp.asarray(wi), jnp.asarray(wo))))


def evaluated(capsys: pytest.CaptureFixture[str], source: object, directions: str = "dirs.npz", *options: str):
    result = run_json(capsys, "eval", source, "--directions", directions, "-o", "f.npy", *options)
    assert result["queries"] == COUNT
    found = np.load("f.npy", allow_pickle=False)
    assert (found.dtype, found.shape) == (np.float32, (COUNT, 3))
    return found


def test_eval_of_a_file_is_the_files_own_value(capsys: pytest.CaptureFixture[str]):
    """Clamped and not symmetrised; the made-up material is not reciprocal and has negative entries."""
    Path("made.bsdf").write_bytes(rgl.tensor_file(rgl.fields()))
    found, swapped = (evaluated(capsys, "made.bsdf", name) for name in ("dirs.npz", "swapped.npz"))
    np.testing.assert_allclose(found, values(measured.load("made.bsdf"), *directions()), rtol=1e-5, atol=1e-7)
    assert found.min() == 0.0
    assert np.mean(found[20:] == 0) > 0.002
    assert np.median(np.abs(found - swapped)[20:] / (found + swapped + 1e-6)[20:]) > 0.05


def test_eval_of_a_real_file_is_the_files_own_value(capsys: pytest.CaptureFixture[str], data_dir: Path):
    path = data_dir / "rgl" / "chm_light_blue_rgb.bsdf"
    np.testing.assert_allclose(
        evaluated(capsys, path), values(measured.load(path), *directions()), rtol=1e-4, atol=1e-6
    )


def test_eval_of_a_built_in_material_is_zero_below_the_horizon(capsys: pytest.CaptureFixture[str]):
    found = evaluated(capsys, "gold")
    assert not found[:20].any()
    assert found[20:].min() > 0


def test_backends_agree(capsys: pytest.CaptureFixture[str], bundle: Path):
    by_jax = evaluated(capsys, bundle)
    by_opencl = evaluated(capsys, bundle, "dirs.npz", "--backend", "opencl")
    assert np.all(np.abs(by_jax - by_opencl) <= 1e-4 * by_jax + 1e-6)
    assert not by_opencl[:20].any()
    in_folder = evaluated(capsys, bundle.parent)
    np.testing.assert_array_equal(in_folder, by_jax)


def test_no_directions_give_no_values(capsys: pytest.CaptureFixture[str], bundle: Path):
    none = np.zeros((0, 3), np.float32)
    np.savez("none.npz", wi=none, wo=none)
    for backend in ("jax", "opencl"):
        result = run_json(capsys, "eval", bundle, "--directions", "none.npz", "-o", "none.npy", "--backend", backend)
        assert result["queries"] == 0
        assert np.load("none.npy").shape == (0, 3)


def test_half_and_double_precision_directions_are_taken(capsys: pytest.CaptureFixture[str]):
    wi, wo = directions()
    np.savez("double.npz", wi=wi.astype(np.float64), wo=wo.astype(">f8"))
    np.testing.assert_array_equal(evaluated(capsys, "gold", "double.npz"), evaluated(capsys, "gold"))


def test_convert_to_merl_keeps_the_material_away_from_its_highlight(capsys: pytest.CaptureFixture[str]):
    assert run_json(capsys, "convert", "gold", "gold.binary") == {"output": "gold.binary"}
    wi, wo = directions()
    found, gold = evaluated(capsys, "gold.binary"), values(builtin.MATERIALS["gold"](), wi, wo)
    theta_h = np.degrees(np.arccos(np.clip(np.asarray(half_vector(wi, wo))[:, 2], -1, 1)))
    # away from the horizon too, where MERL's cells are cut
    clear = (theta_h > 15) & (np.minimum(wi[:, 2], wo[:, 2]) > 0.1)
    error = np.abs(found - gold)[clear] / gold[clear]
    assert clear.sum() > 1000
    assert np.median(error) < 2e-3
    assert error.max() < 0.1
    table = merl.read(Path("gold.binary").read_bytes(), "gold.binary")
    # at the very centre of the highlight: the first cell's own angles
    assert table.rgb[0, 0, 0] == pytest.approx(gold_at(np.radians(90 * (0.5 / 90) ** 2), np.radians(0.5)), rel=1e-3)


def gold_at(theta_h: float, theta_d: float) -> np.ndarray:
    """Gold where wh is turned by theta_h and wd, at azimuth phi_d = pi / 360, by theta_d, in float64 directions."""
    phi = np.pi / 360
    wd = np.array([np.sin(theta_d) * np.cos(phi), np.sin(theta_d) * np.sin(phi), np.cos(theta_d)])
    c, s = np.cos(theta_h), np.sin(theta_h)
    turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    wi, wo = (turn @ (wd * sign) for sign in ([1, 1, 1], [-1, -1, 1]))
    return values(builtin.MATERIALS["gold"](), np.float32(wi)[None], np.float32(wo)[None])[0]


def test_convert_to_utia_is_exact_at_its_directions(capsys: pytest.CaptureFixture[str]):
    run_json(capsys, "convert", "brushed-aluminium", "brushed.bin")
    table = utia.read(Path("brushed.bin").read_bytes(), "brushed.bin")
    assert run_json(capsys, "info", "brushed.bin")["isotropic"] is False
    theta_i, phi_i, theta_o, phi_o = (np.radians(x) for x in (30, 45, 60, 315))
    wi, wo = (
        np.float32([[np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)]])
        for theta, phi in ((theta_i, phi_i), (theta_o, phi_o))
    )
    expected = values(builtin.MATERIALS["brushed-aluminium"](), wi, wo)[0]
    np.testing.assert_allclose(table.rgb[2, 6, 4, 42], expected, rtol=1e-4)


def test_convert_of_a_bundle_is_the_bundle(capsys: pytest.CaptureFixture[str], bundle: Path):
    run_json(capsys, "convert", bundle, "fitted.bin")
    found, expected = evaluated(capsys, "fitted.bin"), evaluated(capsys, bundle)
    wi, wo = directions()
    clear = np.minimum(wi[:, 2], wo[:, 2]) > 0.5
    assert np.median(np.abs(found - expected)[clear] / expected[clear]) < 0.25


def test_info_tells_what_a_file_is(capsys: pytest.CaptureFixture[str], bundle: Path):
    Path("made.bsdf").write_bytes(rgl.tensor_file(rgl.fields(azimuths=5)))
    gold, made, fitted = (run_json(capsys, "info", name) for name in ("gold", "made.bsdf", bundle))
    assert (gold["kind"], gold["isotropic"]) == ("built-in", True)
    assert gold["asymmetry"] < 1e-3
    assert gold["clamped_share"] == 0.0
    assert (made["kind"], made["isotropic"], made["name"]) == ("bsdf", False, "made")
    assert len(made["sha256"]) == 64
    assert made["clamped_share"] > 0
    assert made["asymmetry"] > 0.05
    assert (fitted["kind"], fitted["model"], fitted["name"]) == ("bundle", "gated", "light blue")
    # H is a row for an isotropic material: 32 x 6 + 32 x 32 x 6 texels, 351 of the network, 8 of the warps
    assert (fitted["isotropic"], fitted["parameters"]) == (True, 192 + 6144 + 351 + 8)
    assert fitted["provenance"]["preset"] == "quick"


def test_info_of_a_texture_set(capsys: pytest.CaptureFixture[str], data_dir: Path):
    found = run_json(capsys, "info", data_dir / "textures" / "Bricks102")
    assert (found["kind"], found["rows"], found["columns"]) == ("texture set", 512, 1024)
    assert found["metallic"] == [0.0, 0.0]
    assert any("Bricks102_1K-JPG_NormalGL.jpg, OpenGL by its name" in line for line in found["told"])


def test_info_of_a_published_network_in_its_archive(capsys: pytest.CaptureFixture[str], data_dir: Path):
    found = run_json(capsys, "info", data_dir / "nbrdf" / "rgl-isotropic_nbrdf.zip" / "cg_sunflower_rgb.h5")
    assert (found["kind"], found["name"], found["isotropic"]) == ("h5", "cg_sunflower_rgb", True)


def test_render_writes_an_encoded_png(capsys: pytest.CaptureFixture[str], bundle: Path):
    result = run_json(capsys, "render", bundle, "--env", "sun", "-o", "sun.png", "--size", 24)
    assert result == {"output": "sun.png"}
    picture = png.read(Path("sun.png").read_bytes(), "sun.png")
    assert (picture.shape, picture.dtype) == ((24, 24, 3), np.uint8)
    assert picture.max() > 100
    assert not picture[0, 0].any()


def test_render_writes_linear_exr_under_a_users_map(capsys: pytest.CaptureFixture[str]):
    """Where radiance is one everywhere a material shows its albedo."""
    Path("white.exr").write_bytes(exr.write(np.ones((8, 16, 3), np.float32)))
    run_json(capsys, "render", "gold", "--env", "white.exr", "-o", "gold.exr", "--size", 16, "--samples", 64)
    picture = exr.read(Path("gold.exr").read_bytes(), "gold.exr")
    assert picture.shape == (16, 16, 3)
    np.testing.assert_allclose(picture[7:9, 7:9].mean(axis=(0, 1)), normal_albedo(), rtol=0.05)


def test_render_of_a_plane_of_textures(capsys: pytest.CaptureFixture[str]):
    """A plain black sheet reflects four percent and shows no detail; beyond the horizon there is nothing."""
    Path("sheet").mkdir()
    Path("sheet", "albedo.png").write_bytes(png.write(np.zeros((4, 4, 3), np.float32)))
    options = ["--scene", "plane", "--size", 16, "--samples", 4, "--env", "sun", "-o", "sheet.exr"]
    run_json(capsys, "render", "sheet", *options, "--distance", 3)
    picture = exr.read(Path("sheet.exr").read_bytes(), "sheet.exr")
    assert picture.shape == (16, 16, 3)
    assert picture.min() > 0
    assert picture.max() < 0.2
    run_json(capsys, "render", "sheet", *options, "--slant", 80)
    slanted = exr.read(Path("sheet.exr").read_bytes(), "sheet.exr").max(axis=(1, 2))
    # the horizon is 10 of 20 degrees above the middle row
    assert not slanted[:4].any()
    assert slanted[5:].all()


def test_the_sun_is_one_for_spheres_and_planes():
    np.testing.assert_allclose(to_local(jnp.asarray(FLOOR), jnp.asarray(SUN_DIRECTION)), SUN_ON_FLOOR)


def test_render_of_a_plane_of_one_material(capsys: pytest.CaptureFixture[str]):
    Path("white.exr").write_bytes(exr.write(np.ones((8, 16, 3), np.float32)))
    options = ["--env", "white.exr", "--size", 16, "--samples", 64]
    run_json(capsys, "render", "gold", "--scene", "plane", *options, "-o", "gold.exr")
    picture = exr.read(Path("gold.exr").read_bytes(), "gold.exr")
    np.testing.assert_allclose(picture[7:9, 7:9].mean(axis=(0, 1)), normal_albedo(), rtol=0.05)


def normal_albedo() -> np.ndarray:
    """Albedo of gold seen along the normal, by cosine-distributed lights."""
    wi = np.array(square_to_cosine(jax.random.uniform(jax.random.key(3), (2**17, 2))))
    wo = np.broadcast_to(np.float32([0, 0, 1]), wi.shape)
    return np.pi * values(builtin.MATERIALS["gold"](), wi, wo).mean(axis=0)


def test_compare_judges_both_against_the_symmetrised_file(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, bundle: Path
):
    """Beside means over plain cosine-distributed pairs, by numpy."""
    hasten_judge(partial(monkeypatch.setattr, judge), pairs=2**17)
    Path("made.bsdf").write_bytes(rgl.tensor_file(rgl.fields()))
    found = run_json(capsys, "compare", bundle, "made.bsdf", "--against", "gold")
    assert found["pairs"] == 2**17
    pairs = np.array(square_to_cosine(jax.random.uniform(jax.random.key(1), (2, 2**17, 2))))
    truth = measured.load("made.bsdf")
    f = 0.5 * (values(truth, *pairs) + values(truth, *pairs[::-1]))
    for name, material in (
        ("bundle", bundles.material(bundles.load(bundle))),
        ("against", builtin.MATERIALS["gold"]()),
    ):
        p = values(material, *pairs)
        for error, terms in (("smape", 2 * np.abs(p - f) / (p + f + 1e-3)), ("mae", np.abs(p - f))):
            means = terms.mean(axis=1)
            spread = np.hypot(means.std() / np.sqrt(len(means)), found[name][f"{error}_standard_error"])
            assert abs(found[name][error] - means.mean()) < 5 * spread
        assert 0 < found[name]["image_flip"] < 1
    for error in ("mae", "smape", "rmse", "log_rmse"):
        assert found["ratio"][error] == pytest.approx(found["bundle"][error] / found["against"][error])
