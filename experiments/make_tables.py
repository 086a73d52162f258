"""Writes the documentation's tables from the results that the benchmark scripts left, and the README's from the same.

    python experiments/make_tables.py            # writes docs/tables/*.md, which pages take in, and README.md
    python experiments/make_tables.py --check    # writes nothing; fails if a table is not what the results say

A table whose results are not there yet says by which script they come.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from experiments.surface_tables import (
    spatial_opencl,
    spatial_throughput,
    surface_ablations,
    surface_ratios,
    surfaces,
)
from jaxbrdf.report.tables import Column, Row, geometric_mean, grouped, markdown, with_block

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / "experiments" / "results"

RATIOS = (
    Column("mae_ratio", "MAE", ".3f", geometric_mean),
    Column("smape_ratio", "SMAPE", ".3f", geometric_mean),
    Column("rmse_ratio", "RMSE", ".3f", geometric_mean),
    Column("log_rmse_ratio", "log-RMSE", ".3f", geometric_mean),
)
COSTS = (
    Column("fit_seconds", "fitting, s", ".1f", max),
    Column("compile_seconds", "compilation, s", ".1f", max),
    Column("peak_memory_gb", "memory, GB", ".2f", max),
    Column("jax_ns_per_evaluation", "JAX, ns", ".0f", max),
    Column("opencl_ns_per_evaluation", "OpenCL, ns", ".0f", max),
    Column("bytes", "bundle, bytes", ",.0f", max),
)
MATERIAL = Column("material", "material")
FLIP = Column("flip", "FLIP", ".4f", max)
FITS = (MATERIAL, *RATIOS, FLIP, *COSTS)


class Table(NamedTuple):
    """A table of the documentation.

    Attributes:
        name: of the table, without .md.
        script: that makes the results.
        write: the results' JSON as Markdown.
        in_readme: whether it stands in the README too.
        source: name of the results, without .json, where it is not the table's.
    """

    name: str
    script: str
    write: Callable[[Any], str]
    in_readme: bool = False
    source: str = ""


def fits(rows: list[Row]) -> str:
    """Errors of one fit a material, their geometric means, and the greatest cost."""
    return markdown(rows, FITS, closing="geometric mean; greatest cost")


def models(rows: list[Row]) -> str:
    """Errors of each model over all materials."""
    columns = (Column("model", "model"), *RATIOS, FLIP, *COSTS)
    return markdown(grouped(rows, "model", columns), columns)


def energy(rows: list[Row]) -> str:
    """The largest albedo with and without the energy scale, errors over those without, and both times."""
    columns = (
        MATERIAL,
        Column("albedo_without", "albedo without", ".3f", max),
        Column("albedo", "with", ".4f", max),
        Column("mae_ratio", "MAE", ".3f", geometric_mean),
        Column("least_mae_ratio", "MAE at least", ".3f", max),
        Column("smape_ratio", "SMAPE", ".3f", geometric_mean),
        Column("rmse_ratio", "RMSE", ".3f", geometric_mean),
        Column("ns_without", "OpenCL, ns without", ".1f", geometric_mean),
        Column("ns", "with", ".1f", geometric_mean),
    )
    return markdown(rows, columns, closing="geometric mean; greatest albedo")


def least_squares(found: dict[str, Any]) -> str:
    """Errors of each analytic model over all materials, and the slowest fit."""
    columns = (
        Column("model", "model"),
        Column("mae", "MAE", ".4f", geometric_mean),
        Column("smape", "SMAPE", ".3f", geometric_mean),
        Column("rmse", "RMSE", ".3f", geometric_mean),
        Column("log_rmse", "log-RMSE", ".4f", geometric_mean),
        Column("fit_seconds", "fitting, s", ".1f", max),
        Column("over_best_of_20", "squared error over the best of 20", ".3f", max),
        Column("ns", "OpenCL, ns", ".1f"),
    )
    rows = grouped(found["rows"], "model", columns)
    return markdown([row | {"ns": found["opencl"]["ns"][row["model"]]} for row in rows], columns)


def throughput(found: dict[str, Any]) -> str:
    """Training queries a second, beside what the processor can do."""
    rows = [
        {"what": "this package, queries a second", "value": found["jax_queries_per_second"]},
        {"what": "eager PyTorch, queries a second", "value": found["torch_queries_per_second"]},
        {"what": "ratio", "value": f"{found['ratio']:.1f}"},
        {"what": "measured FMA ceiling, GFLOP/s", "value": found["fma_ceiling_gflops"]},
        {"what": "queries a second for each GFLOP/s", "value": found["queries_per_second_per_gflops"]},
    ]
    return markdown(rows, (Column("what", f"batch of {found['batch']:,}"), Column("value", "measured", ",.0f")))


def rgl(found: dict[str, Any]) -> str:
    """Relative differences from Mitsuba, file by file."""
    rows = [
        {"file": file, "median": kinds["value"]["median"], "p99": kinds["value"]["p99"]}
        | {"pdf median": kinds["density"]["median"], "pdf p99": kinds["density"]["p99"]}
        for file, kinds in found["files"].items()
    ]
    names = {"median": "f, median", "p99": "f, 99 %", "pdf median": "pdf, median", "pdf p99": "pdf, 99 %"}
    columns = (Column("file", "file"), *(Column(key, title, ".1e", max) for key, title in names.items()))
    return markdown(rows, columns, closing="worst")


CANCELLATION = "difference without the coat's cancellation"


def mitsuba_brdfs(found: dict[str, Any]) -> str:
    """Relative differences from Mitsuba, case by case, as they are and with a known factor taken out."""
    rows = []
    for case, of in found["cases"].items():
        rows.append({"case": case, "what": "as it is"} | _differences(of["difference"]))
        if "factor" in of:
            rest = _differences(of["difference without the factor"])
            rows.append({"case": "", "what": f"without {of['factor']}"} | rest)
        if CANCELLATION in of:
            share = of["share without the coat's cancellation"]
            what = f"the {share:.0%} of pairs without the coat's cancellation"
            rows.append({"case": "", "what": what} | _differences(of[CANCELLATION]))
    names = {"median": "f, median", "p99": "f, 99 %", "pdf median": "pdf, median", "pdf p99": "pdf, 99 %"}
    titles = (Column("case", "case"), Column("what", "difference"))
    return markdown(rows, (*titles, *(Column(key, title, ".1e") for key, title in names.items())))


def _differences(kinds: dict[str, Any]) -> dict[str, Any]:
    value, density = kinds["value"], kinds["density"]
    return {"median": value["median"], "p99": value["p99"], "pdf median": density["median"], "pdf p99": density["p99"]}


def samplers(found: dict[str, Any]) -> str:
    """Variance and time of each sampler over the cosine's, geometric means over the materials."""
    relative = found["summary"]["relative_to_cosine"]
    rows = [{"sampler": name} | {key: of[name] for key, of in relative.items()} for name in relative["variance"]]
    columns = (
        Column("sampler", "sampler"),
        Column("variance", "variance", ".4f"),
        Column("variance_with_light", "with the light's samples", ".4f"),
        Column("ns_to_unit_variance", "time to unit variance", ".4f"),
    )
    return markdown(rows, columns)


