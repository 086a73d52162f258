"""The spatially varying gated model and its targets in eager PyTorch, as `bench_spatial_throughput.py` compares them.

The strongest form that was found: all lookups, the latents' with as many probes as each place needs and those of the
matrices, are `embedding_bag`, one fused kernel with a fused transpose, which also differentiates by the weights.
`grid_sample` cannot read a number of probes that differs by place.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import torch
from torch.nn.functional import embedding_bag, silu, softplus

LARGEST = 2.0**30


class Levels(NamedTuple):
    """A square pyramid that repeats: texels along the finest level, and texels before each level."""

    size: int
    offsets: torch.Tensor

    @property
    def top(self) -> int:
        return len(self.offsets) - 1


def levels(size: int) -> Levels:
    """All levels of a square pyramid."""
    sizes = [(size >> n) ** 2 for n in range(size.bit_length())]
    return Levels(size, torch.tensor(np.cumsum([0, *sizes[:-1]])))


def corners(pyramid: Levels, uv: torch.Tensor, level: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """Rows of the four texels around each uv `(n, 2)` on its level, and their weights, `(n, 4)` each."""
    count = (pyramid.size >> level)[:, None]
    at = (uv - uv.floor()) * count - 0.5
    low = at.floor()
    along = at - low
    x0, y0 = torch.remainder(low.long(), count).unbind(1)
    x1, y1 = torch.remainder(low.long() + 1, count).unbind(1)
    start, row = pyramid.offsets[level], count[:, 0]
    upper, lower = start + y0 * row, start + y1 * row
    x, y = along.unbind(1)
    index = torch.stack([upper + x0, upper + x1, lower + x0, lower + x1], 1)
    return index, torch.stack([(1 - x) * (1 - y), x * (1 - y), (1 - x) * y, x * y], 1)


@torch.no_grad()
def anisotropic(pyramid: Levels, uv: torch.Tensor, footprint: torch.Tensor, most: int):
    """Rows, weights and first row of each place for `embedding_bag`: the rules of `jaxbrdf.texture.footprint`."""
    a, b, c, d = (footprint * pyramid.size).clamp(-LARGEST, LARGEST).reshape(-1, 4).unbind(1)
    p, q = torch.complex(0.5 * (a + d), 0.5 * (c - b)), torch.complex(0.5 * (a - d), 0.5 * (c + b))
    major, small, product = p.abs() + q.abs(), (p.abs() - q.abs()).abs(), p * q
    axis = torch.exp(0.5j * product.angle())
    least = (major / most).clamp_min(1.0)
    minor = torch.maximum(small, least)
    excess = torch.where(small < least, (0.25 * (major - minor) * (major + minor)).clamp_min(0.0), product.abs())
    number = (1.0 + 12.0 * excess / (minor * minor)).sqrt().ceil().clamp(1.0, most)
    step = torch.where(number > 1.0, (12.0 * excess / (number * number - 1.0).clamp_min(1.0)).sqrt(), 0.0)
    scale = minor.clamp(1.0, 2.0**pyramid.top)
    level = scale.log2().floor().clamp(0.0, pyramid.top)
    ratio = scale * torch.exp2(-level)
    share = ((ratio * ratio - 1.0) / 3.0).clamp(0.0, 1.0)
    count = number.long()
    items = torch.where(share > 0.0, 2 * count, count)
    place = torch.repeat_interleave(items)
    ends = items.cumsum(0)
    within = torch.arange(len(place)) - (ends - items)[place]
    is_upper = within >= count[place]
    probe = torch.where(is_upper, within - count[place], within) - 0.5 * (number[place] - 1)
    move = torch.view_as_real(axis * step)[place] / pyramid.size
    on = level.long()[place] + is_upper
    index, weight = corners(pyramid, uv[place] + probe[:, None] * move, on.clamp_max(pyramid.top))
    weight = weight * (torch.where(is_upper, share[place], 1.0 - share[place]) / number[place])[:, None]
    return index.reshape(-1), weight.reshape(-1), 4 * (ends - items)


class Spatial(torch.nn.Module):
    """The model with the arrays of `SpatialGatedParams`, by name."""

    def __init__(self, arrays: dict[str, np.ndarray], size: int, probes: int) -> None:
        super().__init__()
        self.pyramid, self.probes = levels(size), probes
        self.arrays = torch.nn.ParameterDict({k: torch.from_numpy(v.copy()) for k, v in arrays.items()})

    def forward(self, wi: torch.Tensor, wo: torch.Tensor, uv: torch.Tensor, footprint: torch.Tensor) -> torch.Tensor:
        """ln f, `(n, 3)`."""
        arrays = self.arrays
        index, weight, starts = anisotropic(self.pyramid, uv, footprint, self.probes)
        z = embedding_bag(index, arrays["s"], starts, mode="sum", per_sample_weights=weight)
        (r_h, turn_h), (r_d, turn_d) = places(z @ arrays["frame"], wi, wo)
        of_h, of_d = (z @ arrays["warp_weights"] + arrays["warp_biases"]).chunk(2, 1)
        z_h = gated(arrays["h"], warped(of_h, r_h), turn_h, z)
        z_d = gated(arrays["d"], warped(of_d, r_d), turn_d, z)
        x = torch.cat([z_h, z_d], 1)
        for layer in range(2):
            x = silu(torch.addmm(arrays[f"b{layer}"], x, arrays[f"w{layer}"]))
        return torch.addmm(arrays["b2"], x, arrays["w2"])


def places(frame: torch.Tensor, wi: torch.Tensor, wo: torch.Tensor):
    """Radius and turn of half and difference vector, seen in the latent's frame."""
    normal = unit(frame[:, :3] + torch.tensor([0.0, 0.0, 1.0]))
    side = frame[:, 3:] + torch.tensor([1.0, 0.0, 0.0])
    tangent = unit(side - (side * normal).sum(1, keepdim=True) * normal)
    axes = torch.stack([tangent, torch.linalg.cross(normal, tangent), normal], 1)
    seen = torch.bmm(axes, torch.stack([wi, wo], 2))
    x, y, z = seen[:, 0], seen[:, 1], seen[:, 2].abs()
    i, o = (torch.stack([x[:, k], y[:, k], z[:, k]], 1) for k in range(2))
    half, across = torch.nn.functional.normalize(i + o), 0.5 * (i - o)
    sin_h = (half[:, 0] ** 2 + half[:, 1] ** 2 + 1e-30).sqrt()
    cos_phi, sin_phi = half[:, 0] / sin_h, half[:, 1] / sin_h
    along = cos_phi * across[:, 0] + sin_phi * across[:, 1]
    d_x, d_y = half[:, 2] * along - sin_h * across[:, 2], cos_phi * across[:, 1] - sin_phi * across[:, 0]
    return polar(half[:, 0], half[:, 1], 2 * torch.pi), polar(d_x, d_y, torch.pi)


