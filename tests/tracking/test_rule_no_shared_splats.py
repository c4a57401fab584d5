"""The rule of the project: a picture given to the tracker is never rendered from the splats that
the tracker models the object with. Otherwise every error it reports would be meaningless."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
DRAWS_SPLATS = ("scenes.render", "scenes._native", "benchmarks.bake.bake")


def imports_of(file):
    """Every module that a source file imports, wherever in the file."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            found.add(node.module)
            found.update(f"{node.module}.{alias.name}" for alias in node.names)
    return found


def source_of(module):
    path = ROOT / Path(*module.split("."))
    for candidate in (path.with_suffix(".py"), path / "__init__.py"):
        if candidate.is_file():
            return candidate
    return None


def reachable(start):
    """All modules of this repository that a module imports, directly or through others."""
    seen, waiting = set(), [start]
    while waiting:
        module = waiting.pop()
        file = source_of(module)
        if module in seen or file is None:
            continue
        seen.add(module)
        waiting.extend(imports_of(file))
    return seen


def draws_splats(modules):
    return sorted(m for m in modules if m.startswith(DRAWS_SPLATS))


@pytest.mark.parametrize("module", ["sim.rehearsal", "sim.camera.camera360", "sim.camera.sensor"])
def test_simulated_frames_never_touch_a_splat_renderer(module):
    assert source_of(module) is not None, f"{module} has moved: this test must follow it"
    assert draws_splats(reachable(module)) == []


def test_the_simulated_session_takes_its_frames_from_the_mesh_camera():
    assert "sim.camera.camera360" in reachable("sim.rehearsal")


def test_the_tracker_never_sees_the_simulator_or_the_physical_meshes():
    for file in sorted((ROOT / "tracking").rglob("*.py")):
        modules = imports_of(file)
        peeks = [m for m in modules if m.startswith(("sim", "scenes.samples", "scenes.mesh"))]
        assert peeks == [], f"{file.name} imports {peeks}"


def test_pictures_in_the_tracker_tests_come_from_rays_not_from_splats():
    """In these tests a renderer may only be handed to the tracker, never used to make a frame."""
    for file in sorted(Path(__file__).parent.rglob("test_*.py")):
        tree = ast.parse(file.read_text(encoding="utf-8"))
        calls = [
            node
            for node in ast.walk(tree)
            if isinstance(node, ast.Call)
            and isinstance(node.func, ast.Attribute)
            and node.func.attr == "render"
        ]
        assert calls == [], f"{file.name} renders splats itself"


def test_the_ray_caster_of_the_tests_is_independent_of_the_renderers():
    conftest = ROOT / "tests" / "conftest.py"
    direct = imports_of(conftest)
    behind = set().union(*(reachable(m) for m in direct if source_of(m) is not None))
    assert draws_splats(direct | behind) == []


def test_the_tracker_never_reads_what_stands_for_the_real_room():
    """Of a scanned room a second reconstruction is drawn; a tracker that read it would cheat."""
    for file in sorted((ROOT / "tracking").rglob("*.py")):
        source = file.read_text(encoding="utf-8")
        assert "reality" not in imports_of(file), file.name
        assert not [m for m in imports_of(file) if m.endswith(".reality")], file.name
        assert ".reality" not in source, f"{file.name} reads a package's reality"


def test_only_the_simulator_and_the_preparation_read_it():
    allowed = {"scenes/package", "scenes/prepare", "sim/reality", "studio", "benchmarks"}
    readers = [
        file.relative_to(ROOT).as_posix()
        for floor in ("scenes", "devices", "sim", "tracking", "studio", "benchmarks")
        for file in sorted((ROOT / floor).rglob("*.py"))
        if any(m.startswith("scenes.package.reality") for m in imports_of(file))
    ]
    assert "sim/reality/parts.py" in readers
    assert [r for r in readers if not r.startswith(tuple(allowed))] == []
