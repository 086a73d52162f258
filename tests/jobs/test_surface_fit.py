"""Fits of texture sets from the command line: files, errors, resumption, evaluation, and what is refused."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import jax
import numpy as np
import pytest
from jax.experimental.compilation_cache import compilation_cache

from jaxbrdf import cli
from jaxbrdf.errors import JaxbrdfError
from jaxbrdf.export import bundle as bundles
from jaxbrdf.fit.loop import LoopConfig
from jaxbrdf.fit.presets import SURFACE_PRESETS, SurfacePreset
from jaxbrdf.jobs import supply, surface_judge, training
from jaxbrdf.jobs.surface import Surface, open_surface
from jaxbrdf.jobs.surface_config import SurfaceFitConfig, sizes_of
from jaxbrdf.jobs.surface_fit import fit_surface
from jaxbrdf.jobs.surface_training import memory_of, surface_task
from jaxbrdf.models.table import SPATIAL
from jaxbrdf.texture.pyramid import Layout, Pyramid
from tests.jobs.tiny import Listener, run_json
from tests.surface.relief import write_relief

SIZE = 16


def tiny() -> SurfacePreset:
    quick = SURFACE_PRESETS["quick"]()
    loop = LoopConfig(batch=512, microbatch=64, ema=0.02, turn=128)
    return replace(quick, training=replace(quick.training, name="tiny", steps=240, loop=loop))


@pytest.fixture(scope="module", autouse=True)
def hasten() -> Iterator[None]:
    """A preset of seconds, and few pictures to judge it by."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(SURFACE_PRESETS, "tiny", tiny)
        patch.setattr(training, "TRIAL_STEPS", 10)
        patch.setattr(training, "STRIDE", 40)
        patch.setattr(training, "SECONDS_BETWEEN_CHECKPOINTS", 0.0)
        patch.setattr(supply, "HELD_OUT", 2**10)
        for name, value in {"SIZE": 12, "SCALES": 3, "SAMPLES": 4, "DRAWS": 2**10}.items():
            patch.setattr(surface_judge, name, value)
        yield