def unit(v: torch.Tensor) -> torch.Tensor:
    return v * (v * v).sum(1, keepdim=True).clamp_min(1e-6).rsqrt()


def polar(x: torch.Tensor, y: torch.Tensor, period: float) -> tuple[torch.Tensor, torch.Tensor]:
    turn = torch.atan2(y, x) / period
    return (x * x + y * y + 1e-30).sqrt().clamp_max(1.0), torch.remainder(turn, 1.0)


def warped(rows: torch.Tensor, r: torch.Tensor) -> torch.Tensor:
    """Timonen et al., Eq. 7."""
    logits, exponents = rows.chunk(2, 1)
    exponents = 0.5 + softplus(exponents + float(np.log(np.expm1(0.5))))
    return (torch.softmax(logits, 1) * r.clamp_min(1e-37)[:, None] ** exponents).sum(1)


def gated(texture: torch.Tensor, r: torch.Tensor, turn: torch.Tensor, z: torch.Tensor) -> torch.Tensor:
    """Matrices `(40, n_r, n_phi)` looked up and multiplied with z (Timonen et al., Eq. 6)."""
    numbers, n_r, n_phi = texture.shape
    centre = texture[:, :1, :1].expand(-1, 1, n_phi)
    table = torch.cat([centre, texture[:, 1:]], 1).reshape(numbers, -1).T.contiguous()
    x, y = r * (n_r - 1), turn * n_phi
    i, j = x.detach().long().clamp_max(n_r - 2), y.detach().long().clamp_max(n_phi - 1)
    x, y, right = x - i, y - j, (j + 1) % n_phi
    index = torch.stack([i * n_phi + j, i * n_phi + right, (i + 1) * n_phi + j, (i + 1) * n_phi + right], 1)
    weight = torch.stack([(1 - x) * (1 - y), (1 - x) * y, x * (1 - y), x * y], 1)
    matrices = embedding_bag(index, table, mode="sum", per_sample_weights=weight)
    return torch.bmm(matrices.view(len(z), -1, z.shape[1]), z[:, :, None])[:, :, 0]


