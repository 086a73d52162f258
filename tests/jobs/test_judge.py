"""The judgement: pictures that differ only by the materials."""

from __future__ import annotations

import numpy as np
import pytest

from jaxbrdf.brdf import builtin
from jaxbrdf.brdf.measured import symmetrised
from jaxbrdf.jobs import judge
from jaxbrdf.types import Brdf


def test_a_picture_of_the_same_material_is_the_same_to_the_noise():
    """A fit has no sampler of its own; its noise is that of the reference, however few the samples."""
    gold = builtin.MATERIALS["gold"]()
    unsampled = gold._replace(brdf=Brdf(gold.brdf.eval))
    pictures = judge.render_pair(unsampled, gold, size=24, samples=1)
    assert pictures.reference.std() > 0
    np.testing.assert_allclose(pictures.fit, pictures.reference, rtol=1e-3, atol=1e-5)


def test_a_fit_is_judged_as_it_would_be_alone_on_draws_that_others_share():
    """Gold's own value, once as it is and once a tenth brighter: the errors are known."""
    gold = symmetrised(builtin.MATERIALS["gold"]())
    bright = gold._replace(brdf=Brdf(lambda params, query: 1.1 * gold.brdf.eval(params, query)))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(judge, "SIZE", 24)
        patch.setattr(judge, "SAMPLES", 1)
        patch.setattr(judge, "PAIRS", 2**16)
        draws = judge.draw(gold)
        same, other, again = (judge.judgement(fit, draws) for fit in (gold, bright, gold))
    assert same.errors == again.errors
    assert same.errors["mae"] < 1e-6
    assert same.errors["image_flip"] < 1e-4
    means = [np.mean([np.asarray(p.importance[:, None] * p.f).mean() for p in draws.pairs])]
    assert other.errors["mae"] == pytest.approx(0.1 * means[0], rel=1e-3)
    assert other.errors["smape"] == pytest.approx(2 * 0.1 / 2.1, rel=0.02)
    np.testing.assert_allclose(other.pictures.fit, 1.1 * same.pictures.fit, rtol=1e-3)
    pair = judge.render_pair(bright, gold, size=24, samples=1)
    np.testing.assert_allclose(pair.fit, other.pictures.fit, rtol=1e-5)