def _named(device: str) -> str:
    """A device's driver, without the processor's name."""
    return device.partition("(")[2].rstrip(")").split(", ")[-1].replace("OpenCL 3.1 LINUX", "Intel's runtime")


SPEED_ROWS = (
    ("FMA ceiling, GFLOP/s", "fma_ceiling_gflops", 1, ".0f"),
    ("10-32-32-32-6, ReLU, share of the ceiling", "relu share", 1, ".2f"),
    ("10-32-32-32-6, SiLU, share of the ceiling", "silu share", 1, ".2f"),
    ("gated model, million evaluations a second", "gated_evaluations_per_second", 1e-6, ".1f"),
    ("the same, for each GFLOP/s of the ceiling", "gated_evaluations_per_second_per_gflops", 1e-6, ".2f"),
    ("jitted JAX, million evaluations a second", "jax_evaluations_per_second", 1e-6, ".1f"),
    ("gated model over jitted JAX", "gated_over_jax", 1, ".1f"),
    ("one frame of 1920 x 1080, ms", "frame_milliseconds", 1, ".1f"),
    ("1,000 queries, whole call from Python, us", "call_microseconds", 1, ".0f"),
    ("one inline query of one material, ns", "one", 1, ".0f"),
    ("the same, one of 25 materials by index, ns", "one_of_25", 1, ".0f"),
    ("program build, nothing cached, s", "cold_seconds", 1, ".1f"),
    ("program build, cached, ms", "cached_milliseconds", 1, ".0f"),
)


def _speeds(found: dict[str, Any]) -> dict[str, Any]:
    """A device's figures under the names of `SPEED_ROWS`."""
    shares = {f"{name} share": value for name, value in found["network_share_of_ceiling"].items()}
    return found | shares | found["choosing_nanoseconds"]


def opencl_speed(found: list[dict[str, Any]]) -> str:
    """One column a device."""
    rows = []
    for title, key, unit, form in SPEED_ROWS:
        values = {_named(device["device"]): _speeds(device)[key] for device in found}
        rows.append({"what": title} | {name: _with_spread(value, unit, form) for name, value in values.items()})
    shapes = {_named(d["device"]): f"{d['shape']['width']} x {d['shape']['rows']}" for d in found}
    rows.append({"what": "queries a work item x rows a tile"} | shapes)
    return markdown(rows, (Column("what", "what"), *(Column(_named(d["device"]), _named(d["device"])) for d in found)))


