"""The style of the public interface: documented, arguments in one order, defaults by keyword alone."""

from __future__ import annotations

import ast
import importlib
import re
from collections.abc import Iterator
from typing import NamedTuple

import pytest

import jaxbrdf
from tests.source import Module, assert_none, modules

# `key` first, then `params`, then `query`, then the random numbers `u`
ORDER = ("key", "params", "query", "u")
# as pyopencl has its wait_for, and as one would call it
POSITIONAL_DEFAULTS = {"enqueue", "source"}
MODULES = [module for module in modules() if not module.path.stem.startswith("_") or module.is_package]


class Public(NamedTuple):
    """A public function, where it stands, whether it is a method, and whether its first argument is the object."""

    place: str
    node: ast.FunctionDef | ast.AsyncFunctionDef
    method: bool
    bound: bool


def is_public(node: ast.AST) -> bool:
    named = isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef)
    return named and not node.name.startswith("_")


def public_classes(module: Module) -> list[ast.ClassDef]:
    return [node for node in module.tree.body if isinstance(node, ast.ClassDef) and is_public(node)]


def is_static(node: ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    return any(isinstance(d, ast.Name) and d.id == "staticmethod" for d in node.decorator_list)


def public_functions(module: Module) -> Iterator[Public]:
    """Functions at the top of the module and methods of its public classes."""
    bodies = [(module.tree.body, False), *((c.body, True) for c in public_classes(module))]
    for body, in_class in bodies:
        for node in body:
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and is_public(node):
                yield Public(
                    f"{module.path}:{node.lineno} {node.name}", node, in_class, in_class and not is_static(node)
                )


def positional(function: Public) -> list[str]:
    """Names of the arguments that may be given by position, without `self`."""
    arguments = [a.arg for a in function.node.args.posonlyargs + function.node.args.args]
    return arguments[1:] if function.bound else arguments


def documented(function: Public) -> set[str]:
    """Names in the section Args of the docstring; several may share a line."""
    section = re.search(r"^Args:\n(.*?)(?=^\S|\Z)", ast.get_docstring(function.node) or "", re.MULTILINE | re.DOTALL)
    heads = re.findall(r"^    (\w[\w, ]*):", section[1] if section else "", re.MULTILINE)
    return {name for head in heads for name in head.split(", ")}


def arguments(function: Public) -> list[ast.arg]:
    """All named arguments without `self`."""
    a = function.node.args
    return [*a.posonlyargs, *a.args, *a.kwonlyargs][function.bound :]


def in_order(names: list[str]) -> bool:
    """Whether key stands first and params, query and u follow in that order, whatever stands between them."""
    found = [name for name in names if name in ORDER]
    return found == sorted(found, key=ORDER.index) and ("key" not in names or names[0] == "key")


FUNCTIONS = [function for module in MODULES for function in public_functions(module)]


def test_every_module_class_and_function_has_a_docstring():
    nodes = [(str(m.path), m.tree) for m in MODULES]
    nodes += [(f"{m.path}:{c.lineno} {c.name}", c) for m in MODULES for c in public_classes(m)]
    # a method is documented where its class, or the protocol that the class fulfils, is
    nodes += [(f.place, f.node) for f in FUNCTIONS if not f.method]
    assert_none([place for place, node in nodes if not ast.get_docstring(node)])


def test_arguments_come_in_one_order():
    assert_none([f.place for f in FUNCTIONS if not in_order(positional(f))])


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (["params", "query", "u"], True),
        (["key", "count"], True),
        (["config", "params", "query"], True),
        (["config", "key"], False),
        (["query", "params"], False),
        (["u", "params"], False),
    ],
)
def test_the_order_check_sees_a_wrong_order(names: list[str], expected: bool):
    assert in_order(names) is expected


def test_defaults_are_keyword_only():
    found = [f for f in FUNCTIONS if f.node.args.defaults and f.node.name not in POSITIONAL_DEFAULTS]
    assert_none([f.place for f in found])


def test_every_argument_and_result_is_annotated():
    bare = [f for f in FUNCTIONS if f.node.returns is None or any(a.annotation is None for a in arguments(f))]
    assert_none([function.place for function in bare])


def test_documented_arguments_exist():
    unknown = [(f, documented(f) - {a.arg for a in arguments(f)}) for f in FUNCTIONS]
    assert_none([f"{f.place}: {sorted(names)}" for f, names in unknown if names])


def test_exported_names_exist():
    assert sorted(set(jaxbrdf.__all__)) == sorted(jaxbrdf.__all__)
    assert_none([name for name in jaxbrdf.__all__ if not hasattr(jaxbrdf, name)])


@pytest.mark.parametrize("name", [module.name for module in MODULES if module.is_package])
def test_a_package_exports_only_names_it_has(name: str):
    package = importlib.import_module(name)
    assert_none([n for n in getattr(package, "__all__", ()) if not hasattr(package, n)])
