"""Pictures by paths that were drawn once: those of the renderer, and of any material by the same noise."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.brdf.builtin import MATERIALS
from jaxbrdf.brdf.lambert import LAMBERT, LambertParams
from jaxbrdf.render.environment import make_environment
from jaxbrdf.render.integrate import render_environment
from jaxbrdf.render.paths import draw_paths, pictures_by
from jaxbrdf.render.studio import studio
from jaxbrdf.types import Brdf, Material

KEY = jax.random.key(0)
WIDE = {"height": 40, "width": 150}
"""Two chunks of pixels would need a larger picture: the sphere's are 1,300."""

LARGE = {"height": 110, "width": 110}


@pytest.mark.parametrize(("size", "samples"), [(WIDE, 16), (LARGE, 2)])
@pytest.mark.parametrize("with_own_sampler", [True, False])
def test_a_material_by_its_own_paths_is_the_rendering(size: dict[str, int], samples: int, with_own_sampler: bool):
    material = MATERIALS["glazed-ceramic"]()
    material = material if with_own_sampler else material._replace(brdf=Brdf(material.brdf.eval))
    environment = make_environment(studio(height=32))
    paths = list(draw_paths(KEY, material, environment, samples=samples, **size))
    assert len(paths) == (1 if size is WIDE else 2)
    found = pictures_by(paths, {"": material}, **size)[""]
    wanted = render_environment(KEY, material, environment, samples=samples, **size)
    assert found.std() > 0.05
    np.testing.assert_allclose(found, wanted, rtol=2e-4, atol=1e-5)


def test_another_material_is_right_by_the_same_paths():
    """White in a white room, by the draws of gold: one everywhere, to the noise of so few samples."""
    white = Material("white", LAMBERT, LambertParams(jnp.ones(3)), True)
    gold = MATERIALS["gold"]()
    paths = draw_paths(KEY, gold, make_environment(np.ones((16, 32, 3))), height=48, width=48, samples=64)
    found = pictures_by(paths, {"white": white, "gold": gold}, height=48, width=48)
    assert list(found) == ["white", "gold"]
    inside = found["white"][16:32, 16:32]
    assert abs(inside.mean() - 1.0) < 5e-3
    assert np.all(found["gold"][16:32, 16:32] < 1.0)
    assert not found["white"][0, 0].any()
