"""What a user gets from the wheel: run by tests/wheel/run, outside the checkout, with run-time dependencies alone."""

from __future__ import annotations

import importlib.metadata
import importlib.resources
import importlib.util
import pkgutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import pyopencl
import pytest

import jaxbrdf

SITE = Path(sysconfig.get_path("purelib"))
COMMAND = Path(sys.executable).with_name("jaxbrdf")


def run(*command: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)


def test_package_comes_from_the_wheel():
    assert Path(jaxbrdf.__file__).is_relative_to(SITE)
    assert importlib.metadata.version("jaxbrdf") == jaxbrdf.__version__


def test_types_and_licence_are_shipped():
    assert (SITE / "jaxbrdf" / "py.typed").exists()
    assert "Apache License" in (importlib.metadata.distribution("jaxbrdf").read_text("licenses/LICENSE") or "")


def test_tests_and_docs_are_not_shipped():
    tops = {name.split("/")[0] for name in map(str, importlib.metadata.files("jaxbrdf") or [])}
    assert {top for top in tops if not top.endswith(".dist-info") and top != ".."} == {"jaxbrdf", "kernels_cl"}


@pytest.mark.parametrize("folder", ["include", "models"])
def test_kernels_are_found_as_package_data(folder: str):
    files = importlib.resources.files("kernels_cl").joinpath(folder).iterdir()
    sources = [file for file in files if file.name.endswith((".cl", ".h"))]
    assert sources
    assert all(source.read_text().strip() for source in sources)


def test_every_module_imports_with_run_time_dependencies_alone():
    assert importlib.util.find_spec("mitsuba") is None
    names = [m.name for m in pkgutil.walk_packages(jaxbrdf.__path__, "jaxbrdf.") if not m.name.endswith("__main__")]
    code = "import importlib, sys\nfor name in sys.argv[1:]: importlib.import_module(name)"
    done = run(sys.executable, "-c", code, *names)
    assert done.returncode == 0, done.stderr


def test_help_names_the_commands():
    done = run(COMMAND, "--help")
    assert done.returncode == 0
    assert all(command in done.stdout for command in ("fit", "eval", "compare", "render", "info", "convert"))


def test_info_of_a_built_in_material():
    done = run(COMMAND, "info", "gold")
    assert done.returncode == 0, done.stderr
    assert "gold" in done.stdout


def test_a_mistake_is_one_line_and_exit_code_2():
    done = run(COMMAND, "info", "no-such-file.bsdf")
    assert done.returncode == 2
    assert len(done.stderr.strip().splitlines()) == 1
    assert "no-such-file.bsdf" in done.stderr


def test_an_opencl_platform_is_there():
    assert pyopencl.get_platforms()
