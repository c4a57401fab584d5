"""Builds the documentation: the pages in `docs/` and the API reference, with warnings as errors.

    ./nexus docs                      everything, into out/docs
    python docs/api/build.py OUT --only scenes.pose scenes.cameras    all pages, a part of the API

The API is read from the imported modules by pdoc. Pages are Markdown; a link in them that leads
nowhere is an error.
"""

from __future__ import annotations
import __future__

import argparse
import ast
import html
import re
import shutil
import sys
import types
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

import pdoc
import pdoc.render
from jinja2 import Template
from markdown_it import MarkdownIt
from markdown_it.token import Token
from mdit_py_plugins.anchors import anchors_plugin
from pygments import highlight
from pygments.formatters import HtmlFormatter
from pygments.lexers import get_lexer_by_name
from pygments.util import ClassNotFound

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("scenes", "devices", "sim", "tracking", "studio", "benchmarks")
EXAMPLES = "examples"
FIRST_PAGES = ("README.md", "docs/architecture.md", "docs/conventions.md", "docs/glossary.md")
LAST_PAGES = ("CONTRIBUTING.md", "CHANGELOG.md")

ACCEPTED = (
    # An alias with a quoted name: `typing` looks it up where the alias is used, not where it is.
    "Import of Preview failed: name 'Preview' is not defined",
)
"""Warnings that are no faults of the documentation. This list only shrinks."""


class DocsError(Exception):
    """What is wrong with the documentation, one line each."""


@dataclass(frozen=True, slots=True)
class Page:
    """One page.

    Attributes:
        source: its file in the repository; of the page of examples, their folder.
        name: of its file in the output.
        title: in the list of pages.
        text: Markdown.
    """

    source: Path
    name: str
    title: str
    text: str


def main(arguments: Sequence[str] | None = None) -> int:
    """Build; 1 and a line for each fault if there is any."""
    parser = argparse.ArgumentParser(description="Build the documentation.")
    parser.add_argument("out", type=Path, help="folder; what is in it is replaced")
    parser.add_argument("--only", nargs="+", metavar="MODULE", help="of the API; default: all")
    args = parser.parse_args(arguments)
    try:
        build(args.out, args.only or PACKAGES)
    except DocsError as error:
        sys.stderr.write(f"{error}\n")
        return 1
    return 0


def build(out: Path, modules: Sequence[str]) -> None:
    """Write all pages and the API of some modules.

    Raises:
        DocsError: a link leads nowhere, or the reference is not without a warning.
    """
    if out.exists() and any(out.iterdir()) and not (out / "api").is_dir():
        raise DocsError(f"{out}: not empty and not made by this; wanted a folder of its own")
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    faults = [*build_api(out / "api", modules), *build_pages(out)]
    if faults:
        raise DocsError("\n".join(faults))


# --- the API reference ----------------------------------------------------------------------------


def build_api(out: Path, modules: Sequence[str]) -> list[str]:
    """The reference, and what pdoc had to say about it."""
    if str(ROOT) not in sys.path:
        sys.path.insert(0, str(ROOT))
    stand_in_for_native_module()
    pdoc.render.configure(docformat="google", show_source=False, footer_text="GaussianNexus Studio")
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        pdoc.pdoc(*modules, output_directory=out)
    ours = [str(w.message) for w in heard if Path(w.filename).is_relative_to(pdoc.__path__[0])]
    return [line for line in ours if not any(known in line for known in ACCEPTED)]


def stand_in_for_native_module() -> None:
    """Import the native module's stub in its place: only that has its types and their docstrings.

    Nothing is called, so the crate need not be built.
    """
    import scenes

    stub = ROOT / "scenes" / "_native.pyi"
    code = compile(
        stub.read_text(encoding="utf-8"),
        str(stub),
        "exec",
        flags=__future__.annotations.compiler_flag,
    )
    module = types.ModuleType("scenes._native")
    module.__file__ = str(stub)
    sys.modules[module.__name__] = module
    setattr(scenes, "_native", module)  # noqa: B010 - no type checker has to believe this
    exec(code, module.__dict__)


# --- pages ----------------------------------------------------------------------------------------


def build_pages(out: Path) -> list[str]:
    """Every page as HTML, and the links in them that lead nowhere."""
    pages = tuple(read_pages())
    template = Template((Path(__file__).parent / "page.html.j2").read_text(encoding="utf-8"))
    markdown = MarkdownIt("commonmark", {"highlight": highlighted}).enable("table")
    markdown.use(anchors_plugin, max_level=4)
    faults: list[str] = []
    for page in pages:
        tokens = markdown.parse(page.text)
        for token, attribute in links_in(tokens):
            target = str(token.attrs[attribute])
            try:
                token.attrs[attribute] = resolved(target, page, pages, out)
            except DocsError as error:
                faults.append(f"{page.source.relative_to(ROOT)}: {error}")
        body = markdown.renderer.render(tokens, markdown.options, {})
        written = template.render(
            title=page.title,
            name=page.name,
            pages=pages,
            body=body,
            highlighting=HtmlFormatter().get_style_defs("pre"),
        )
        (out / page.name).write_text(written, encoding="utf-8")
    return faults + missing_anchors(out, pages)


