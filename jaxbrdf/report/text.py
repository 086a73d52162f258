"""Results as text for a terminal."""

from __future__ import annotations

from typing import Any

ERRORS = (("mae", "MAE"), ("smape", "SMAPE"), ("rmse", "RMSE"), ("log_rmse", "log-RMSE"))


def fit_report(result: dict[str, Any]) -> str:
    """What a fit reached, what it cost and where it is."""
    errors, cost, files = result["errors"], result["cost"], result["files"]
    lines = [f"{title:9s} {errors[name]:.6f} +- {errors[f'{name}_standard_error']:.6f}" for name, title in ERRORS]
    lines.append(f"FLIP      {errors['image_flip']:.4f}   SSIM {errors['image_ssim']:.4f}   (sphere in the studio)")
    lines.append(f"fitting   {cost['fit_seconds']:.1f} s, compilation {cost['compile_seconds']:.1f} s")
    lines.append(f"JAX       {_rate(cost['jax_ns_per_evaluation'])} on this processor")
    nanoseconds, device = cost.get("opencl_ns_per_evaluation"), result["opencl_device"]
    lines.append(f"OpenCL    {_rate(nanoseconds)} on {device}" if nanoseconds else f"OpenCL    {device}")
    return "\n".join(
        [*lines, f"bundle    {files['bundle']}", f"report    {files['report']}", f"picture   {files['picture']}"]
    )


def _rate(nanoseconds: float) -> str:
    return f"{nanoseconds:.1f} ns an evaluation"


def comparison(report: dict[str, Any]) -> str:
    """A table of errors, one column for each of the compared."""
    columns = [name for name in ("bundle", "against", "ratio") if name in report]
    lines = [" " * 10 + "".join(f"{name:>12s}" for name in columns)]
    lines += [f"{title:10s}" + "".join(f"{report[c][name]:12.6f}" for c in columns) for name, title in ERRORS]
    images = [c for c in columns if c != "ratio"]
    lines += [f"{title:10s}" + "".join(f"{report[c][n]:12.6f}" for c in images) for n, title in _IMAGE_ERRORS]
    return "\n".join(lines)


_IMAGE_ERRORS = (("image_flip", "FLIP"), ("image_ssim", "SSIM"))


def written(result: dict[str, Any]) -> str:
    """The name of what was written."""
    return str(result["output"])


def fields(result: dict[str, Any], *, indent: str = "") -> str:
    """Nested fields, one a line."""
    lines = []
    for name, value in result.items():
        if isinstance(value, dict):
            lines += [f"{indent}{name}", fields(value, indent=indent + "  ")]
        else:
            lines.append(f"{indent}{name:16s} {value}")
    return "\n".join(lines)
