"""The package's own source as data, for the tests that judge its shape."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "jaxbrdf"
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)


class Module(NamedTuple):
    """One file of the package: its dotted name, whether it is a package's __init__, its path, text and syntax tree."""

    name: str
    is_package: bool
    path: Path
    text: str
    tree: ast.Module


class Import(NamedTuple):
    """One imported dotted name and the line that imports it."""

    target: str
    line: int


def modules(package: Path = PACKAGE) -> list[Module]:
    """Every module below `package`, in path order."""
    return [parse_module(package.parent, path) for path in sorted(package.rglob("*.py"))]


def parse_module(root: Path, path: Path) -> Module:
    """The module that `path` holds, named as seen from `root`."""
    parts = path.relative_to(root).with_suffix("").parts
    is_package = parts[-1] == "__init__"
    text = path.read_text()
    return Module(".".join(parts[:-1] if is_package else parts), is_package, path, text, ast.parse(text))


def imports(module: Module) -> Iterator[Import]:
    """Every import of a module, relative ones made absolute; `from a import b` counts as a.b."""
    for node in ast.walk(module.tree):
        if isinstance(node, ast.Import):
            yield from (Import(alias.name, node.lineno) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = import_base(module, node)
            yield from (Import(f"{base}.{alias.name}", node.lineno) for alias in node.names)


def import_base(module: Module, node: ast.ImportFrom) -> str:
    """The absolute dotted name before `import` in a from-import."""
    if not node.level:
        return node.module or ""
    parts = module.name.split(".")
    here = parts if module.is_package else parts[:-1]
    up = here[: len(here) - node.level + 1]
    return ".".join([*up, node.module] if node.module else up)


def inner_imports(module: Module) -> list[int]:
    """Lines of imports inside functions."""
    inner = [n for f in functions(module) for n in ast.walk(f) if isinstance(n, ast.Import | ast.ImportFrom)]
    return sorted({node.lineno for node in inner})


def functions(module: Module) -> list[ast.FunctionDef | ast.AsyncFunctionDef]:
    """Every function of a module, nested ones and methods too."""
    return [node for node in ast.walk(module.tree) if isinstance(node, FUNCTIONS)]


def code_lines(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Lines from `def` to the end, without the docstring."""
    total = (function.end_lineno or function.lineno) - function.lineno + 1
    if ast.get_docstring(function) is None:
        return total
    docstring = function.body[0]
    return total - ((docstring.end_lineno or docstring.lineno) - docstring.lineno + 1)


def assert_none(faults: list[str]) -> None:
    """Fails with every fault on a line of its own."""
    assert not faults, "\n" + "\n".join(faults)
