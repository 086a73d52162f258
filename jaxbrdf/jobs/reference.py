"""The material that models are fitted to, and judged against."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import jax

from jaxbrdf.brdf.measured import symmetrised
from jaxbrdf.errors import JaxbrdfError
from jaxbrdf.jobs.source import Source, open_source
from jaxbrdf.types import Material, Query


class Reference(NamedTuple):
    """An input that can be fitted.

    Attributes:
        source: the input as it is.
        material: its reciprocal part, which is what a fit sees.
        evaluate: `query -> f` of that, compiled.
    """

    source: Source
    material: Material
    evaluate: Callable[[Query], jax.Array]

    @property
    def identity(self) -> str:
        """What tells it from other inputs: the digest of its file, or a built-in material's name."""
        return self.source.sha256 or self.source.material.name


def open_reference(name: str) -> Reference:
    """The reference that a measured file or a built-in material's name stands for.

    Raises:
        JaxbrdfError: if it cannot be read, or is a bundle.
    """
    source = open_source(name)
    if source.bundle is not None:
        raise JaxbrdfError(f"{name}: is a bundle already; a fit wants a measured file or a built-in material")
    return reference_of(source)


def reference_of(source: Source) -> Reference:
    """The reference of an opened input."""
    material = symmetrised(source.material)
    return Reference(source, material, jax.jit(partial(material.brdf.eval, material.params)))
