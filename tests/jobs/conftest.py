"""A bundle that the tests of the commands share."""

from __future__ import annotations

from pathlib import Path

import pytest

from jaxbrdf.export import bundle as bundles
from tests.export.bundles import random_bundle


@pytest.fixture(scope="session")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A gated model of an isotropic material at its full size, in a folder as a fit leaves it."""
    path = tmp_path_factory.mktemp("fit") / "bundle.safetensors"
    bundles.save(path, random_bundle("gated isotropic"))
    return path
