"""The four homogeneous models at their paper's sizes, for the same time each, on four measured files.

    python experiments/bench_models.py       # 16 fits of a minute, and half a minute of judging after each

Like Timonen et al., Table 4, with errors as ratios to the published networks and the seconds beside them. Rows go to
experiments/results/bench_models.json as they come; those that are there are not measured again unless --again is given.
"""

from __future__ import annotations

import argparse
import json
import os
from pathlib import Path

from bench_fit import RESULTS, measure

MODELS = ("naive-mlp", "nbrdf", "tripleplane", "gated")
MATERIALS = ("cc_green_malachite", "cc_iris_purple_gem", "cg_sunflower", "chm_light_blue")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=60.0, help="of fitting, for each")
    parser.add_argument("--again", action="store_true", help="measure rows that are there already")
    arguments = parser.parse_args()
    data, path = Path(os.environ["JAXBRDF_DATA"]), RESULTS / "bench_models.json"
    rows = json.loads(path.read_text()) if path.exists() and not arguments.again else []
    done = {(row["model"], row["material"]) for row in rows}
    for material in MATERIALS:
        for model in MODELS:
            if (model, material) in done:
                continue
            options = ["--model", model, "--paper-sizes", "--budget-seconds", str(arguments.seconds)]
            rows.append({"model": model} | measure(data, material, "standard", options))
            path.write_text(json.dumps(rows, indent=1) + "\n")
            shown = {name: round(rows[-1][f"{name}_ratio"], 3) for name in ("mae", "smape", "rmse")}
            print(model, material, shown, f"{rows[-1]['fit_seconds']:.0f} s", flush=True)


if __name__ == "__main__":
    main()
