"""Tables of the benchmarks of spatially varying models, from their results."""

from __future__ import annotations

from typing import Any

from jaxbrdf.report.tables import Column, geometric_mean, markdown

PUBLISHED = {"ggx-mip": 0.42, "zeltner": 0.79, "neumip": 0.70, "tripleplane": 0.83}
"""Mean FLIP of the gated model over others', each trained for hours on a GPU (Timonen et al., table 6)."""

WHOLE = "gated"

ERRORS = (
    Column("flip", "FLIP"),
    Column("coarse", "from 2 texels", ".4f"),
    Column("ssim", "SSIM", ".4f"),
    Column("mae", "MAE", ".4f"),
    Column("rmse_hdr", "RMSE of f", ".4f"),
)


def surfaces(found: dict[str, Any]) -> str:
    """Errors of every model on every set."""
    rows = []
    for row in found["rows"]:
        for place, (model, of) in enumerate(row["materials"].items()):
            cost = row["cost"].get(model, {})
            about = {"set": "" if place else row["set"], "model": model}
            rows.append(about | _errors(of) | {key: cost[key] for key in ("steps", "operations") if key in cost})
    costs = (Column("steps", "steps", ",d"), Column("operations", "operations", ",d"))
    return markdown(rows, (Column("set", "texture set"), Column("model", "model"), *ERRORS, *costs))


def surface_ratios(found: dict[str, Any]) -> str:
    """Mean FLIP of the gated model over the others', set by set, beside the paper's."""
    sets = [row["set"] for row in found["rows"]]
    rows = []
    for model in found["rows"][0]["materials"]:
        if model == WHOLE:
            continue
        ratios = {row["set"]: _flip(row, WHOLE) / _flip(row, model) for row in found["rows"]}
        coarse = [_coarse_flip(row, WHOLE) / _coarse_flip(row, model) for row in found["rows"]]
        closed = {"mean": geometric_mean(list(ratios.values())), "coarse": geometric_mean(coarse)}
        rows.append({"model": model} | ratios | closed | {"paper": PUBLISHED.get(model)})
    closing = (
        Column("mean", "geometric mean", ".2f"),
        Column("coarse", "from 2 texels", ".2f"),
        Column("paper", "paper", ".2f"),
    )
    return markdown(rows, (Column("model", "gated over"), *(Column(name, name, ".2f") for name in sets), *closing))


def surface_ablations(found: dict[str, Any]) -> str:
    """Errors of every arm, and at each camera's slant."""
    slants = [f"{slant:.0f}°" for slant, _ in found["scene"]["cameras"]]
    rows = []
    for arm, of in found["materials"].items():
        cameras = {slant: flip for slant, (flip, *_) in zip(slants, of["per_camera"]["flip"], strict=True)}
        rows.append({"arm": arm, "operations": found["operations"].get(arm)} | _errors(of) | cameras)
    columns = (Column("arm", "arm"), Column("operations", "operations", ",d"), *ERRORS)
    return markdown(rows, (*columns, *(Column(slant, f"FLIP at {slant}", ".4f") for slant in slants)))


def _errors(of: dict[str, Any]) -> dict[str, Any]:
    mean, low, high = of["flip"]
    return {
        "flip": f"{mean:.4f} ({low:.4f} to {high:.4f})",
        "coarse": of["from_two_texels"]["flip"][0],
        "ssim": of["ssim"][0],
        "mae": of["mae"][0],
        "rmse_hdr": of["rmse_hdr"],
    }


def _flip(row: dict[str, Any], model: str) -> float:
    return row["materials"][model]["flip"][0]


def _coarse_flip(row: dict[str, Any], model: str) -> float:
    return row["materials"][model]["from_two_texels"]["flip"][0]


def spatial_opencl(found: dict[str, Any]) -> str:
    """Milliseconds of a frame, medians and quartiles."""
    titles = {
        "opencl": "OpenCL, texels in float16",
        "opencl_float32": "OpenCL, texels in float32",
        "opencl_points": "OpenCL, points without filtering",
        "jax": "jitted JAX",
    }
    rows = [
        {"what": title, "ms": "{median:.0f} ({lower:.0f} to {upper:.0f})".format(**found["milliseconds"][key])}
        for key, title in titles.items()
    ]
    ratio = "{median:.1f} ({lower:.1f} to {upper:.1f})".format(**found["jax_over_opencl"])
    rows.append({"what": "jitted JAX over OpenCL", "ms": ratio})
    return markdown(rows, (Column("what", "frame of 1920 x 1080"), Column("ms", "ms")))


def spatial_throughput(found: dict[str, Any]) -> str:
    """Training queries a second, and the ratio of the better of one and two cores."""
    parts = {"model": "queries given", "whole": "queries and targets drawn"}
    rows = [
        {"what": title, "ratio": found[part]["ratio"]} | found[part]["samples_per_second"]
        for part, title in parts.items()
    ]
    sides = {"jax": "this package", "torch": "eager PyTorch"}
    columns = [
        Column(f"{side} {cores}", f"{title}, {count}", ",.0f")
        for side, title in sides.items()
        for cores, count in ((1, "one core"), (2, "two"))
    ]
    return markdown(rows, (Column("what", "queries a second"), *columns, Column("ratio", "best over best", ".1f")))
