"""Writes docs/rooms.md: every folder of the product with the first sentence of its docstring.

`python -m tests.rooms` writes it; test_architecture_page.py holds it to the docstrings.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "rooms.md"
FLOORS = ("scenes", "native/src", "devices", "sim", "tracking", "studio", "benchmarks")
HEAD = """# Rooms

Every folder of the product, lowest floor first, with the first sentence of its docstring; the
docstring says the rest, file by file. [The house](architecture.md) says how they hang together.
Written by `python -m tests.rooms`.
"""


def rooms() -> Iterator[tuple[str, str]]:
    """Each folder with code, and the first sentence about it."""
    for floor in FLOORS:
        top = ROOT / floor
        for folder in sorted((top, *(p for p in top.rglob("*") if p.is_dir()))):
            name = folder.relative_to(ROOT).as_posix()
            python, rust = folder / "__init__.py", folder / "mod.rs"
            if python.is_file():
                said = ast.get_docstring(ast.parse(python.read_text(encoding="utf-8"))) or ""
            elif rust.is_file() or name == "native/src":
                source = rust if rust.is_file() else folder / "lib.rs"
                head = re.match(r"(?://! ?.*\n)+", source.read_text(encoding="utf-8"))
                said = re.sub(r"^//! ?", "", head[0] if head else "", flags=re.M)
            else:
                continue
            yield name, first_sentence(said)


def first_sentence(text: str) -> str:
    """Up to the first full stop that ends a sentence, on one line."""
    paragraph = " ".join(text.split("\n\n")[0].split())
    return re.split(r"(?<=\.)\s+(?=[A-Z`])", paragraph, maxsplit=1)[0]


def page() -> str:
    """The whole page."""
    lines = [HEAD]
    floor = ""
    for name, said in rooms():
        if not (name == floor or name.startswith(f"{floor}/")) or not floor:
            floor = next(f for f in FLOORS if name == f or name.startswith(f"{f}/"))
            lines += [f"\n## `{floor}/`\n", "| room | |", "|---|---|"]
        lines.append(f"| `{name}/` | {said} |")
    return "\n".join(lines).replace("\n\n\n", "\n\n") + "\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
