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
        name: of the results, without .json, and of the table, without .md.
        script: that makes the results.
        write: the results' JSON as Markdown.
        in_readme: whether it stands in the README too.
    """

    name: str
    script: str
    write: Callable[[Any], str]
    in_readme: bool = False


def fits(rows: list[Row]) -> str:
    """Errors of one fit a material, their geometric means, and the greatest cost."""
    return markdown(rows, FITS, closing="geometric mean; greatest cost")


def models(rows: list[Row]) -> str:
    """Errors of each model over all materials."""
    columns = (Column("model", "model"), *RATIOS, FLIP, *COSTS)
    return markdown(grouped(rows, "model", columns), columns)


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


TABLES = (
    Table("bench_fit_quick", "bench_fit.py --preset quick", fits, in_readme=True),
    Table("bench_fit_standard", "bench_fit.py --preset standard", fits),
    Table("bench_models", "bench_models.py", models),
    Table("throughput", "bench_throughput.py", throughput),
    Table("rgl_mitsuba", "check_rgl_against_mitsuba.py", rgl),
)


def content(table: Table) -> str:
    """The table in Markdown, or where its results are to come from."""
    path = RESULTS / f"{table.name}.json"
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
