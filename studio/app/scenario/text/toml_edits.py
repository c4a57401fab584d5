"""Edits of a TOML text that leave every other byte as it is: comments, order, spaces."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from typing import Any

from tomlkit.items import AoT, InlineTable, Table

from studio.app.scenario.text.toml_spans import (
    EditError,
    Path,
    Span,
    block_of,
    header_of,
    headers,
    item_at,
    line_end,
    line_start,
    named,
    parsed,
    span_in,
    span_of,
)

DECIMALS = 4
"""Of numbers that are written: a tenth of a millimetre."""

BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")


def written(value: Any) -> str:
    """A value as TOML.

    Raises:
        EditError: it is none of TOML's kinds.
    """
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return repr(round(value, DECIMALS) + 0.0)
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, Mapping):
        pairs = ", ".join(f"{_key(k)} = {written(v)}" for k, v in value.items())
        return f"{{ {pairs} }}"
    if isinstance(value, Sequence):
        return "[" + ", ".join(written(item) for item in value) + "]"
    raise EditError(f"{value!r} cannot be written as TOML")


def with_value(text: str, path: Path, value: Any) -> str:
    """The text with a value set; its key is added where there is none.

    Raises:
        EditError: the place cannot be found, or the text is no TOML.
    """
    document = parsed(text)
    before = item_at(document, path)
    if before is None:
        return _with_key(text, path, value)
    if isinstance(before, Table | AoT):
        raise EditError(f"{named(path)}: is a table of its own; change its keys")
    span = span_in(text, document, path)
    return text[: span.start] + _in_style(before, value) + text[span.end :]


def without(text: str, path: Path) -> str:
    """The text without a key, a list's item or a table; the same if there is none.

    Raises:
        EditError: the place cannot be found, or the text is no TOML.
    """
    document = parsed(text)
    item = item_at(document, path)
    if item is None:
        return text
    if isinstance(item, Table):
        return _without_blocks(text, path, [path])
    if isinstance(item, AoT):
        return _without_blocks(text, path, [(*path, k) for k in range(len(item))])
    if isinstance(path[-1], int):
        return taken_out(text, path)[0]
    span = span_of(text, path)
    if isinstance(item_at(document, path[:-1]), InlineTable):
        return _without_inline_key(text, span)
    start = line_start(text, span.start)
    return text[:start] + text[min(line_end(text, span.end) + 1, len(text)) :]


def with_item(text: str, path: Path, index: int, value: Any) -> str:
    """The text with an item put into a list before `index`; at its end for its length.

    Raises:
        EditError: there is no such list, or the text is no TOML.
    """
    return _put_in(text, path, index, written(value), "")


def with_item_moved(text: str, path: Path, index: int, to: int) -> str:
    """The text with a list's item at another place, as it is written, with its comment.

    Args:
        text: TOML.
        path: of the list.
        index: of the item.
        to: its index afterwards.

    Raises:
        EditError: there is no such list or item.
    """
    if isinstance(item_at(parsed(text), path), AoT):
        return _with_block_moved(text, path, index, to)
    span = span_of(text, (*path, index))
    raw = text[span.start : span.end]
    rest, comment = taken_out(text, (*path, index))
    return _put_in(rest, path, to, raw, comment)


def with_table(text: str, path: Path, values: Mapping[str, Any]) -> str:
    """The text with a table added to a list of tables, such as `[[people]]`, as the last one.

    Raises:
        EditError: the text is no TOML, or it has something else there.
    """
    there = item_at(parsed(text), path)
    if there is not None and not isinstance(there, AoT):
        return with_item(text, path, len(there), values)
    name = ".".join(_key(key) for key in path if isinstance(key, str))
    lines = [f"[[{name}]]", *(f"{_key(k)} = {written(v)}" for k, v in values.items())]
    at = len(text) if not there else block_of(text, (*path, len(there) - 1)).end
    return _with_block(text, at, "\n".join(lines) + "\n")


def taken_out(text: str, path: Path) -> tuple[str, str]:
    """The text without an item of a list in brackets, and the comment that stood behind it."""
    index = path[-1]
    assert isinstance(index, int)
    items = item_at(parsed(text), path[:-1])
    if isinstance(items, AoT):
        raise EditError(f"{named(path)}: is a table of its own")
    span, count = span_of(text, path), len(items)
    comma = _comma_after(text, span.end)
    end = span.end if comma is None else comma + 1
    if _is_alone(text, span, end):
        # A comment may stand before the comma, too, which is then on a line of its own.
        between = re.findall(r"#[^\n]*", text[span.end : end])
        rest = " ".join([*between, text[end : line_end(text, end)].strip()]).strip()
        start = line_start(text, span.start)
        return text[:start] + text[min(line_end(text, end) + 1, len(text)) :], rest
    if index + 1 < count:
        following = span_of(text, (*path[:-1], index + 1)).start
        between = text[end:following]
        return text[: span.start] + text[following if not between.strip() else end :], ""
    if index > 0:
        before = span_of(text, (*path[:-1], index - 1)).end
        if not text[before : span.start].strip().strip(","):
            return text[:before] + text[span.end :], ""
    return text[: span.start] + text[end:], ""


def _put_in(text: str, path: Path, index: int, raw: str, comment: str) -> str:
    items = item_at(parsed(text), path)
    if not isinstance(items, list) or isinstance(items, AoT):
        raise EditError(f"{named(path)}: is no list in brackets; change it in the text")
    tail = f"  {comment}" if comment else ""
    if not items:
        bracket = span_of(text, path).start + 1
        return text[:bracket] + raw + text[bracket:]
    if index < len(items):
        span = span_of(text, (*path, index))
        indent = text[line_start(text, span.start) : span.start]
        if not indent.strip():
            return text[: span.start] + f"{raw},{tail}\n{indent}" + text[span.start :]
        return text[: span.start] + f"{raw}, " + text[span.start :]
    span = span_of(text, (*path, len(items) - 1))
    indent = text[line_start(text, span.start) : span.start]
    comma = _comma_after(text, span.end)
    end = span.end if comma is None else comma + 1
    if indent.strip() or not _ends_line(text, end):
        return text[: span.end] + f", {raw}" + text[span.end :]
    head = text[:end] if comma is not None else text[:end] + ","
    stop = line_end(text, end)
    return head + text[end:stop] + f"\n{indent}{raw},{tail}" + text[stop:]


def _with_key(text: str, path: Path, value: Any) -> str:
    parent, key = path[:-1], path[-1]
    document = parsed(text)
    table = item_at(document, parent)
    line = f"{_key(str(key))} = {written(value)}"
    if isinstance(table, InlineTable):
        return _with_inline_key(text, parent, line)
    if table is not None and not isinstance(table, dict):
        raise EditError(f"{named(parent)}: is no table")
    if not parent:
        return _with_top_line(text, document, line)
    index = header_of(text, parent)
    if index is None:
        is_implicit = any(h.name[: len(parent)] == parent for h in headers(text))
        if table is not None and not is_implicit:
            raise EditError(f"{named(parent)}: is written key by key; change it in the text")
        if any(isinstance(k, int) for k in parent):
            raise EditError(f"{named(parent)}: there is no such table")
        name = ".".join(_key(str(k)) for k in parent)
        return _with_block(text, len(text), f"[{name}]\n{line}\n")
    assert table is not None  # it has a header
    own = [k for k, v in table.items() if not isinstance(v, Table | AoT)]
    at = max([headers(text)[index].end, *(span_of(text, (*parent, k)).end for k in own)])
    return _with_line(text, at, line)


def _with_inline_key(text: str, path: Path, line: str) -> str:
    table = item_at(parsed(text), path)
    if table:
        end = max(span_of(text, (*path, key)).end for key in table)
        return text[:end] + f", {line}" + text[end:]
    span = span_of(text, path)
    return text[: span.start] + f"{{ {line} }}" + text[span.end :]


def _with_top_line(text: str, document: Any, line: str) -> str:
    own = [k for k, v in document.items() if not isinstance(v, Table | AoT)]
    if own:
        return _with_line(text, max(span_of(text, (k,)).end for k in own), line)
    return f"{line}\n{text}"


def _with_line(text: str, at: int, line: str) -> str:
    """A line after the one that a character is in."""
    end = line_end(text, at)
    return f"{text[:end]}\n{line}{text[end:]}"


def _with_block(text: str, at: int, block: str) -> str:
    before, after = text[:at], text[at:]
    if before and not before.endswith("\n"):
        before += "\n"
    gap = "" if not before or before.endswith("\n\n") else "\n"
    return before + gap + block + ("\n" if after and not after.startswith("\n") else "") + after


def _without_blocks(text: str, path: Path, blocks: Sequence[Path]) -> str:
    for block in reversed(blocks):
        if header_of(text, block) is None:
            raise EditError(f"{named(path)}: has no header of its own; change it in the text")
        span = block_of(text, block)
        text = text[: span.start] + text[span.end :]
    return text


def _with_block_moved(text: str, path: Path, index: int, to: int) -> str:
    count = len(item_at(parsed(text), path))
    if not (0 <= index < count and 0 <= to < count):
        raise EditError(f"{named(path)}[{index}]: cannot be moved to {to}")
    if index == to:
        return text
    span = block_of(text, (*path, index))
    moved, rest = text[span.start : span.end], text[: span.start] + text[span.end :]
    if to < count - 1:
        at = block_of(rest, (*path, to)).start
    else:
        at = block_of(rest, (*path, count - 2)).end
    return _with_block(rest, at, moved)


def _without_inline_key(text: str, value: Span) -> str:
    equals = text.rindex("=", 0, value.start)
    start = re.search(r"[^\s,{]+\s*$", text[:equals])
    assert start is not None
    key = start.start()
    comma = re.match(r"\s*,\s*", text[value.end :])
    if comma is not None:
        return text[:key] + text[value.end + comma.end() :]
    before = re.search(r"\s*,\s*$", text[:key])
    return text[: key if before is None else before.start()] + text[value.end :]


def _in_style(before: Any, value: Any) -> str:
    """A value written with the old one's style: a whole number stays one."""
    is_number = isinstance(before, int) and not isinstance(before, bool)
    if is_number and isinstance(value, float) and value == int(value):
        return str(int(value))
    return written(value)


def _comma_after(text: str, at: int) -> int | None:
    """Return the place of the comma after an item, past spaces and comments; None without one."""
    found = re.compile(r"(?:\s|#[^\n]*)*,").match(text, at)
    return None if found is None else found.end() - 1


def _is_alone(text: str, span: Span, end: int) -> bool:
    """Whether nothing but a comment is on an item's lines beside it."""
    return not text[line_start(text, span.start) : span.start].strip() and _ends_line(text, end)


def _ends_line(text: str, at: int) -> bool:
    rest = text[at : line_end(text, at)].strip()
    return (not rest or rest.startswith("#")) and line_end(text, at) < len(text)


def _key(key: str) -> str:
    return key if BARE_KEY.fullmatch(key) else json.dumps(key, ensure_ascii=False)
