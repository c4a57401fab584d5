"""Laws of the house that no linter knows, counted; the lists of what breaks one only shrink.

`pytest tests/test_house.py -s` prints the figures.
"""

import ast
import re
import tomllib
from collections import Counter
from functools import lru_cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
FLOORS = ("scenes", "devices", "sim", "tracking", "studio", "benchmarks")
LISTED = tomllib.loads((Path(__file__).with_name("house_exceptions.toml")).read_text("utf-8"))
"""Names that break a law today, or a number of them a floor, by law."""

MAX_FILE_LINES = 400
MAX_FUNCTION_LINES = 60
MAX_FOLDER_FILES = 16
MAX_PAGE_LINES = 160
MAX_POSITIONAL = 2
A_FILE_EACH = ("scenes/formats", "scenes/samples")
"""Folders of a file a format or room: those may be larger."""

RIDDLE = re.compile(r"(What|Where|Which|Who|Whose)\b")
"""How no docstring begins: its first line says what something returns or does."""

WORKERS = "scenes/workers"
HAND_MADE = {"Thread", "Popen", "Process"}
"""Calls that begin a thread or a process; a pool of the standard library ends with its block."""


@lru_cache
def sources():
    """Path and syntax tree of every file of the product, by name."""
    return {
        path.relative_to(ROOT).as_posix(): ast.parse(path.read_text(encoding="utf-8"))
        for floor in FLOORS
        for path in sorted((ROOT / floor).rglob("*.py"))
    }


def lines_of(name):
    return len((ROOT / name).read_text(encoding="utf-8").splitlines())


def nodes(*kinds):
    for name, tree in sources().items():
        for node in ast.walk(tree):
            if isinstance(node, kinds):
                yield name, node


FUNCTION = (ast.FunctionDef, ast.AsyncFunctionDef)


def hold(law, found):
    """Names that break a law are those on its list."""
    listed, found = set(LISTED[law]), set(found)
    print(f"{law}: {len(found)}")
    assert found <= listed, f"{law}: {sorted(found - listed)}"
    assert listed <= found, f"take off the list {law}, they keep it: {sorted(listed - found)}"


def hold_number(law, found):
    """So many break a law on each floor as its list says."""
    by_floor = {floor: found.get(floor, 0) for floor in FLOORS}
    print(f"{law}: {by_floor}")
    listed = LISTED[law]
    more = {f: n for f, n in by_floor.items() if n > listed.get(f, 0)}
    assert not more, f"{law}: {more}, at most {listed}"
    fewer = {f: n for f, n in by_floor.items() if n < listed.get(f, 0)}
    assert not fewer, f"write the smaller numbers down, {law}: {fewer}"


def test_a_file_has_at_most_400_lines():
    rust = [p.relative_to(ROOT).as_posix() for p in (ROOT / "native").rglob("src/**/*.rs")]
    hold("long_files", [n for n in (*sources(), *rust) if lines_of(n) > MAX_FILE_LINES])


def test_a_function_has_at_most_60_lines():
    hold(
        "long_functions",
        [
            f"{name}:{node.name}"
            for name, node in nodes(*FUNCTION)
            if node.end_lineno - node.lineno + 1 > MAX_FUNCTION_LINES
        ],
    )


def test_a_folder_has_at_most_16_files():
    sizes = Counter(
        name.rpartition("/")[0] for name in sources() if not name.endswith("__init__.py")
    )
    hold(
        "large_folders",
        [f for f, n in sizes.items() if n > MAX_FOLDER_FILES and f not in A_FILE_EACH],
    )


def test_no_docstring_begins_as_a_riddle():
    found = Counter(
        name.partition("/")[0]
        for name, node in nodes(*FUNCTION, ast.ClassDef, ast.Module)
        if RIDDLE.match(ast.get_docstring(node) or "")
    )
    hold_number("riddles", found)


def test_limits_are_named_min_and_max():
    found = Counter(
        name.partition("/")[0]
        for name, node in nodes(ast.Name)
        if isinstance(node.ctx, ast.Store) and re.search(r"(^|_)(LEAST|MOST)(_|$)", node.id)
    )
    hold_number("limits_by_another_name", found)


def test_threads_and_processes_are_workers():
    found = []
    for name, node in nodes(ast.Call):
        called = node.func.attr if isinstance(node.func, ast.Attribute) else None
        called = node.func.id if isinstance(node.func, ast.Name) else called
        if called in HAND_MADE and not name.startswith(WORKERS):
            found.append(name)
    hold("hand_made_workers", found)


def test_no_more_than_two_arguments_by_place():
    found = Counter()
    for name, node in nodes(*FUNCTION):
        args = [a.arg for a in (*node.args.posonlyargs, *node.args.args)]
        count = len(args) - (args[:1] in (["self"], ["cls"]))
        found[name.partition("/")[0]] += count > MAX_POSITIONAL
    hold_number("many_by_place", found)


def test_constants_say_what_they_are():
    found = Counter()
    for name, tree in sources().items():
        body = tree.body
        for at, node in enumerate(body):
            targets = node.targets if isinstance(node, ast.Assign) else []
            is_constant = any(
                isinstance(t, ast.Name) and re.fullmatch(r"_?[A-Z][A-Z0-9_]+", t.id)
                for t in targets
            )
            after = body[at + 1] if at + 1 < len(body) else None
            is_said = isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
            found[name.partition("/")[0]] += is_constant and not is_said
    hold_number("unsaid_constants", found)


def test_the_page_of_the_house_is_short():
    page = ROOT / "docs" / "architecture.md"
    assert len(page.read_text(encoding="utf-8").splitlines()) <= MAX_PAGE_LINES


@pytest.mark.parametrize("law", sorted(LISTED))
def test_every_list_is_of_a_law(law):
    laws = re.findall(r'hold(?:_number)?\(\s*"(\w+)"', Path(__file__).read_text(encoding="utf-8"))
    assert law in laws
