"""Candidates: their sizes, their names, and the grids of them."""

from __future__ import annotations

import jax
import numpy as np
import pytest

from jaxbrdf.errors import JaxbrdfError
from jaxbrdf.fit.presets import PRESETS
from jaxbrdf.jobs.candidate import Candidate
from jaxbrdf.jobs.fit_config import FitConfig
from jaxbrdf.jobs.fitting import unfitted
from jaxbrdf.jobs.grid import CAPABILITY, GRIDS, grid_of
from jaxbrdf.models.gated import GatedConfig
from jaxbrdf.models.half_difference import TextureSizes
from jaxbrdf.models.table import MODELS, NAMES
from jaxbrdf.models.tripleplane import TripleplaneConfig
from jaxbrdf.opencl.parameters import stored_precision


@pytest.mark.parametrize("isotropic", [True, False])
@pytest.mark.parametrize("model", MODELS)
def test_the_papers_sizes_are_the_models_defaults(model: str, isotropic: bool):
    sizes = Candidate(model).sizes(isotropic=isotropic)
    assert getattr(sizes, "textures", sizes).isotropic is isotropic
    if isotropic:
        assert sizes == MODELS[model].config()


def test_our_own_gated_model_has_about_the_papers_memory():
    """docs/fitting.md tells its sizes."""
    sizes = Candidate("gated", (16, 16)).sizes(isotropic=True)
    textures = TextureSizes(True, 128, 40, 40, 40, 8)
    assert sizes == GatedConfig(textures, (16, 16), (0.6, 1.5), (0.7, 2.0), horizon=True)
    assert Candidate("gated", (16, 16)).sizes(isotropic=False).textures == TextureSizes(False, 40, 40, 40, 40, 8)


def test_textures_grow_together():
    def texels(candidate: Candidate) -> TextureSizes:
        return candidate.sizes(isotropic=True).textures

    assert texels(Candidate("gated", (8, 8), 80)) == TextureSizes(True, 256, 80, 80, 80, 8)
    assert texels(Candidate("gated", (8, 8), 20)) == TextureSizes(True, 64, 20, 20, 20, 8)


def test_other_models_keep_the_papers_textures_when_they_grow_wider():
    assert Candidate("tripleplane", (24, 24)).sizes(isotropic=True) == TripleplaneConfig(hidden=(24, 24))
    assert Candidate("nbrdf", (8,)).sizes(isotropic=False) == MODELS["nbrdf"].config(isotropic=False, hidden=(8,))


def test_names():
    assert Candidate("gated").name == "gated paper"
    assert Candidate("gated", (16, 16), 80, "float16").name == "gated 16-16 D80 float16"
    assert Candidate("gated", (16, 16), 80, "float16").slug == "gated-16-16-D80-float16"
    assert Candidate("gated", (16, 16), 80, "float16").trained.name == "gated 16-16 D80"


def test_a_model_that_does_not_exist():
    with pytest.raises(JaxbrdfError, match="no model is called 'zeltner'; there are gated"):
        Candidate("zeltner")


@pytest.mark.parametrize("grid", GRIDS)
def test_a_grid_names_each_of_its_candidates_once_and_trains_each_once(grid: str):
    candidates = grid_of(grid)
    names = [candidate.name for candidate in candidates]
    assert len(set(names)) == len(names)
    assert {candidate.trained for candidate in candidates} <= set(candidates)
    assert {candidate.trained for candidate in candidates} <= set(CAPABILITY)


def test_the_grids_have_every_model_and_both_precisions():
    sizes = {"small": 11, "full": 27}
    for name, count in sizes.items():
        assert len(grid_of(name)) == count
        assert {candidate.model for candidate in grid_of(name)} == set(NAMES)
        assert {candidate.precision for candidate in grid_of(name)} == {"float32", "float16"}
    assert set(GRIDS["small"]) <= set(GRIDS["full"])


def test_what_fit_makes_by_default_is_in_both_grids():
    assert FitConfig("gold", "out").candidate in GRIDS["small"]
    assert FitConfig("gold", "out", paper_sizes=True).candidate in GRIDS["small"]
    assert FitConfig("gold", "out", preset="standard").candidate.hidden == PRESETS["standard"]().hidden
    assert FitConfig("gold", "out", model="nbrdf").candidate == Candidate("nbrdf")


@pytest.mark.parametrize("candidate", GRIDS["full"], ids=lambda candidate: candidate.slug)
@pytest.mark.parametrize("isotropic", [True, False])
def test_an_unfitted_bundle_is_what_a_fitted_one_would_be_in_size(candidate: Candidate, isotropic: bool):
    bundle = unfitted(candidate, isotropic=isotropic)
    assert bundle.manifest.isotropic is isotropic
    assert bundle.manifest.config == candidate.sizes(isotropic=isotropic)
    assert stored_precision(bundle) == candidate.precision
    assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(bundle.params))
