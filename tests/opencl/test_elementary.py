"""The elementary functions of kernels_cl over their whole range, at every width, against float64."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np
import pytest
from scipy.special import expit

from jaxbrdf.opencl.shape import Shape
from tests.opencl.conftest import Device
from tests.opencl.kernels import SHAPES, run

COUNT = 200_000
TINY = 4.7019774e-38
LARGEST = 3.4028e38


class Function(NamedTuple):
    """A function, its range, and the bounds that its comment states.

    Attributes:
        name: in OpenCL; one that ends in `_after` works on an array in place.
        exact: in float64.
        x: where it is tried, float32.
        relative: the error allowed, over the exact value.
        by_x: the error allowed besides, over |x|.
    """

    name: str
    exact: Callable[[np.ndarray], np.ndarray]
    x: np.ndarray
    relative: float
    by_x: float


def spread(low: float, high: float) -> np.ndarray:
    """Positive numbers evenly spread in the logarithm, ends included."""
    return np.geomspace(low, high, COUNT).astype(np.float32)


def even(low: float, high: float) -> np.ndarray:
    return np.linspace(low, high, COUNT).astype(np.float32)


def signed(x: np.ndarray) -> np.ndarray:
    return np.concatenate([x[::2], -x[::2]])


def scaled_silu(t: np.ndarray) -> np.ndarray:
    """t / (1 + 2^t)."""
    return t * expit(-np.log(2.0) * t)


FUNCTIONS = (
    Function("jb_rsqrt", lambda x: 1 / np.sqrt(x), spread(TINY * 1.0001, LARGEST), 3e-7, 0),
    Function("jb_safe_sqrt", np.sqrt, spread(TINY * 1.0001, LARGEST), 4e-7, 0),
    Function("jb_exp2", np.exp2, even(-126, 127), 3e-7, 0),
    Function("jb_exp2", np.exp2, signed(spread(1e-30, 1.0)), 3e-7, 0),
    Function("jb_bounded_exp2", np.exp2, even(-126, 127), 3e-7, 0),
    Function("jb_bounded_silu_after", scaled_silu, even(-126, 127), 4e-7, 0),
    Function("jb_log2", np.log2, spread(1.1755e-38, LARGEST), 3e-7, 0),
    Function("jb_log2", np.log2, even(0.5, 2.0), 3e-7, 0),
    Function("jb_silu_after", scaled_silu, even(-150, 127), 4e-7, 0),
    Function("jb_silu_after", scaled_silu, signed(spread(1e-30, 1.0)), 4e-7, 0),
    Function("jb_silu_after", scaled_silu, spread(127.0, LARGEST), 0, 6e-39),
    Function("jb_silu_after", scaled_silu, -spread(100.0, LARGEST), 0, 0),
)
NAMES = [f"{function.name} {function.x[0]:.3g} to {function.x[-1]:.3g}" for function in FUNCTIONS]


@cache
def values_of_all(opencl: Device, shape: Shape) -> list[np.ndarray]:
    """What each of `FUNCTIONS` gives over its range, by one program: compiling takes longer than all the rest."""
    names = list(dict.fromkeys(function.name for function in FUNCTIONS))
    calls = [
        f"out[{k}] = x_0; {name}(out + {k}, 1);" if name.endswith("_after") else f"out[{k}] = {name}(x_0);"
        for k, name in enumerate(names)
    ]
    x = np.concatenate([function.x for function in FUNCTIONS])
    values = run(opencl, ["network"], "\n".join(calls), {"x": x[:, None]}, len(names), shape=shape)
    parts = np.split(values, np.cumsum([len(function.x) for function in FUNCTIONS])[:-1])
    return [part[:, names.index(function.name)].copy() for function, part in zip(FUNCTIONS, parts, strict=True)]


@pytest.mark.parametrize("shape", SHAPES, ids=str)
@pytest.mark.parametrize("place", range(len(FUNCTIONS)), ids=NAMES)
def test_error_stays_within_its_bound(opencl: Device, place: int, shape: Shape):
    function = FUNCTIONS[place]
    values, exact = values_of_all(opencl, shape)[place], function.exact(function.x.astype(np.float64))
    excess = np.abs(values - exact) - function.relative * np.abs(exact) - function.by_x * np.abs(function.x)
    worst = int(np.argmax(np.nan_to_num(excess, nan=np.inf)))
    assert excess[worst] <= 0, (function.x[worst], values[worst], exact[worst])


@pytest.mark.parametrize("shape", SHAPES[::3], ids=str)
def test_angle_in_every_octant_and_magnitude(opencl: Device, shape: Shape):
    rng = np.random.default_rng(0)
    y, x = (rng.normal(size=COUNT) * 10.0 ** rng.uniform(-30, 30, COUNT) for _ in range(2))
    axes = np.array([[0, 1], [0, -1], [1, 0], [1, 1], [1, -1], [1e-30, -1], [1, 1e-30]])
    given = np.concatenate([axes, np.stack([np.abs(y), x], axis=1)]).astype(np.float32)
    found = run(opencl, ["numerics"], "out[0] = jb_upper_atan2(a_0, a_1);", {"a": given}, 1, shape=shape)[:, 0]
    exact = np.arctan2(*given.T.astype(np.float64))
    assert np.abs(found - exact).max() < 4e-7
    usable = exact > 1e-30
    assert (np.abs(found - exact)[usable] / exact[usable]).max() < 3e-7


@pytest.mark.parametrize("shape", SHAPES[::3], ids=str)
def test_softplus(opencl: Device, shape: Shape):
    x = np.concatenate([even(-200.0, 200.0), signed(spread(1e-30, 1e30))])
    found = run(opencl, ["numerics"], "out[0] = jb_softplus(x_0);", {"x": x[:, None]}, 1, shape=shape)[:, 0]
    exact = np.logaddexp(0.0, x.astype(np.float64))
    assert (np.abs(found - exact) <= 4e-7 * np.maximum(exact, 1.0)).all()


@pytest.mark.parametrize("shape", SHAPES[::3], ids=str)
def test_limits_and_faults(opencl: Device, shape: Shape):
    x = np.array([np.nan, np.inf, -np.inf, 1000, -1000, 0, -0.0, TINY, -1], np.float32)
    body = "out[0] = jb_exp2(x_0); out[1] = x_0; jb_silu_after(out + 1, 1); out[2] = jb_safe_sqrt(x_0);"
    exp2, silu, root = run(opencl, ["network"], body, {"x": x[:, None]}, 3, shape=shape).T
    assert np.isnan([exp2[0], silu[0]]).all()
    np.testing.assert_allclose(exp2[1:5], [2.0**127, 2.0**-126, 2.0**127, 2.0**-126])
    np.testing.assert_array_equal(silu[[2, 4, 5, 6]], [-np.inf, -1000, 0, 0])
    assert abs(silu[3]) < 1e-33
    np.testing.assert_array_equal(root[5:], 0)
