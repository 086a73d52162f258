"""What a terminal shows of a result."""

from __future__ import annotations

from typing import Any

from jaxbrdf.report import text

ERRORS = {"mae": 0.125, "smape": 0.25, "rmse": 2.5, "log_rmse": 0.0625}
SPREADS = {f"{name}_standard_error": value / 100 for name, value in ERRORS.items()}
IMAGE = {"image_flip": 0.03125, "image_ssim": 0.96875}
FILES = {"bundle": "out/bundle.safetensors", "report": "out/bundle.report.json", "picture": "out/bundle.png"}


def fit_result(**cost: float) -> dict[str, Any]:
    times = {"fit_seconds": 55.5, "compile_seconds": 7.25, "jax_ns_per_evaluation": 140.04}
    errors = ERRORS | SPREADS | IMAGE
    return {"files": FILES, "errors": errors, "cost": times | cost, "opencl_device": "a device (PoCL, 3.1)"}


def test_a_fit_tells_its_errors_beside_their_cost_and_where_it_is():
    told = text.fit_report(fit_result(opencl_ns_per_evaluation=12.96))
    lines = {line.split(" ")[0]: line for line in told.splitlines()}
    assert lines["MAE"].split() == ["MAE", "0.125000", "+-", "0.001250"]
    assert lines["log-RMSE"].split() == ["log-RMSE", "0.062500", "+-", "0.000625"]
    assert "0.0312" in lines["FLIP"]
    assert "SSIM 0.9688" in lines["FLIP"]
    assert "55.5 s, compilation 7.2 s" in lines["fitting"]
    assert "140.0 ns an evaluation" in lines["JAX"]
    assert "13.0 ns an evaluation on a device (PoCL, 3.1)" in lines["OpenCL"]
    assert [lines[name].split()[1] for name in FILES] == list(FILES.values())


def test_a_fit_without_opencl_tells_why():
    result = fit_result() | {"opencl_device": "no OpenCL device found: install a driver"}
    assert "OpenCL    no evaluation on no OpenCL device" not in text.fit_report(result)
    assert "OpenCL    no OpenCL device found: install a driver" in text.fit_report(result)


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
