"""Every module of the product is there for a verb, a window or a documented way to use it.

What only tests and benchmarks use belongs to `tests/` or `benchmarks/`.
"""

from __future__ import annotations

import ast
import re
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PRODUCT = ("scenes", "devices", "sim", "tracking", "studio")
PAGES = ("README.md", "CONTRIBUTING.md", "docs/**/*.md")
ROOTS = {
    "studio.cli": "`nexus`; its table names the modules of the verbs",
    "studio.app.window": "the desktop window; its docks are named as module:Class",
}
"""Modules that begin something, and what. Scripts of `examples/` and pages' code do, too."""

MODULE = re.compile(r"[a-z_][a-z_0-9]*(?:\.[a-z_][a-z_0-9]*)+")
NAMED = re.compile(rf"({MODULE.pattern})(?::\w+)?")
"""A string that is a module's name, or module:Class."""

RUN = re.compile(rf"\bfrom ({MODULE.pattern}) import \w+;")
"""Code of a child process in a string."""

FENCE = re.compile(r"^```(?:python|sh)\n(.*?)^```", re.MULTILINE | re.DOTALL)


def modules(root: Path = ROOT) -> dict[str, Path]:
    """Files of the product's modules, by name; a package's is its `__init__.py`."""
    return {
        ".".join(file.relative_to(root).with_suffix("").parts).removesuffix(".__init__"): file
        for package in PRODUCT
        for file in sorted((root / package).rglob("*.py"))
    }


def imported(tree: ast.AST) -> set[str]:
    """Names that imports anywhere in a tree may make modules of."""
    names: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return names


def named(tree: ast.AST) -> set[str]:
    """Modules that strings name: of verbs and docks, after `-m`, in a child process's code."""
    names: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            found = NAMED.fullmatch(node.value)
            names |= {found[1]} if found else set(RUN.findall(node.value))
    return names


@cache
def uses(file: Path) -> set[str]:
    """Names that a file imports or that its strings give; some of them are modules."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    return imported(tree) | named(tree)


@cache
def documented() -> frozenset[str]:
    """Modules that examples and the code on pages import, or run with `python -m`."""
    names: set[str] = set()
    for script in (ROOT / "examples").rglob("*.py"):
        names |= imported(ast.parse(script.read_text(encoding="utf-8")))
    for page in (page for pattern in PAGES for page in ROOT.glob(pattern)):
        for code in FENCE.findall(page.read_text(encoding="utf-8")):
            names |= set(re.findall(rf"^\s*(?:from|import) ({MODULE.pattern})", code, re.MULTILINE))
            names |= set(re.findall(rf"-m ({MODULE.pattern})", code))
    return frozenset(names)


def reachable(begin: set[str], among: dict[str, Path]) -> set[str]:
    """Modules that can be imported from others of `among`, those and their packages included."""
    seen: set[str] = set()
    ahead = sorted(begin & among.keys())
    while ahead:
        module = ahead.pop()
        if module in seen:
            continue
        seen.add(module)
        package = module.rpartition(".")[0]
        ahead += [name for name in (uses(among[module]) | {package}) if name in among]
    return seen


def unreached(among: dict[str, Path]) -> list[str]:
    return sorted(among.keys() - reachable({*ROOTS, *documented()}, among))


def test_every_module_is_reached_from_a_verb_a_window_or_a_page():
    lost = unreached(modules())
    assert not lost, (
        f"no verb, window, example or page reaches {', '.join(lost)}: "
        "delete it, or move it to benchmarks/ or tests/"
    )


def test_a_module_that_nobody_imports_is_found(tmp_path):
    (tmp_path / "lonely.py").write_text("from scenes import pose\n", encoding="utf-8")
    among = {**modules(), "scenes.lonely": tmp_path / "lonely.py"}
    assert unreached(among) == ["scenes.lonely"]


def test_every_root_is_there():
    assert ROOTS.keys() <= modules().keys()


@pytest.mark.parametrize(
    ("line", "names"),
    [
        ("from scenes import pose", {"scenes", "scenes.pose"}),
        ("def f():\n    import scenes.pose", {"scenes.pose"}),
        ("'studio.app.twin.dock:TwinDock'", {"studio.app.twin.dock"}),
        ("f'import sys; {0}; from a.pull.process import main; main()'", {"a.pull.process"}),
        ("[sys.executable, '-m', 'studio.sweep.child']", {"studio.sweep.child"}),
        ("'Reads scenes.pose of a file.'", set()),
    ],
)
def test_what_counts_as_reaching(line, names):
    tree = ast.parse(line)
    assert imported(tree) | named(tree) == names
