"""The package's shape: import layers, no hidden imports, no pickle, no device at import, small files and functions."""

from __future__ import annotations

import ast
import graphlib
import os
import statistics
import subprocess
import sys
from pathlib import Path

import pytest

from tests.source import ROOT, Module, assert_none, code_lines, functions, imports, inner_imports, modules, parse_module

# A line imports only from the lines above it; names on one line do not import each other.
LAYERS = (
    ("errors", "types"),
    ("core",),
    ("data", "metrics", "sampling"),
    ("brdf", "texture"),
    ("surface", "models"),
    ("fit", "render"),
    ("export",),
    ("opencl",),
    ("checks", "report"),
    ("jobs",),
    ("commands",),
    ("cli",),
    ("__main__",),
)
LEVEL = {name: level for level, line in enumerate(LAYERS) for name in line}
CODE_LOADERS = {"pickle", "cPickle", "dill", "cloudpickle", "joblib", "shelve", "marshal"}
MODULES = modules()
NAMES = {module.name for module in MODULES}

NO_DEVICE = """
import importlib, sys
import pyopencl

def refuse(*_, **__):
    raise AssertionError("OpenCL was touched by an import")

pyopencl.get_platforms = pyopencl.create_some_context = pyopencl.Context = pyopencl.CommandQueue = refuse
for name in sys.argv[1:]:
    importlib.import_module(name)
"""


def layer_of(name: str) -> str:
    """`core` of `jaxbrdf.core.numerics`; empty for the package itself."""
    return name.split(".")[1] if "." in name else ""


def layer_faults(module: Module) -> list[str]:
    """The imports of a module that do not run down the layers, each as file:line and what it imports."""
    here = layer_of(module.name)
    if not here:
        return []
    found = [(i, layer_of(i.target)) for i in imports(module) if i.target.split(".")[0] == "jaxbrdf"]
    wrong = [i for i, there in found if there != here and LEVEL.get(there, len(LAYERS)) >= LEVEL[here]]
    return [f"{module.path}:{i.line}: {here} imports {i.target}" for i in wrong]


def module_of(target: str) -> str:
    """The module that an imported name lives in: the name itself, or what precedes its last dot."""
    return target if target in NAMES else target.rpartition(".")[0]


def is_false(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and node.value is False


def percentile_90(values: list[int]) -> int:
    return sorted(values)[int(0.9 * len(values))]


def test_every_module_has_a_layer():
    assert {layer_of(name) for name in NAMES} - {""} <= set(LEVEL)


def test_imports_run_one_way():
    assert_none([fault for module in MODULES for fault in layer_faults(module)])


def test_no_import_inside_a_function():
    assert_none([f"{module.path}:{line}" for module in MODULES for line in inner_imports(module)])


def test_no_import_cycle_between_files():
    graph = {m.name: {module_of(i.target) for i in imports(m)} & NAMES - {m.name} for m in MODULES}
    assert len(list(graphlib.TopologicalSorter(graph).static_order())) == len(NAMES)


@pytest.mark.parametrize(
    ("file", "line", "fault"),
    [
        ("core/a.py", "from jaxbrdf.brdf.ggx import eval", "core imports jaxbrdf.brdf.ggx.eval"),
        ("data/a.py", "import jaxbrdf.metrics", "data imports jaxbrdf.metrics"),
        ("data/a.py", "from ..sampling import warps", "data imports jaxbrdf.sampling.warps"),
        ("fit/a.py", "from jaxbrdf import Model", "fit imports jaxbrdf.Model"),
        ("types.py", "from jaxbrdf.errors import DataError", "types imports jaxbrdf.errors.DataError"),
        ("brdf/a.py", "if TYPE_CHECKING:\n    from jaxbrdf.unheard import of", "brdf imports jaxbrdf.unheard.of"),
    ],
)
def test_the_layer_check_sees_a_wrong_import(tmp_path: Path, file: str, line: str, fault: str):
    path = tmp_path / "jaxbrdf" / file
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(line)
    assert [f.split(": ", 1)[1] for f in layer_faults(parse_module(tmp_path, path))] == [fault]


def test_nothing_runs_code_from_a_file():
    loaders = [f"{m.path}:{i.line}" for m in MODULES for i in imports(m) if i.target.split(".")[0] in CODE_LOADERS]
    keywords = [(m.path, n) for m in MODULES for n in ast.walk(m.tree) if isinstance(n, ast.keyword)]
    allowed = [f"{path}:{k.lineno}" for path, k in keywords if k.arg == "allow_pickle" and not is_false(k.value)]
    assert_none(loaders + allowed)


@pytest.mark.parametrize("names", [["jaxbrdf"], sorted(NAMES - {"jaxbrdf.__main__"})], ids=["package", "every module"])
def test_importing_touches_no_device_and_warns_of_nothing(names: list[str]):
    # a platform that does not exist: any use of a jax backend raises
    environment = os.environ | {"JAX_PLATFORMS": "none-such", "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-W", "error", "-c", NO_DEVICE, *names]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr


def test_files_and_functions_stay_small():
    files = [module.text.count("\n") for module in MODULES if not module.is_package]
    lengths = [code_lines(function) for module in MODULES for function in functions(module)]
    assert statistics.median(files) <= 150
    assert statistics.mean(lengths) <= 12
    assert percentile_90(lengths) <= 30


def test_every_kernel_model_has_its_python():
    kernels = {path.stem for path in (ROOT / "kernels_cl" / "models").glob("*.cl")}
    assert kernels <= {module.path.stem for module in MODULES if layer_of(module.name) == "models"}


def test_every_layer_has_its_page():
    packages = {layer_of(module.name) for module in MODULES if module.name.count(".") == 1 and module.is_package}
    assert packages == {path.stem for path in (ROOT / "docs" / "api").glob("*.md")} - {"index"}
