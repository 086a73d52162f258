"""Valid ranges: what is refused and how it is said, what is clamped, and what the gradient of a clamped value is."""

from __future__ import annotations

from typing import Annotated, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.brdf.microfacet import MicrofacetParams
from jaxbrdf.core.fresnel import Conductor, Schlick
from jaxbrdf.core.ggx import Ggx
from jaxbrdf.core.ranges import ANY, SHARE, Range, check_ranges, clamp, ranges_of
from jaxbrdf.core.roughness import ROUGHNESS, Axes, Isotropic, Tensor


class Inner(NamedTuple):
    """One bounded, one free."""

    share: Annotated[jax.Array, SHARE]
    free: jax.Array


class Outer(NamedTuple):
    """Nested records, an optional field, an open end and every finite number."""

    parts: tuple[Inner, ...]
    width: Annotated[jax.Array, Range(1e-4, 1.0)]
    extra: Annotated[jax.Array, Range(2.0, 3.0)] | None = None
    chance: Annotated[jax.Array, Range(0.0, np.inf)] | None = None
    angle: Annotated[jax.Array, ANY] | None = None


def outer(**changed: object) -> Outer:
    part = Inner(jnp.array([0.2, 0.5, 1.0]), jnp.array(-7.0))
    return Outer((part, part), jnp.array(0.5))._replace(**changed)


def with_share(value: float) -> Outer:
    good = Inner(jnp.array(0.5), jnp.array(0.0))
    return outer(parts=(good, Inner(jnp.array([0.5, value]), jnp.array(0.0))))


def test_valid_parameters_pass_at_the_ends_too():
    check_ranges(outer())
    # 1e-4 as float32 is below 1e-4
    check_ranges(outer(width=jnp.array([1e-4, 1.0]), extra=jnp.array([2.0, 3.0]), chance=jnp.array(0.0)))


@pytest.mark.parametrize(
    ("params", "message"),
    [
        (with_share(1.5), r"^Outer\.parts\[1\]\.share is 1\.5; it must be from 0 to 1$"),
        (with_share(np.nan), r"^Outer\.parts\[1\]\.share is nan; it must be from 0 to 1$"),
        (outer(width=jnp.array(9e-5)), r"^Outer\.width is 9e-05; it must be from 0\.0001 to 1$"),
        (outer(extra=jnp.array(3.5)), r"^Outer\.extra is 3\.5; it must be from 2 to 3$"),
        (outer(chance=jnp.array([1.0, -1.0])), r"^Outer\.chance is -1; it must be finite and at least 0$"),
        (outer(chance=jnp.array(np.inf)), r"^Outer\.chance is inf; it must be finite and at least 0$"),
        (outer(angle=jnp.array(-np.inf)), r"^Outer\.angle is -inf; it must be a finite number$"),
        (
            MicrofacetParams(Ggx(Axes(jnp.array(0.5), jnp.array(2.0))), Schlick(jnp.ones(3))),
            r"^MicrofacetParams\.distribution\.roughness\.alpha_y is 2; it must be from 0\.0001 to 1$",
        ),
        (
            MicrofacetParams(Ggx(Isotropic(jnp.array(0.5)), jnp.array([0.0, 101.0])), Schlick(jnp.ones(3))),
            r"^MicrofacetParams\.distribution\.slope is 101; it must be from -100 to 100$",
        ),
    ],
)
def test_what_lies_outside_is_named(params: NamedTuple, message: str):
    with pytest.raises(ValueError, match=message):
        check_ranges(params)


def test_entries_of_a_tensor_are_judged_together():
    check_ranges(Ggx(Tensor(jnp.array(0.5), jnp.array(0.5), jnp.array(0.4))))
    faulty = Ggx(Tensor(jnp.array([0.5, 0.9]), jnp.array([0.5, 0.5]), jnp.array([0.4, 0.4])))
    with pytest.raises(ValueError, match=r"^Ggx\.roughness has eigenvalues 0\.252786 and 1\.14721; both must be from"):
        check_ranges(faulty)


def test_traced_parameters_are_taken():
    def traced(width: jax.Array, c: jax.Array) -> jax.Array:
        check_ranges((outer(width=width), Tensor(width, width, c)))
        return width

    assert float(jax.jit(traced)(jnp.array(7.0), jnp.array(9.0))) == 7.0


@pytest.mark.parametrize(
    ("given", "valid", "slope"),
    [(-0.5, 0.0, 0.0), (0.0, 0.0, 1.0), (0.25, 0.25, 1.0), (1.0, 1.0, 1.0), (1.5, 1.0, 0.0)],
)
def test_clamped_values_and_gradients(given: float, valid: float, slope: float):
    def share(x: jax.Array) -> jax.Array:
        return clamp(outer(parts=(Inner(x, x),))).parts[0].share

    assert float(share(jnp.array(given))) == valid
    assert float(jax.grad(share)(jnp.array(given))) == slope


def test_clamping_leaves_the_rest_alone_and_nan_is_nan():
    params = outer(width=jnp.array([np.nan, 2.0, 0.0], jnp.float32), chance=jnp.array(np.inf))
    clamped = clamp(params)
    np.testing.assert_array_equal(clamped.width, np.array([np.nan, 1.0, 1e-4], np.float32))
    assert clamped.extra is None
    assert float(clamped.parts[1].free) == -7.0
    assert float(clamped.chance) == np.inf
    assert clamp(None) is None


def test_a_clamped_tensor_is_valid():
    clamped = clamp(Ggx(Tensor(jnp.array(3.0), jnp.array(0.5), jnp.array(-9.0)), jnp.array([200.0, 0.0])))
    check_ranges(clamped)
    np.testing.assert_array_equal(clamped.slope, [100.0, 0.0])


def test_ranges_come_in_flattening_order():
    params = outer(chance=jnp.array(1.0))
    assert ranges_of(params) == [SHARE, ANY, SHARE, ANY, Range(1e-4, 1.0), Range(0.0, np.inf)]
    lobe = MicrofacetParams(Ggx(Tensor(*jnp.array([0.5, 0.5, 0.0]))), Conductor(jnp.ones(3), jnp.ones(3)))
    found = ranges_of(lobe)
    assert len(found) == len(jax.tree.leaves(lobe))
    assert found[:3] == [ROUGHNESS, ROUGHNESS, ANY]
    assert ranges_of(jnp.array(1.0)) == [ANY]
