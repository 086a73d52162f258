"""What a terminal shows of a result."""

from __future__ import annotations

from typing import Any

from jaxbrdf.report import text

ERRORS = {"mae": 0.125, "smape": 0.25, "rmse": 2.5, "log_rmse": 0.0625}
SPREADS = {f"{name}_standard_error": value / 100 for name, value in ERRORS.items()}
IMAGE = {"image_flip": 0.03125, "image_ssim": 0.96875}
FILES = {
    "bundle": "out/bundle.safetensors",
    "report": "out/bundle.report.json",
    "picture": "out/bundle.png",
    "residuals": "out/bundle.residuals.png",
}


def fit_result(**cost: float) -> dict[str, Any]:
    times = {"fit_seconds": 55.5, "compile_seconds": 7.25, "jax_ns_per_evaluation": 140.04}
    errors = ERRORS | SPREADS | IMAGE
    told = {"opencl_device": "a device (PoCL, 3.1)", "largest_albedo": [0.25, 0.75, 0.5]}
    return {"files": FILES, "errors": errors, "cost": times | cost, **told}


def test_a_fit_tells_its_errors_beside_their_cost_and_where_it_is():
    told = text.fit_report(fit_result(opencl_ns_per_evaluation=12.96))
    lines = {line.split(" ")[0]: line for line in told.splitlines()}
    assert lines["MAE"].split() == ["MAE", "0.125000", "+-", "0.001250"]
    assert lines["log-RMSE"].split() == ["log-RMSE", "0.062500", "+-", "0.000625"]
    assert "0.0312" in lines["FLIP"]
    assert "SSIM 0.9688" in lines["FLIP"]
    assert lines["albedo"].split() == ["albedo", "0.750", "at", "most"]
    assert "55.5 s, compilation 7.2 s" in lines["fitting"]
    assert "140.0 ns an evaluation" in lines["JAX"]
    assert "13.0 ns an evaluation on a device (PoCL, 3.1)" in lines["OpenCL"]
    assert [lines[name].split()[1] for name in FILES] == list(FILES.values())


def test_an_energy_scale_tells_what_the_errors_were_without():
    told = text.fit_report(fit_result() | {"without_energy_scale": {"mae": 0.5, "smape": 0.0625}})
    assert "albedo    0.750 at most; without the energy scale MAE 0.500000, SMAPE 0.062500" in told


def test_a_fit_without_opencl_tells_why():
    result = fit_result() | {"opencl_device": "no OpenCL device found: install a driver"}
    assert "OpenCL    no evaluation on no OpenCL device" not in text.fit_report(result)
    assert "OpenCL    no OpenCL device found: install a driver" in text.fit_report(result)


REJECTED = [
    {"candidate": "gated 32-32", "ns": 105.25, "error": None, "reason": "above 100 ns"},
    {"candidate": "nbrdf paper", "ns": 9.5, "error": 0.25, "reason": "smape above 0.1"},
]


def test_a_search_tells_what_it_took_and_what_it_did_not():
    told = text.fit_report(fit_result() | {"candidate": "gated 16-16", "rejected": REJECTED}).splitlines()
    plain = text.fit_report(fit_result()).splitlines()
    assert told[: len(plain)] == plain
    assert told[len(plain) :] == [
        "taken     gated 16-16",
        "rejected  gated 32-32    105.2 ns          -  above 100 ns",
        "rejected  nbrdf paper      9.5 ns   0.250000  smape above 0.1",
    ]
    alone = text.fit_report(fit_result() | {"candidate": "gated 16-16", "rejected": []}).splitlines()
    assert alone[-1] == "taken     gated 16-16"


def test_a_benchmark_names_rates_and_what_there_is_to_reach():
    told = text.bench(
        {
            "name": "gold",
            "model": "gated",
            "device": "a device (PoCL, 3.1)",
            "width": 16,
            "precision": "float16",
            "ns_per_evaluation": 40.0,
            "ns_spread": [38.04, 45.0],
            "evaluations_per_second": 2.5e7,
            "gflops": 25.0,
            "fma_ceiling_gflops": 100.0,
            "jax_evaluations_per_second": 3.25e6,
            "build_seconds": 1.5,
        }
    )
    lines = {line.split(" ")[0]: " ".join(line.split()[1:]) for line in told.splitlines()}
    assert lines == {
        "bundle": "gold, gated, texels in float16",
        "device": "a device (PoCL, 3.1), 16 queries a work item",
        "time": "40.0 ns an evaluation (from 38.0 to 45.0 over the rounds)",
        "rate": "25.00 million evaluations a second",
        "network": "25.0 GFLOP/s, 25% of the FMA ceiling of 100.0 GFLOP/s",
        "JAX": "3.25 million evaluations a second on this processor",
        "build": "1.50 s",
    }


def test_a_comparison_is_a_table():
    columns = {"bundle": ERRORS | IMAGE, "against": ERRORS | IMAGE, "ratio": dict.fromkeys(ERRORS, 1.0)}
    head, *rows = text.comparison(columns).splitlines()
    assert head.split() == ["bundle", "against", "ratio"]
    assert [row.split()[0] for row in rows] == ["MAE", "SMAPE", "RMSE", "log-RMSE", "FLIP", "SSIM"]
    assert rows[2].split()[1:] == ["2.500000", "2.500000", "1.000000"]
    assert len({row.index(row.split()[1]) + len(row.split()[1]) for row in rows}) == 1
    alone, *_ = text.comparison({"bundle": ERRORS | IMAGE}).splitlines()
    assert alone.split() == ["bundle"]


def test_fields_are_indented_below_their_name():
    assert text.fields({"kind": "bundle", "cost": {"seconds": 3}}).splitlines() == [
        "kind             bundle",
        "cost",
        "  seconds          3",
    ]
