"""A fitted bundle that the tests of the commands share."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import pytest

from jaxbrdf.fit.presets import PRESETS
from jaxbrdf.jobs import judge
from jaxbrdf.jobs.fit import FitResult, fit
from jaxbrdf.jobs.fit_config import FitConfig
from tests.jobs.tiny import TINY, Listener


@pytest.fixture(scope="session")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> FitResult:
    """Gold by the gated model in a second: a folder with bundle, report and picture, and the report."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(PRESETS, "tiny", lambda: TINY)
        patch.setattr(judge, "TIMED_QUERIES", 2**10)
        patch.setattr(judge, "render_pair", partial(judge.render_pair, size=32, samples=4))
        return fit(FitConfig("gold", str(tmp_path_factory.mktemp("gold")), preset="tiny"), Listener())


@pytest.fixture(scope="session")
def bundle(fitted: FitResult) -> Path:
    """The fitted bundle's file."""
    return fitted.paths.bundle
