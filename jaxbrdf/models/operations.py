"""How many floating-point operations one evaluation of a model takes, counted on its traced program.

Counted as Timonen et al. count (section 5; their tool is NVlabs/edm2's count_flops.py): a multiply-add of a matrix
product is one, a sigmoid three and so SiLU with its product too, every other arithmetic operation or comparison of
floating-point numbers one; moving data, choosing between two numbers and the integers of addresses are free. With the
exponential, without fetching latents, which is the texture units' work. A processor's data sheet counts a multiply-add
as two: `Operations.flops`.

It is 2% above their table 5 for the gated model and 7 to 16% below for the others. Networks and activations follow from
the sizes; what their programs do to coordinates, a fifth to a third of their counts, is not printed. The GGX mip map
takes five times their "~100", since its raw numbers are made valid, and reciprocal normal mapping is part of it.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.models.spatial import SpatialCoordinates
from jaxbrdf.texture.lookup import bilinear
from jaxbrdf.texture.pyramid import Pyramid, is_pyramid
from jaxbrdf.types import Model, Params

FREE = {
    "broadcast_in_dim",
    "concatenate",
    "convert_element_type",
    "copy",
    "dynamic_slice",
    "gather",
    "is_finite",
    "pad",
    "reshape",
    "rev",
    "select_n",
    "slice",
    "split",
    "squeeze",
    "stop_gradient",
    "transpose",
    "while",
}
"""Primitives that compute nothing. The only loop without a footprint is `jaxbrdf.core.staging`'s, which never turns."""

SIGMOID = 2
"""Of JAX's `logistic`; with the product of SiLU three."""

WITHIN = ("jaxpr", "call_jaxpr")
"""Where a primitive that calls a function has it."""


class Operations(NamedTuple):
    """Of one query.

    Attributes:
        products: multiply-adds of matrix products.
        others: everything else.
    """

    products: int
    others: int

    @property
    def published(self) -> int:
        """As the paper counts: a multiply-add is one."""
        return self.products + self.others

    @property
    def flops(self) -> int:
        """As data sheets count: a multiply-add is two."""
        return 2 * self.products + self.others

    def less(self, other: Operations) -> Operations:
        """The difference."""
        return Operations(self.products - other.products, self.others - other.others)


NONE = Operations(0, 0)


def spatial_operations(model: Model) -> Operations:
    """Of a model over `SpatialCoordinates`; nothing is evaluated, whatever the sizes."""
    params = jax.eval_shape(model.init, jax.random.key(0))
    # what is done once for all queries, such as laying out a texture, is in both
    return _of_batch(model, params, 3).less(_of_batch(model, params, 2))


def _of_batch(model: Model, params: Params, batch: int) -> Operations:
    def value(params: Params, coordinates: SpatialCoordinates) -> jax.Array:
        return jnp.exp(model.decode(params, coordinates))

    def latents(params: Params, uv: jax.Array) -> list[jax.Array]:
        pyramids = [part for part in jax.tree.leaves(params, is_leaf=is_pyramid) if isinstance(part, Pyramid)]
        return [bilinear(pyramid.layout, pyramid.texels, uv.T) for pyramid in pyramids]

    w, uv = jnp.zeros((3, batch)), jnp.zeros((2, batch))
    whole = jax.make_jaxpr(value)(params, SpatialCoordinates(w, w, uv, None))
    return _count(whole.jaxpr).less(_count(jax.make_jaxpr(latents)(params, uv).jaxpr))


def _count(jaxpr: Any) -> Operations:
    counts = [_of_equation(equation) for equation in _used(jaxpr)]
    return Operations(sum(count.products for count in counts), sum(count.others for count in counts))


def _used(jaxpr: Any) -> list[Any]:
    """The equations that the results depend on: a compiler drops the rest."""
    wanted, used = {id(variable) for variable in jaxpr.outvars}, []
    for equation in reversed(jaxpr.eqns):
        if any(id(variable) in wanted for variable in equation.outvars):
            wanted |= {id(variable) for variable in equation.invars}
            used.append(equation)
    return used


def _of_equation(equation: Any) -> Operations:
    name = equation.primitive.name
    inner = next((equation.params[key] for key in WITHIN if key in equation.params), None)
    if inner is not None:
        return _count(getattr(inner, "jaxpr", inner))
    first, out = equation.invars[0].aval if equation.invars else None, equation.outvars[0].aval
    if name in FREE or first is None or not jnp.issubdtype(first.dtype, jnp.floating):
        return NONE
    if name == "dot_general":
        (contracted, _), _ = equation.params["dimension_numbers"]
        return Operations(math.prod(out.shape) * math.prod(first.shape[axis] for axis in contracted), 0)
    if name.startswith("reduce_"):
        return Operations(0, math.prod(first.shape) - math.prod(out.shape))
    return Operations(0, math.prod(out.shape) * (SIGMOID if name == "logistic" else 1))
