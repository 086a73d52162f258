"""Slices along the plane of incidence of what has known ones."""

from __future__ import annotations

import io

import jax.numpy as jnp
import numpy as np
import pytest
from PIL import Image

from jaxbrdf.brdf import builtin
from jaxbrdf.brdf.lambert import LAMBERT, LambertParams
from jaxbrdf.report.slices import incidence_plane, incidence_planes
from jaxbrdf.types import Material


@pytest.mark.parametrize("theta", [0.0, 30.0, 60.0])
def test_a_smooth_lobe_peaks_near_the_mirror_direction(theta: float):
    found = incidence_plane(builtin.MATERIALS["glazed-ceramic"](), theta)
    # off-specular: beyond the mirror direction, never before it
    assert -0.5 <= found.angle[np.argmax(found.luminance)] - theta < 2.0


def test_a_matt_material_is_flat_and_has_the_luminance_of_its_albedo():
    matt = Material("matt", LAMBERT, LambertParams(jnp.array([0.9, 0.3, 0.1])), True)
    found = incidence_plane(matt, 45.0, steps=90)
    np.testing.assert_allclose(found.luminance, (0.2126 * 0.9 + 0.7152 * 0.3 + 0.0722 * 0.1) / np.pi, rtol=1e-3)
    np.testing.assert_allclose(found.angle, np.arange(-89.0, 90.0, 2.0))


def test_the_figure_has_a_column_for_each_view():
    gold = builtin.MATERIALS["gold"]()
    sizes = []
    for thetas in ((30.0,), (0.0, 60.0)):
        with Image.open(io.BytesIO(incidence_planes({"reference": gold, "fit": gold}, thetas=thetas))) as image:
            sizes.append(image.size)
            assert np.asarray(image).std() > 0
    assert sizes == [(360, 640), (720, 640)]