@pytest.fixture(scope="module", autouse=True)
def compile_once(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """The same training is compiled by several tests, a minute of the processor each."""
    jax.config.update("jax_compilation_cache_dir", str(tmp_path_factory.mktemp("compiled")))
    compilation_cache.reset_cache()
    yield
    jax.config.update("jax_compilation_cache_dir", None)
    compilation_cache.reset_cache()


@pytest.fixture(scope="module")
def relief(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The waves as files of ambientCG's names."""
    folder = tmp_path_factory.mktemp("sets") / "relief"
    write_relief(folder, SIZE)
    return folder


@pytest.fixture(scope="module")
def fitted(relief: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any], Listener]:
    """One fit for the tests that look at what it leaves."""
    out, listener = tmp_path_factory.mktemp("out"), Listener()
    return out, fit_surface(SurfaceFitConfig(str(relief), str(out), preset="tiny"), listener).report, listener


def test_a_fit_leaves_a_bundle_a_report_and_a_picture(fitted: tuple[Path, dict[str, Any], Listener]):
    out, report, listener = fitted
    assert sorted(path.name for path in out.iterdir()) == ["bundle.png", "bundle.report.json", "bundle.safetensors"]
    bundle = bundles.load(out / "bundle.safetensors")
    assert (bundle.manifest.name, bundle.manifest.model) == ("relief", "spatial-gated")
    assert bundle.manifest.provenance.steps == 240
    assert report["errors"]["planar_flip"] == pytest.approx(report["planar"]["materials"]["fit"]["flip"][0])
    assert (out / "bundle.png").read_bytes().startswith(b"\x89PNG")
    assert any(line.startswith("training on new draws") for line in listener.lines)


def test_a_fit_learns(fitted: tuple[Path, dict[str, Any], Listener]):
    """From the maps' own guesses, so there is less to learn than from noise."""
    errors = [float(note.rsplit(" ", 1)[1]) for _, note in fitted[2].notes]
    losses = [float(note.split()[1].rstrip(",")) for _, note in fitted[2].notes]
    assert errors[-1] < 0.85 * errors[0]
    assert losses[-1] < 0.3 * losses[0]


def test_eval_takes_places_and_footprints(
    fitted: tuple[Path, dict[str, Any], Listener], tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    rng = np.random.default_rng(0)
    w = rng.normal(size=(2, 64, 3))
    w[..., 2] = np.abs(w[..., 2]) + 0.1
    wi, wo = w / np.linalg.norm(w, axis=-1, keepdims=True)
    arrays = {"wi": wi, "wo": wo, "uv": rng.uniform(size=(64, 2)), "footprint": 0.1 * rng.normal(size=(64, 2, 2))}
    values = {}
    for names in (("wi", "wo", "uv", "footprint"), ("wi", "wo", "uv")):
        np.savez(tmp_path / "at.npz", **{name: arrays[name] for name in names})
        for backend in ("jax", "opencl"):
            run_json(
                capsys,
                *("eval", fitted[0], "--directions", tmp_path / "at.npz", "-o", tmp_path / "f.npy"),
                *("--backend", backend),
            )
            values[names, backend] = np.load(tmp_path / "f.npy")
    for names in (("wi", "wo", "uv", "footprint"), ("wi", "wo", "uv")):
        np.testing.assert_allclose(values[names, "opencl"], values[names, "jax"], rtol=1e-3)
    assert np.abs(values[("wi", "wo", "uv"), "jax"] - values[("wi", "wo", "uv", "footprint"), "jax"]).max() > 0


@pytest.mark.parametrize(
    ("names", "fault"),
    [
        (("wi", "wo"), "has no array uv, which"),
        (("wi", "wo", "footprint"), "has an array footprint, but no uv"),
    ],
)
def test_eval_needs_places(
    fitted: tuple[Path, dict[str, Any], Listener],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    names: tuple[str, ...],
    fault: str,
):
    up = np.tile([0.0, 0.0, 1.0], (4, 1))
    arrays = {"wi": up, "wo": up, "footprint": np.zeros((4, 2, 2))}
    np.savez(tmp_path / "at.npz", **{name: arrays[name] for name in names})
    given = [str(fitted[0]), "--directions", str(tmp_path / "at.npz"), "-o", str(tmp_path / "f.npy")]
    assert cli.run(["eval", *given]) != 0
    assert fault in capsys.readouterr().err


def test_places_are_of_no_use_to_one_reflectance(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    up = np.tile([0.0, 0.0, 1.0], (4, 1))
    np.savez(tmp_path / "at.npz", wi=up, wo=up, uv=np.zeros((4, 2)))
    given = ["gold", "--directions", str(tmp_path / "at.npz"), "-o", str(tmp_path / "f.npy")]
    assert cli.run(["eval", *given]) != 0
    assert "has an array uv, for which gold has no use" in capsys.readouterr().err


def test_an_interrupted_fit_goes_on_with_the_same_bits(
    relief: Path, tmp_path: Path, fitted: tuple[Path, dict[str, Any], Listener]
):
    config = SurfaceFitConfig(str(relief), str(tmp_path), preset="tiny")
    with pytest.raises(KeyboardInterrupt):
        fit_surface(config, Listener(_interrupt_at(120)))
    fit_surface(replace(config, resume=True), Listener())
    found, want = (bundles.load(path / "bundle.safetensors").params for path in (tmp_path, fitted[0]))
    for one, other in zip(jax.tree.leaves(found), jax.tree.leaves(want), strict=True):
        np.testing.assert_array_equal(one, other)


def _interrupt_at(step: int) -> Callable[[int], None]:
    def act(done: int) -> None:
        if done >= step:
            raise KeyboardInterrupt

    return act


@pytest.mark.parametrize("model", ["neumip", "ggx-mip"])
def test_other_models_are_fitted(relief: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, model: str):
    few = replace(tiny(), training=replace(tiny().training, steps=40))
    monkeypatch.setitem(SURFACE_PRESETS, "tiny", lambda: few)
    report = fit_surface(SurfaceFitConfig(str(relief), str(tmp_path), model=model, preset="tiny"), Listener()).report
    assert 0 < report["errors"]["planar_flip"] < 1
    assert bundles.load(tmp_path / "bundle.safetensors").manifest.model == SPATIAL[model].bundle


def test_compare_judges_a_bundle_by_its_folder(
    fitted: tuple[Path, dict[str, Any], Listener], relief: Path, capsys: pytest.CaptureFixture[str]
):
    found = run_json(capsys, "compare", fitted[0], relief)["planar"]["materials"]
    want = fitted[1]["planar"]["materials"]
    assert found["fit"]["flip"] == pytest.approx(want["fit"]["flip"])
    assert found["mip maps"]["flip"] == pytest.approx(want["mip maps"]["flip"])


def test_commands_for_one_reflectance_refuse_a_surface(
    fitted: tuple[Path, dict[str, Any], Listener], capsys: pytest.CaptureFixture[str]
):
    for command, *others in (["render", "-o", "x.png"], ["compare", "gold"]):
        assert cli.run([command, str(fitted[0]), *others]) != 0
        assert "varies over a surface" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "fault"),
    [
        (["--model", "nbrdf"], "no model of texture sets is called 'nbrdf'; there are gated, tripleplane"),
        (["--preset", "slow"], "no preset is called 'slow'"),
        (["--conserve-energy"], "--conserve-energy is not for a folder of textures"),
        (["--max-ns", "3"], "--max-ns is not for a folder of textures"),
    ],
)
def test_what_cannot_be_fitted_is_told(
    relief: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], options: list[str], fault: str
):
    assert cli.run(["fit", str(relief), "-o", str(tmp_path / "out"), *options]) != 0
    error = capsys.readouterr().err
    assert fault in error
    assert len(error.strip().splitlines()) == 1


def test_texture_options_are_for_folders_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    assert cli.run(["fit", "gold", "-o", str(tmp_path / "out"), "--size", "64"]) != 0
    assert "--size is only for a folder of textures" in capsys.readouterr().err


def test_size_resamples(relief: Path):
    surface = open_surface(str(relief), size=8)
    assert (surface.layout.height, surface.layout.width) == (8, 8)
    assert surface.told[-1] == "resampled from 16 x 16 to 8 x 8 texels"


def test_a_surface_beyond_memory_is_refused_before_it_begins(tmp_path: Path):
    layout = Layout(2**15, 2**15)
    surface = Surface("huge", Pyramid(layout, np.zeros((1, 8))), (), "")
    with pytest.raises(JaxbrdfError, match=r"a fit of 32768 x 32768 texels takes up to \d+\.\d GB of memory"):
        surface_task("gated", sizes_of("gated", layout), surface, tiny(), seed=0, checkpoint=tmp_path / "c")


def test_the_memory_of_a_fit_grows_with_its_texels():
    takes = []
    for size in (512, 1024):
        layout = Layout(size, size)
        surface = Surface("blank", Pyramid(layout, np.zeros((1, 8))), (), "")
        takes.append(memory_of(SPATIAL["gated"].build(sizes_of("gated", layout)).init, surface))
    numbers = Layout(1024, 1024).texels - Layout(512, 512).texels
    per_texel = (takes[1] - takes[0]) / numbers
    assert per_texel == pytest.approx(4 * len(jax.devices()) * (12 * 8 + 8))
