"""The scene that spatially varying materials are judged by: one plane over all scales, cameras and lights.

After section 5.2 of Timonen et al.: 21 scales, 3 camera positions and 4 light directions. Their layout is not printed,
and what follows is chosen here. The scales lie evenly on a logarithmic axis from the finest to the coarsest footprint
of training, an eighth of a texel to twice the whole texture, which are a pixel's in the middle of a picture seen along
the normal. The field of view is so narrow that a picture has one direction of view, but for two to four degrees, and
the camera goes away for another scale. Every scale and camera looks at another place of the texture, of a sequence that
covers it evenly (the additive recurrence by the plastic number), so that no picture's place is chosen.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import jax
import numpy as np

from jaxbrdf.render.plane import PlaneView
from jaxbrdf.render.plane_picture import plane_directional
from jaxbrdf.sampling.footprints import COARSEST, FINEST_TEXELS
from jaxbrdf.types import Material

RECURRENCE = (0.7548776662466927, 0.5698402909980532)
"""1 / g and 1 / g^2 for the plastic number g, the root of g^3 = g + 1: the steps of the places."""


@dataclass(frozen=True)
class PlanarScene:
    """The scene for a texture.

    Attributes:
        texels: along the texture's longer side.
        size: of a picture, pixels a side.
        scales: number of footprints.
        cameras: slant and azimuth of each, degrees (`PlaneView`); they are turned so that long footprints lie across
            the texture in several ways.
        lights: angle from the normal and azimuth from the viewer of each, degrees: near the normal; the mirror image of
            the second camera; from the side; low, beside the mirror image of the third camera.
        field_of_view: degrees.
    """

    texels: int
    size: int = 64
    scales: int = 21
    cameras: tuple[tuple[float, float], ...] = ((0.0, 0.0), (45.0, 25.0), (75.0, 65.0))
    lights: tuple[tuple[float, float], ...] = ((20.0, 0.0), (45.0, 180.0), (60.0, 90.0), (75.0, 165.0))
    field_of_view: float = 5.0

    @property
    def shape(self) -> tuple[int, int, int]:
        """Numbers of scales, cameras and lights."""
        return self.scales, len(self.cameras), len(self.lights)


def scene_footprints(scene: PlanarScene) -> np.ndarray:
    """Length in uv of a pixel's footprint at every scale, in the middle of a picture seen along the normal."""
    return np.geomspace(FINEST_TEXELS / scene.texels, 2.0**COARSEST, scene.scales)


def scene_view(scene: PlanarScene, scale: int, camera: int) -> PlaneView:
    """The camera of a picture."""
    slant, azimuth = scene.cameras[camera]
    steps = scale * len(scene.cameras) + camera + 1
    centre = (RECURRENCE[0] * steps % 1.0, RECURRENCE[1] * steps % 1.0)
    at_one = PlaneView(1.0, slant, azimuth, scene.field_of_view, centre, height=scene.size, width=scene.size)
    return replace(at_one, distance=float(scene_footprints(scene)[scale]) / at_one.step)


def scene_light(scene: PlanarScene, camera: int, light: int) -> tuple[float, float, float]:
    """Direction to a light in the plane's frame; the viewer's azimuth is a quarter turn below the camera's."""
    theta, phi = np.radians(scene.lights[light])
    around = phi + np.radians(scene.cameras[camera][1] - 90.0)
    return float(np.sin(theta) * np.cos(around)), float(np.sin(theta) * np.sin(around)), float(np.cos(theta))


def scene_pictures(key: jax.Array, material: Material, scene: PlanarScene, *, samples: int | None = None) -> np.ndarray:
    """All pictures of a material, `(scales, cameras, lights, size, size, 3)` float32.

    Args:
        key: shifts the points of footprints.
        material: of the plane.
        scene: what is seen.
        samples: points of each footprint for a material at points; None for one that is given footprints.
    """
    pictures = np.empty((*scene.shape, scene.size, scene.size, 3), np.float32)
    for at in np.ndindex(scene.shape):
        pictures[at] = scene_picture(key, material, scene, at, samples=samples)
    return pictures


def scene_picture(
    key: jax.Array,
    material: Material,
    scene: PlanarScene,
    at: tuple[int, ...],
    *,
    samples: int | None = None,
) -> np.ndarray:
    """One picture of `scene_pictures`, that of a scale, a camera and a light, `(size, size, 3)`."""
    scale, camera, light = at
    view, direction = scene_view(scene, scale, camera), scene_light(scene, camera, light)
    index = int(np.ravel_multi_index(at, scene.shape))
    return plane_directional(jax.random.fold_in(key, index), material, view, direction, samples=samples)
