"""The plane under a pinhole camera, beside rays met with it in float64 by a camera that is placed in space."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.render.plane import PlaneView, camera_of, see

SIZE = (24, 32)
VIEWS = {
    "along the normal": PlaneView(3.0, height=SIZE[0], width=SIZE[1]),
    "slanted": PlaneView(0.5, 40.0, 30.0, 50.0, (0.2, 0.9), height=SIZE[0], width=SIZE[1]),
    "of another period": PlaneView(2.0, 65.0, -110.0, 20.0, period=0.25, height=SIZE[0], width=SIZE[1]),
    "past the horizon": PlaneView(1.0, 80.0, 10.0, 60.0, height=SIZE[0], width=SIZE[1]),
    "far away": PlaneView(1e5, 70.0, 200.0, 2.0, height=SIZE[0], width=SIZE[1]),
}


def ray(view: PlaneView, right: np.ndarray, down: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Position of the camera `(3,)` and ray `(..., 3)` through a place on the film, in pixels from its upper left."""
    slant, azimuth = np.radians(view.slant), np.radians(view.azimuth)
    turn = np.array([[np.cos(azimuth), -np.sin(azimuth), 0], [np.sin(azimuth), np.cos(azimuth), 0], [0, 0, 1]])
    position = turn @ [0, -np.sin(slant), np.cos(slant)] * view.distance
    forward = -position / np.linalg.norm(position)
    to_right = turn @ [1.0, 0, 0]
    up = np.cross(to_right, forward)
    half = np.tan(np.radians(view.field_of_view) / 2)
    x, y = (2 * right - view.width) * half / view.height, (view.height - 2 * down) * half / view.height
    return position, forward + x[..., None] * to_right + y[..., None] * up


def uv_of(view: PlaneView, right: np.ndarray, down: np.ndarray) -> np.ndarray:
    position, towards = ray(view, right, down)
    point = position - towards * (position[2] / towards[..., 2])[..., None]
    return np.asarray(view.centre) + point[..., :2] * [1, -1] / view.period


def middles(view: PlaneView) -> tuple[np.ndarray, np.ndarray]:
    row, column = np.divmod(np.arange(view.height * view.width), view.width)
    return column + 0.5, row + 0.5


def seen(view: PlaneView):
    return see(camera_of(view), jnp.arange(view.height * view.width), (view.height, view.width))


@pytest.mark.parametrize("name", VIEWS)
def test_pixels_see_what_their_rays_meet(name: str):
    view = VIEWS[name]
    found, (_, towards) = seen(view), ray(view, *middles(view))
    hit = towards[:, 2] < 0
    np.testing.assert_array_equal(found.hit, hit)
    wo = -towards[hit] / np.linalg.norm(towards[hit], axis=-1, keepdims=True)
    np.testing.assert_allclose(np.asarray(found.place.wo)[hit], wo, atol=3e-7)
    want = uv_of(view, *(part[hit] for part in middles(view)))
    # rounding stays far below the least width of the pixel's footprint
    width = np.linalg.svd(np.asarray(found.place.footprint, float)[hit], compute_uv=False)[:, 1]
    off = np.linalg.norm(np.asarray(found.place.uv, float)[hit] - want, axis=-1)
    assert np.all(off <= 1e-3 * width + 1e-6 * np.linalg.norm(want, axis=-1))


@pytest.mark.parametrize("name", VIEWS)
def test_footprints_are_finite_differences_of_uv(name: str):
    view = VIEWS[name]
    found, (right, down) = seen(view), middles(view)
    hit, step = np.asarray(found.hit), 1e-4
    right, down = right[hit], down[hit]
    want = [uv_of(view, right + step, down) - uv_of(view, right - step, down)]
    # the second column goes up the picture
    want += [uv_of(view, right, down - step) - uv_of(view, right, down + step)]
    want = np.stack(want, axis=-1) / (2 * step)
    footprint = np.asarray(found.place.footprint, float)[hit]
    scale = np.linalg.norm(want, axis=(-2, -1), keepdims=True)
    assert np.all(np.abs(footprint - want) <= 2e-4 * scale)


def test_above_the_horizon_nothing_is_seen_and_all_is_finite():
    view = VIEWS["past the horizon"]
    found = seen(view)
    rows = np.asarray(found.hit).reshape(SIZE)
    # the horizon lies 10 of 60 degrees above the middle, on the film at tan(10) of tan(30)
    horizon = SIZE[0] / 2 * (1 - np.tan(np.radians(10)) / np.tan(np.radians(30)))
    np.testing.assert_array_equal(rows.all(axis=1), np.arange(SIZE[0]) + 0.5 > horizon)
    np.testing.assert_array_equal(rows.any(axis=1), rows.all(axis=1))
    assert all(np.isfinite(np.asarray(part)).all() for part in found.place)
    np.testing.assert_allclose(np.linalg.norm(np.asarray(found.place.wo), axis=-1), 1.0, atol=1e-6)


def test_a_camera_on_the_horizon_keeps_footprints_finite():
    view = PlaneView(2.0**40, 90.0 - 1e-7, field_of_view=170.0, height=3, width=3)
    assert all(np.isfinite(np.asarray(part)).all() for part in seen(view).place)


@pytest.mark.parametrize(
    ("fields", "fault"),
    [
        ({"distance": 0.0}, "distance is 0.0"),
        ({"distance": np.nan}, "distance is nan"),
        ({"distance": 1e13}, "distance is 1"),
        ({"period": -1.0}, "period -1.0"),
        ({"slant": 90.0}, "slant is 90.0"),
        ({"field_of_view": 180.0}, "field_of_view is 180.0"),
        ({"azimuth": np.inf}, "azimuth is inf"),
        ({"width": 0}, "256 x 0"),
    ],
)
def test_views_that_are_none(fields: dict, fault: str):
    with pytest.raises(ValueError, match=fault):
        PlaneView(**fields)