def read_pages() -> Iterator[Page]:
    """The pages in the order of the list beside them."""
    others = sorted(str(path.relative_to(ROOT)) for path in (ROOT / "docs").rglob("*.md"))
    middle = [name for name in others if name not in FIRST_PAGES]
    for name in (*FIRST_PAGES, *middle):
        yield read_page(name)
    yield examples_page()
    for name in LAST_PAGES:
        if (ROOT / name).is_file():
            yield read_page(name)


def read_page(name: str) -> Page:
    """A Markdown file; its title is its first heading."""
    source = ROOT / name
    text = source.read_text(encoding="utf-8")
    title = re.search(r"^# (.+)$", text, re.MULTILINE)
    if title is None:
        raise DocsError(f"{name}: no heading '# …' to call it by")
    html_name = "index.html" if name == "README.md" else f"{source.stem.lower()}.html"
    return Page(source, html_name, title[1], text)


def examples_page() -> Page:
    """Every example with what it shows, and its source."""
    parts = ["# Examples"]
    for path in sorted((ROOT / EXAMPLES).glob("*.py")):
        source = path.read_text(encoding="utf-8")
        said = ast.get_docstring(ast.parse(source)) or ""
        code = source.split('"""', 2)[2].strip()
        parts += [f"## {path.stem}", said, f"```python\n{code}\n```"]
    return Page(ROOT / EXAMPLES, "examples.html", "Examples", "\n\n".join(parts))


def highlighted(code: str, language: str, _attributes: str) -> str:
    """HTML of a code block; plain where the language is none that is known."""
    try:
        lexer = get_lexer_by_name(language)
    except ClassNotFound:
        return html.escape(code)
    return highlight(code, lexer, HtmlFormatter(nowrap=True))


def links_in(tokens: Sequence[Token]) -> Iterator[tuple[Token, str]]:
    """Every link and picture, and the attribute that says where it leads."""
    for token in tokens:
        if token.type in ("link_open", "image"):
            yield token, "href" if token.type == "link_open" else "src"
        yield from links_in(token.children or ())


def resolved(target: str, page: Page, pages: Sequence[Page], out: Path) -> str:
    """Where a link of the repository leads in the output; files that it needs are copied.

    Raises:
        DocsError: there is nothing there.
    """
    parts = urlsplit(target)
    if parts.scheme or not parts.path:
        return target
    fragment = f"#{parts.fragment}" if parts.fragment else ""
    path = (page.source.parent / parts.path).resolve()
    if not path.exists() or not path.is_relative_to(ROOT):
        raise DocsError(f"the link {target!r} leads nowhere")
    for other in pages:
        if path == other.source:
            return other.name + fragment
    inside = path.relative_to(ROOT)
    if inside.parts[0] == EXAMPLES:
        return f"examples.html#{inside.stem}"
    if inside.parts[0] in PACKAGES and (path.suffix == ".py" or (path / "__init__.py").is_file()):
        return f"api/{inside.with_suffix('')}.html"
    copy = out / "files" / inside
    if path.is_dir():
        shutil.copytree(
            path, copy, dirs_exist_ok=True, ignore=shutil.ignore_patterns("__pycache__")
        )
        rows = [f'<li><a href="{file.name}">{file.name}</a>' for file in sorted(copy.iterdir())]
        copy = copy / "index.html"
        copy.write_text(f"<!doctype html><title>{inside}</title><ul>{''.join(rows)}</ul>")
    else:
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(path, copy)
    return copy.relative_to(out).as_posix()


def missing_anchors(out: Path, pages: Sequence[Page]) -> list[str]:
    """Links to a place in a page that the page does not have."""
    written = {page.name: (out / page.name).read_text(encoding="utf-8") for page in pages}
    faults = []
    for page in pages:
        for name, anchor in re.findall(r'href="([^":#]*)#([^"]+)"', written[page.name]):
            target = written.get(name or page.name)
            if target is not None and f'id="{anchor}"' not in target:
                source = page.source.relative_to(ROOT)
                faults.append(f"{source}: {name or page.name} has no heading '#{anchor}'")
    return faults


if __name__ == "__main__":
    sys.exit(main())
