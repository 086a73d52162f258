"""Results as text for a terminal."""

from __future__ import annotations

from typing import Any

from jaxbrdf.report.pareto_table import by_input

ERRORS = (("mae", "MAE"), ("smape", "SMAPE"), ("rmse", "RMSE"), ("log_rmse", "log-RMSE"))


def fit_report(result: dict[str, Any]) -> str:
    """What a fit reached, what it cost and where it is; of a search, what was taken and what was not."""
    if "planar" in result:
        return _surface_report(result)
    errors, cost, files = result["errors"], result["cost"], result["files"]
    lines = [f"{title:9s} {errors[name]:.6f} +- {errors[f'{name}_standard_error']:.6f}" for name, title in ERRORS]
    lines.append(f"FLIP      {errors['image_flip']:.4f}   SSIM {errors['image_ssim']:.4f}   (sphere in the studio)")
    lines.append(_energy(result))
    lines.append(f"fitting   {cost['fit_seconds']:.1f} s, compilation {cost['compile_seconds']:.1f} s")
    lines.append(f"JAX       {_rate(cost['jax_ns_per_evaluation'])} on this processor")
    nanoseconds, device = cost.get("opencl_ns_per_evaluation"), result["opencl_device"]
    lines.append(f"OpenCL    {_rate(nanoseconds)} on {device}" if nanoseconds else f"OpenCL    {device}")
    lines += [f"bundle    {files['bundle']}", f"report    {files['report']}", f"picture   {files['picture']}"]
    lines.append(f"residuals {files['residuals']}")
    return "\n".join([*lines, *_search(result)])


def _surface_report(result: dict[str, Any]) -> str:
    """Of a texture set: errors on the planar scene, beside those of plain mip maps, cost and files."""
    cost, files = result["cost"], result["files"]
    lines = [*_planar(result["planar"])]
    lines.append(f"fitting   {cost['fit_seconds']:.1f} s, compilation {cost['compile_seconds']:.1f} s")
    return "\n".join([*lines, *(f"{name:9s} {files[name]}" for name in ("bundle", "report", "picture"))])


def _planar(report: dict[str, Any]) -> list[str]:
    scene, materials = report["scene"], report["materials"]
    lines = [f"planar scene: {scene['scales']} scales, {len(scene['cameras'])} cameras, {len(scene['lights'])} lights"]
    for name, of in materials.items():
        flip, ssim = of["flip"], of["ssim"][0]
        lines.append(f"{name:9s} FLIP {flip[0]:.4f} ({flip[1]:.4f} to {flip[2]:.4f})   SSIM {ssim:.4f}")
    lines.append(f"noise     FLIP {report['noise']['flip'][0]:.4f} of the reference's own")
    return [*lines, f"f         MAE {materials['fit']['mae_hdr']:.4f}   RMSE {materials['fit']['rmse_hdr']:.4f}"]


def _energy(result: dict[str, Any]) -> str:
    """The most light that any viewer gets back, and what it cost to keep that at one."""
    largest = f"albedo    {max(result['largest_albedo']):.3f} at most"
    before = result.get("without_energy_scale")
    if before is None:
        return largest
    return f"{largest}; without the energy scale MAE {before['mae']:.6f}, SMAPE {before['smape']:.6f}"


def _search(result: dict[str, Any]) -> list[str]:
    """Nothing unless candidates were chosen from."""
    if "candidate" not in result:
        return []
    width = max((len(one["candidate"]) for one in result["rejected"]), default=0)
    lines = [
        f"rejected  {one['candidate']:{width}s} {one['ns']:8.1f} ns  {_number(one['error'], 9)}  {one['reason']}"
        for one in result["rejected"]
    ]
    return [f"taken     {result['candidate']}", *lines]


def _number(value: float | None, width: int) -> str:
    return f"{'-':>{width}s}" if value is None else f"{value:{width}.6f}"


def _rate(nanoseconds: float) -> str:
    return f"{nanoseconds:.1f} ns an evaluation"


def comparison(report: dict[str, Any]) -> str:
    """A table of errors, one column for each of the compared; of a surface, its errors on the planar scene."""
    if "planar" in report:
        return "\n".join(_planar(report["planar"]))
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
    """Nested fields, one a line; sentences each on a line of their own."""
    lines = []
    for name, value in result.items():
        if isinstance(value, dict):
            lines += [f"{indent}{name}", fields(value, indent=indent + "  ")]
        elif isinstance(value, list) and any(isinstance(part, str) and " " in part for part in value):
            lines += [f"{indent}{name}", *(f"{indent}  {part}" for part in value)]
        else:
            lines.append(f"{indent}{name:16s} {value}")
    return "\n".join(lines)


def bench(result: dict[str, Any]) -> str:
    """A bundle's rates beside what the device and JAX can do."""
    least, most = result["ns_spread"]
    share = result["gflops"] / result["fma_ceiling_gflops"]
    millions = {name: result[f"{name}evaluations_per_second"] / 1e6 for name in ("", "jax_")}
    return "\n".join(
        [
            f"bundle    {result['name']}, {result['model']}, texels in {result['precision']}",
            f"device    {result['device']}, {result['width']} queries a work item",
            f"time      {_rate(result['ns_per_evaluation'])} (from {least:.1f} to {most:.1f} over the rounds)",
            f"rate      {millions['']:.2f} million evaluations a second",
            f"network   {result['gflops']:.1f} GFLOP/s, {share:.0%} of the FMA ceiling of "
            f"{result['fma_ceiling_gflops']:.1f} GFLOP/s",
            f"JAX       {millions['jax_']:.2f} million evaluations a second on this processor",
            f"build     {result['build_seconds']:.2f} s",
        ]
    )


def stability(result: dict[str, Any]) -> str:
    """A line for each check, and last how many passed and failed; what is not promised is measured alone."""
    words = {True: "passed", False: "FAILED", None: "measured"}
    lines = [f"material  {result['name']}"]
    for row in result["checks"]:
        bound = "" if row["bound"] is None else f"of {row['bound']:.3g}"
        lines.append(f"{row['check']:12s} {words[row['passed']]:9s} {row['value']:10.3g} {bound:12s} {row['note']}")
    return "\n".join([*lines, f"checks: {result['passed']} passed, {result['failed']} failed"])


def pareto(result: dict[str, Any]) -> str:
    """A table for each input, the cheapest candidate first, and where the files are; a star is on the front."""
    lines = []
    (one, title), (other, other_title), *_ = result["metrics"].items()
    for name, rows in by_input(result).items():
        width = max(len(text) for text in (name, *(row["candidate"] for row in rows)))
        lines += [f"{name:{width}s} {'ns':>9s} {title:>10s}  {other_title:>10s}  {'bytes':>10s}"]
        for row in rows:
            errors = " ".join(f"{row[m]:10.6f}{'*' if m in row['front'] else ' '}" for m in (one, other))
            lines.append(f"{row['candidate']:{width}s} {row['ns_per_evaluation']:9.1f} {errors} {row['bytes']:10,d}")
    lines += [f"failed    {one['input']}, {one['candidate']}: {one['reason']}" for one in result["failed"]]
    return "\n".join([*lines, *(f"{name:9s} {path}" for name, path in result["files"].items())])
