"""Features of texels against plain numpy over the texels of the finest level that they cover."""

from __future__ import annotations

import numpy as np

from jaxbrdf.surface.features import features_of
from tests.surface.relief import relief, relief_textures


def test_the_coarsest_texel_has_the_moments_of_all():
    textures = relief_textures(8)
    layout, texels = relief(8)
    found = np.asarray(features_of(layout, texels))
    normal = textures.normal.reshape(-1, 3).astype(np.float64)
    mean, cov = normal.mean(0), np.cov(normal[:, :2].T, bias=True)
    base = textures.base_color.reshape(-1, 3).mean(0)
    numbers = [mean[0] / mean[2], mean[1] / mean[2], *base, textures.metallic.mean(), textures.roughness.mean()]
    want = [*numbers, cov[0, 0], cov[1, 1], cov[0, 1]]
    np.testing.assert_allclose(found[-1], want, rtol=1e-4, atol=1e-6)
    assert found.shape == (layout.texels, 10)


def test_the_finest_texels_spread_nothing():
    layout, texels = relief(8)
    np.testing.assert_allclose(np.asarray(features_of(layout, texels))[:64, 7:], 0.0, atol=1e-6)