@torch.no_grad()
def draw(texels: torch.Tensor, pyramid: Levels, count: int, samples: int, crowding: float):
    """Queries with targets of `samples` points, as `jaxbrdf.surface.draws` without scattered light: less work."""
    wi, wo = (cosine(torch.rand(count, 2)) for _ in range(2))
    finest = float(np.log2(1 / 8 / pyramid.size))
    t = torch.expm1(crowding * torch.rand(count)) / float(np.expm1(crowding))
    e, phi = torch.exp2(finest + (1.0 - finest) * t), 2 * torch.pi * torch.rand(count)
    long, c, s = e * (1 + 0.2 * torch.randn(count)) / wo[:, 2].clamp_min(2.0**-24), phi.cos(), phi.sin()
    footprint = torch.stack([c * long, -s * e, s * long, c * e], 1).view(-1, 2, 2)
    uv = torch.rand(count, 2)
    radius, angle = (
        0.5 * (-2 * torch.rand(samples, count).log1p_().neg_()).abs().sqrt(),
        2 * torch.pi * torch.rand(samples, count),
    )
    x = torch.stack([radius * angle.cos(), radius * angle.sin()], -1)
    points = uv + torch.einsum("nij,snj->sni", footprint, x)
    index, weight = corners(pyramid, points.reshape(-1, 2), torch.zeros(samples * count, dtype=torch.long))
    values = embedding_bag(index, texels, mode="sum", per_sample_weights=weight).view(samples, count, 8)
    return (wi, wo, uv, footprint), shade(values, wi, wo).mean(0)


def cosine(u: torch.Tensor) -> torch.Tensor:
    r, phi = u[:, 0].sqrt(), 2 * torch.pi * u[:, 1]
    return torch.stack([r * phi.cos(), r * phi.sin(), (1 - u[:, 0]).sqrt()], 1)


def shade(values: torch.Tensor, wi: torch.Tensor, wo: torch.Tensor) -> torch.Tensor:
    """Reciprocal part of glTF's metallic-roughness reflectance about a mapped normal, of `(..., 8)` maps."""
    base, metallic = values[..., :3].clamp(0, 1), values[..., 3:4].clamp(0, 1)
    square = (values[..., 4].clamp(1e-2, 1.0) ** 4)[..., None]
    normal = torch.nn.functional.normalize(values[..., 5:], dim=-1)
    i, o = untilt(wi.expand_as(normal), normal), untilt(wo.expand_as(normal), normal)
    cos_i, cos_o = i[..., 2:].clamp_min(2.0**-24), o[..., 2:].clamp_min(2.0**-24)
    half = torch.nn.functional.normalize(i + o, dim=-1)
    cos_h, cos_d = half[..., 2:], (half * i).sum(-1, keepdim=True)
    flat = half[..., :1] ** 2 + half[..., 1:2] ** 2
    density = square / (torch.pi * (flat + square * cos_h * cos_h) ** 2)
    areas = [0.5 * (cos + (square + (1 - square) * cos * cos).sqrt()) for cos in (cos_i, cos_o)]
    curve = (1 - cos_d.clamp(0, 1)) ** 5
    f0 = 0.04 * (1 - metallic) + metallic * base
    f = (1 - metallic) * 0.96 * (1 - curve) * base / torch.pi
    f = f + (f0 + (1 - f0) * curve) * density * 0.25 / (areas[0] * areas[1])
    gain = 0.5 * (cos_i / wi[..., 2:] + cos_o / wo[..., 2:])
    return torch.where((i[..., 2:] > 0) & (o[..., 2:] > 0), f * gain, 0.0)


def untilt(w: torch.Tensor, n: torch.Tensor) -> torch.Tensor:
    across = -(n[..., 0] * w[..., 0] + n[..., 1] * w[..., 1])
    a = w[..., 2] - across / (1 + n[..., 2])
    x, y = w[..., 0] - a * n[..., 0], w[..., 1] - a * n[..., 1]
    return torch.stack([x, y, w[..., 2] * n[..., 2] - across], -1)
