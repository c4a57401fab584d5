"""Every module of the tracker that decides anything is imported by a test."""

from __future__ import annotations

import ast
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
ROOM = "tracking"
UNTESTED: frozenset[str] = frozenset()
"""Modules with a function and no test that imports them. This list only shrinks."""


def modules():
    """Modules of the tracker that hold a function, by name."""
    found = {}
    for file in sorted((ROOT / ROOM).rglob("*.py")):
        tree = ast.parse(file.read_text(encoding="utf-8"))
        if any(isinstance(node, ast.FunctionDef) for node in ast.walk(tree)):
            found[".".join(file.relative_to(ROOT).with_suffix("").parts)] = file
    return found


def imported_by_tests():
    """Every module that a file under tests/ imports, wherever in the file."""
    found = set()
    for file in (ROOT / "tests").rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                found.update(alias.name for alias in node.names)
            elif isinstance(node, ast.ImportFrom) and node.module:
                found.add(node.module)
                found.update(f"{node.module}.{alias.name}" for alias in node.names)
    return found


def test_every_module_with_a_function_is_imported_by_a_test():
    missing = set(modules()) - imported_by_tests() - UNTESTED
    assert not missing, f"no test imports {sorted(missing)}: write one"


def test_the_list_of_exceptions_only_shrinks():
    tested_now = UNTESTED & imported_by_tests()
    assert not tested_now, f"take {sorted(tested_now)} off the list: tests import them"
    gone = UNTESTED - set(modules())
    assert not gone, f"take {sorted(gone)} off the list: there are no such modules"
