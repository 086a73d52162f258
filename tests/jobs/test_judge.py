"""The judgement: pictures that differ only by the materials."""

from __future__ import annotations

import numpy as np

from jaxbrdf.brdf import builtin
from jaxbrdf.jobs import judge
from jaxbrdf.types import Brdf


def test_a_picture_of_the_same_material_is_the_same_to_the_noise():
    """A fit has no sampler of its own; its noise is that of the reference, however few the samples."""
    gold = builtin.MATERIALS["gold"]()
    unsampled = gold._replace(brdf=Brdf(gold.brdf.eval))
    pictures = judge.render_pair(unsampled, gold, size=24, samples=1)
    assert pictures.reference.std() > 0
    np.testing.assert_allclose(pictures.fit, pictures.reference, rtol=1e-3, atol=1e-5)
