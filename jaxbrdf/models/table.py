"""The learned models by name: what the command line, bundles and benchmarks choose from."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from jaxbrdf.models.gated import GatedConfig, gated
from jaxbrdf.models.naive_mlp import NaiveMlpConfig, naive_mlp
from jaxbrdf.models.nbrdf import NbrdfConfig, nbrdf
from jaxbrdf.models.tripleplane import TripleplaneConfig, tripleplane
from jaxbrdf.types import Model


class ModelEntry(NamedTuple):
    """One row of the table.

    Attributes:
        config: the frozen dataclass of the model's sizes; called without arguments it gives the paper's.
        build: `config -> Model`.
    """

    config: Callable[..., Any]
    build: Callable[[Any], Model]


MODELS: dict[str, ModelEntry] = {
    "gated": ModelEntry(GatedConfig, gated),
    "tripleplane": ModelEntry(TripleplaneConfig, tripleplane),
    "nbrdf": ModelEntry(NbrdfConfig, nbrdf),
    "naive-mlp": ModelEntry(NaiveMlpConfig, naive_mlp),
}
