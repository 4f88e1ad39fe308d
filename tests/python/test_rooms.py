"""The packages of the library: imports have one direction and no cycles."""

from __future__ import annotations

import ast
import subprocess
import sys
from graphlib import TopologicalSorter
from pathlib import Path
from types import ModuleType

import pytest

import lostmotion

PACKAGE = Path(lostmotion.__file__).parent

FLOORS = (
    "recordings",
    "drives",
    "model",
    "characterize",
    "effects",
    "fit",
    "evidence",
    "candidates",
    "discover",
    "compare",
    "controller",
    "export",
    "report",
    "drawing",
    "replay",
    "simulators",
    "design",
    "demo",
    "workbench",
    "commands",
)
"""Packages in order: each imports only from those before it."""

GROUND = (
    "arrays",
    "torsion_curve",
    "catalogue",
    "condition_cards",
    "content_key",
    "core",
    "errors",
    "files",
    "first_use",
    "friction",
    "keys",
    "rms",
    "rules",
    "shipped",
    "structs",
    "threads",
)
"""Basic modules, which import no package."""


EXTENSIONS = {"_core32", "_core64", "_search"}
"""Modules written in C."""


def modules() -> dict[str, Path]:
    """Every module of the package by its name."""
    found = {}
    for file in PACKAGE.rglob("*.py"):
        parts = ["lostmotion", *file.relative_to(PACKAGE).with_suffix("").parts]
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = file
    return found


def without_type_checking(tree: ast.Module) -> ast.Module:
    """Leave out imports for type checkers."""
    tree.body = [
        node
        for node in tree.body
        if not (isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING")
    ]
    return tree


def imports() -> dict[str, set[str]]:
    """Imports of each module from the package, including those within functions."""
    known = modules()
    found: dict[str, set[str]] = {}
    for name, file in known.items():
        needed: set[str] = set()
        for node in ast.walk(without_type_checking(ast.parse(file.read_text()))):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("lostmotion"):
                parts = [f"{node.module}.{alias.name}" for alias in node.names]
                needed |= {part if part in known else str(node.module) for part in parts}
            elif isinstance(node, ast.Import):
                needed |= {a.name for a in node.names if a.name.startswith("lostmotion")}
        found[name] = needed - {name}
    return found


def test_no_circle_of_imports() -> None:
    needed = imports()
    assert len(needed) > 100
    TopologicalSorter(needed).prepare()  # raises CycleError


def test_no_import_upward() -> None:
    height = {room: number for number, room in enumerate(FLOORS)} | dict.fromkeys(GROUND, -1)
    needed = imports()
    assert {room_of(name) for name in needed} >= height.keys()
    upward = [
        (name, other)
        for name in needed
        for other in needed[name]
        if room_of(name) in height
        and room_of(other) in FLOORS
        and room_of(name) != room_of(other)
        and height[room_of(name)] <= height[room_of(other)]
    ]
    assert upward == []


def test_evidence_imports_no_model() -> None:
    needed = imports()
    own = {name: parts for name, parts in needed.items() if room_of(name) == "evidence"}
    assert own
    for parts in own.values():
        basic = {"arrays", "errors", "files", "rms", "rules", "threads"}
        assert {room_of(part) for part in parts} <= {"evidence", *basic}


def public_names(file: Path) -> set[str]:
    """Public classes and functions of a module."""
    kinds = (ast.ClassDef, ast.FunctionDef)
    body = ast.parse(file.read_text()).body
    return {node.name for node in body if isinstance(node, kinds) and node.name[0] != "_"}


def test_a_name_has_one_meaning() -> None:
    defined: dict[str, list[str]] = {}
    for module, file in modules().items():
        for name in public_names(file):
            defined.setdefault(name, []).append(module)
    assert len(defined) > 1000
    twice = {name: sorted(where) for name, where in defined.items() if len(where) > 1}
    assert twice == {}


def test_tests_import_public_names_alone() -> None:
    private = [
        f"{file.name}: {alias.name}"
        for file in Path(__file__).parents[1].rglob("*.py")
        for node in ast.walk(ast.parse(file.read_text()))
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("lostmotion")
        for alias in node.names
        if alias.name[0] == "_" != alias.name[1] and alias.name not in EXTENSIONS
    ]
    assert private == []


def room_of(module: str) -> str:
    """Package of a module, or the module itself if it is in none."""
    return module.split(".")[1] if "." in module else module


@pytest.mark.parametrize("package", [lostmotion, lostmotion.recordings, lostmotion.report])
def test_each_name_loads_in_a_process_that_has_loaded_nothing(package: ModuleType) -> None:
    for name in package.__all__:
        if name[0].islower():
            program = f"import {package.__name__} as package; assert callable(package.{name})"
            ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
            assert ran.returncode == 0, ran.stderr
