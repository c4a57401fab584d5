"""Places of values and tables in a TOML text, so that edits touch nothing else."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, cast

import tomlkit
from tomlkit.exceptions import TOMLKitError

Path = tuple[str | int, ...]
"""Keys and indices from the top of a file to a value, such as ("people", 0, "start")."""

FIRST_MARK = 918_273_645_000
"""A number that stands for a value while its place is looked for; the next one if it is taken."""


class EditError(ValueError):
    """A text cannot be edited as was asked; says where and why."""


@dataclass(frozen=True, slots=True)
class Span:
    """Characters `start..end` of a text, the end excluded."""

    start: int
    end: int


@dataclass(frozen=True, slots=True)
class Header:
    """A line such as `[camera]` or `[[people]]`.

    Attributes:
        start: of its line.
        end: after its closing bracket.
        name: the dotted keys.
        is_list: whether it has two brackets.
    """

    start: int
    end: int
    name: tuple[str, ...]
    is_list: bool


def parsed(text: str) -> Any:
    """The text as tomlkit's document.

    Raises:
        EditError: it is no TOML.
    """
    try:
        tomllib.loads(text)
        return tomlkit.parse(text)
    except (tomllib.TOMLDecodeError, TOMLKitError) as error:
        raise EditError(f"not TOML: {error}") from None


def item_at(document: Any, path: Path) -> Any:
    """Return the item at a path, or None."""
    found: Any = document
    for key in path:
        if isinstance(key, int):
            if not isinstance(found, list) or not -len(found) <= key < len(found):
                return None
        elif not isinstance(found, dict) or key not in found:
            return None
        found = cast(Any, found)[key]
    return found


def span_of(text: str, path: Path) -> Span:
    """Return the span of the value at a path.

    It is replaced by a number in tomlkit's document; what is the same before and after that number
    in the text that tomlkit then writes is not the value.

    Raises:
        EditError: there is no such value, or it is a table with a header of its own.
    """
    return span_in(text, parsed(text), path)


def span_in(text: str, document: Any, path: Path) -> Span:
    """As `span_of`, with the text as tomlkit has it; that document is spoiled by it.

    Raises:
        EditError: see `span_of`.
    """
    parent = item_at(document, path[:-1])
    if item_at(document, path) is None:
        raise EditError(f"{named(path)}: there is no such value")
    mark = FIRST_MARK
    while str(mark) in text:
        mark += 1
    parent[path[-1]] = mark
    written = tomlkit.dumps(document)
    start = written.find(str(mark))
    after = written[start + len(str(mark)) :]
    end = len(text) - len(after)
    if start < 0 or end < start or text[:start] != written[:start] or text[end:] != after:
        raise EditError(f"{named(path)}: is not written as one value; change it in the text")
    return Span(start, end)


def headers(text: str) -> list[Header]:
    """All table headers, in order."""
    found: list[Header] = []
    for start, end in _outer_lines(text):
        line = text[start:end]
        stripped = line.lstrip()
        if stripped.startswith("["):
            is_list = stripped.startswith("[[")
            close = line.index("]]" if is_list else "]") + (2 if is_list else 1)
            inside = line[:close].strip().strip("[]")
            name = tuple(part.strip().strip("\"'") for part in inside.split("."))
            found.append(Header(start, start + close, name, is_list))
    return found


def header_of(text: str, path: Path) -> int | None:
    """Index in `headers` of the table at a path, or None if it has none of its own."""
    names = tuple(key for key in path if isinstance(key, str))
    counts: dict[tuple[str, ...], int] = {}
    for index, header in enumerate(headers(text)):
        if header.is_list:
            counts = {n: c for n, c in counts.items() if n[: len(header.name)] != header.name} | {
                header.name: counts.get(header.name, -1) + 1
            }
        if header.name == names and _indices(counts, names) == _path_indices(path):
            return index
    return None


def block_of(text: str, path: Path) -> Span:
    """A table with its header and sub-tables, and the comment lines right above the header.

    Raises:
        EditError: the table has no header.
    """
    index = header_of(text, path)
    found = headers(text)
    if index is None:
        raise EditError(f"{named(path)}: has no header of its own; change it in the text")
    name = found[index].name
    following = next((h for h in found[index + 1 :] if not _is_below(h, name)), None)
    end = len(text) if following is None else with_comments(text, following.start)
    return Span(with_comments(text, found[index].start), end)


def with_comments(text: str, line_start: int) -> int:
    """Start of the comment lines right above a line, or of the line itself."""
    start = line_start
    while start > 0:
        before = text.rfind("\n", 0, start - 1) + 1
        if not text[before:start].lstrip().startswith("#"):
            return start
        start = before
    # Comments at the very top are the file's own.
    return line_start


def line_start(text: str, at: int) -> int:
    """Start of the line that a character is in."""
    return text.rfind("\n", 0, at) + 1


def line_end(text: str, at: int) -> int:
    """End of the line that a character is in, its line break excluded."""
    found = text.find("\n", at)
    return len(text) if found < 0 else found


def named(path: Sequence[str | int]) -> str:
    """A path as messages write it: `people[0].start`."""
    words = ""
    for key in path:
        words += f"[{key}]" if isinstance(key, int) else f".{key}" if words else key
    return words


def _is_below(header: Header, name: tuple[str, ...]) -> bool:
    return len(header.name) > len(name) and header.name[: len(name)] == name


def _indices(counts: dict[tuple[str, ...], int], name: tuple[str, ...]) -> tuple[int, ...]:
    parts = (counts.get(name[: k + 1]) for k in range(len(name)))
    return tuple(count for count in parts if count is not None)


def _path_indices(path: Path) -> tuple[int, ...]:
    return tuple(key for key in path if isinstance(key, int))


def _outer_lines(text: str) -> Iterator[tuple[int, int]]:
    """Start and end of lines that begin outside of strings and brackets."""
    position = depth = 0
    while position < len(text):
        start = position
        is_header = depth == 0 and text[start : line_end(text, start)].lstrip().startswith("[")
        if is_header:
            yield start, line_end(text, start)
            position = line_end(text, start) + 1
            continue
        if depth == 0:
            yield start, line_end(text, start)
        position, depth = _after_line(text, position, depth)


def _after_line(text: str, position: int, depth: int) -> tuple[int, int]:
    """Past the line break that ends the line outside of strings, and how many brackets are open."""
    while position < len(text):
        character = text[position]
        if character == "\n":
            return position + 1, depth
        if character == "#":
            return line_end(text, position) + 1, depth
        if character in "\"'":
            position = after_string(text, position)
            continue
        depth += (character in "[{") - (character in "]}")
        position += 1
    return position, depth


def after_string(text: str, start: int) -> int:
    """Past the end of the string that begins at a quote."""
    quote = text[start]
    closing = quote * 3 if text.startswith(quote * 3, start) else quote
    position = start + len(closing)
    while position < len(text):
        if quote == '"' and text[position] == "\\":
            position += 2
        elif text.startswith(closing, position):
            return position + len(closing)
        else:
            position += 1
    return len(text)