def _with_spread(value: Any, unit: float, form: str) -> str:
    """The median, and the quartiles."""
    if not isinstance(value, dict):
        return format(unit * value, form)
    median, lower, upper = (format(unit * value[name], form) for name in ("median", "lower", "upper"))
    return f"{median} ({lower} to {upper})"


def opencl_effects(found: list[dict[str, Any]]) -> str:
    """Nanoseconds that each effect costs, one column a device."""
    rows = []
    for i, effect in enumerate(found[0]["effects"]):
        row = {"effect": effect["effect"]}
        for device in found:
            entry = device["effects"][i]
            row[_named(device["device"])] = f"{entry.get('nanoseconds', entry.get('saved'))['median']:.1f}"
        rows.append(row)
    columns = (Column(_named(d["device"]), f"{_named(d['device'])}, ns") for d in found)
    return markdown(rows, (Column("effect", "effect"), *columns))


def opencl_float64(found: dict[str, Any]) -> str:
    """The largest difference from float64 by model and variant, one column a device."""
    rows = [
        {"model": row["model"], "variant": row["variant"]}
        | {_named(name): of["violation"] for name, of in row["devices"].items()}
        for row in found["rows"]
    ]
    names = [_named(name) for name in found["rows"][0]["devices"]]
    columns = (Column("model", "model"), Column("variant", "variant"), *(Column(n, n, ".2f", max) for n in names))
    return markdown(rows, columns, closing="worst")


def half_storage(rows: list[Row]) -> str:
    """What float16 adds to each error, in per cent of it."""
    names = {"mae": "MAE, %", "smape": "SMAPE, %", "rmse": "RMSE, %"}
    columns = (Column("material", "material"), *(Column(key, title, ".3f", max) for key, title in names.items()))
    return markdown(rows, columns, closing="worst")


TABLES = (
    Table("bench_fit_quick", "bench_fit.py --preset quick", fits, in_readme=True),
    Table("bench_fit_standard", "bench_fit.py --preset standard", fits),
    Table("bench_models", "bench_models.py", models),
    Table("least_squares", "bench_least_squares.py", least_squares),
    Table("energy", "bench_energy.py", energy),
    Table("throughput", "bench_throughput.py", throughput),
    Table("opencl_speed", "bench_opencl.py", opencl_speed),
    Table("opencl_effects", "bench_opencl.py", opencl_effects, source="opencl_speed"),
    Table("opencl_float64", "check_opencl_float64.py", opencl_float64),
    Table("half_storage", "check_half_storage.py", half_storage),
    Table("mitsuba_brdfs", "check_brdfs_against_mitsuba.py", mitsuba_brdfs),
    Table("samplers", "bench_samplers.py", samplers),
    Table("bundle_samplers", "bench_samplers.py --bundles", samplers),
    Table("surfaces", "bench_surfaces.py", surfaces),
    Table("surface_ratios", "bench_surfaces.py", surface_ratios, source="surfaces"),
    Table("surface_ablations", "bench_surface_ablations.py", surface_ablations),
    Table("spatial_opencl", "bench_spatial_opencl.py", spatial_opencl),
    Table("spatial_throughput", "bench_spatial_throughput.py", spatial_throughput),
    Table("rgl_mitsuba", "check_rgl_against_mitsuba.py", rgl),
)


def content(table: Table) -> str:
    """The table in Markdown, or where its results are to come from."""
    path = RESULTS / f"{table.source or table.name}.json"
    if not path.exists():
        return f"Not measured yet: `python experiments/{table.script}` does it.\n"
    return table.write(json.loads(path.read_text()))


def pages() -> dict[Path, str]:
    """What every file should hold."""
    written = {ROOT / "docs" / "tables" / f"{table.name}.md": content(table) for table in TABLES}
    readme = (ROOT / "README.md").read_text()
    for table in TABLES:
        if table.in_readme:
            readme = with_block(readme, table.name, content(table))
    return written | {ROOT / "README.md": readme}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="write nothing; fail if a table is not what results say")
    check = parser.parse_args().check
    stale = {path: text for path, text in pages().items() if not path.exists() or path.read_text() != text}
    for path, text in stale.items():
        print(f"{path.relative_to(ROOT)} {'is stale' if check else 'written'}")
        if not check:
            path.write_text(text)
    if check and stale:
        raise SystemExit("run: python experiments/make_tables.py")


if __name__ == "__main__":
    main()
