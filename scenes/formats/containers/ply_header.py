"""The header of a PLY file: which elements there are, of which properties, and where they begin."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scenes.formats.storage.error import refusal

MAX_HEADER_BYTES = 65_536
MAX_ROWS = 2**32 - 1

_KINDS = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
_ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">"}


@dataclass(frozen=True, slots=True)
class PlyElement:
    """A table of a PLY file.

    Attributes:
        name: such as "vertex".
        count: number of rows.
        offset: byte of the first row, or None behind a table whose rows vary in size.
        dtype: one row, or None if it has a list property.
    """

    name: str
    count: int
    offset: int | None
    dtype: np.dtype[np.void] | None


@dataclass(frozen=True, slots=True)
class PlyHeader:
    """Header of a PLY file: its elements by name and its comment lines."""

    elements: dict[str, PlyElement]
    comments: tuple[str, ...]


def read_header(path: Path) -> PlyHeader:
    """Parse the header of a binary PLY file.

    Raises:
        FormatError: it is not a PLY file, is ASCII, has no end or a line makes no sense.
        OSError: the file cannot be read.
    """
    with path.open("rb") as file:
        head = file.read(MAX_HEADER_BYTES)
    if not head.startswith(b"ply"):
        raise refusal(path, "byte 0", "not a PLY file", "give a PLY file")
    end = head.find(b"end_header")
    newline = head.find(b"\n", end)
    if end < 0 or newline < 0:
        raise refusal(
            path,
            "",
            f"the PLY header does not end within {min(len(head), MAX_HEADER_BYTES)} bytes",
            "the file is truncated or damaged, copy or export it again",
        )
    lines = head[:end].decode("ascii", errors="replace").splitlines()[1:]
    return _parse(path, lines, newline + 1)


def read_rows(path: Path, element: PlyElement, start: int, stop: int) -> NDArray[np.void]:
    """Rows `start` to `stop` of an element whose extent `require_rows` has checked.

    Raises:
        FormatError: the file has become shorter since.
        OSError: the file cannot be read.
    """
    assert element.dtype is not None
    assert element.offset is not None
    size = element.dtype.itemsize
    with path.open("rb") as file:
        file.seek(element.offset + start * size)
        rows = np.fromfile(file, dtype=element.dtype, count=stop - start)
    if len(rows) != stop - start:
        raise refusal(
            path,
            f"{element.name} {start + len(rows)}",
            "the file was cut while it was read",
            "try again",
        )
    return rows


def require_rows(path: Path, header: PlyHeader, name: str) -> PlyElement:
    """The element `name`, all of whose rows are in the file.

    Raises:
        FormatError: it is missing, has rows of varying size, or the file ends before its last row.
    """
    element = header.elements.get(name)
    if element is None:
        known = ", ".join(header.elements) or "none"
        raise refusal(
            path, "", f"no element {name!r} (it has: {known})", "give a Gaussian-splat PLY"
        )
    if element.dtype is None or element.offset is None:
        raise refusal(
            path,
            f"element {name!r}",
            "rows of varying size (a list property)",
            "this is a mesh or a foreign PLY, give a Gaussian-splat PLY",
        )
    wanted = element.offset + element.count * element.dtype.itemsize
    size = path.stat().st_size
    if size < wanted:
        missing_from = max(0, size - element.offset) // max(1, element.dtype.itemsize)
        raise refusal(
            path,
            f"byte {size} ({name} {missing_from})",
            f"the file ends there, {element.count} rows of {name!r} need {wanted} bytes",
            "it is truncated, copy or export it again",
        )
    return element


def _parse(path: Path, lines: list[str], data_offset: int) -> PlyHeader:
    order = ""
    comments: list[str] = []
    tables: list[tuple[str, int, list[tuple[str, str]], bool]] = []
    for number, line in enumerate(lines, start=2):
        words = line.split()
        match words:
            case []:
                continue
            case ["comment" | "obj_info", *_]:
                comments.append(line.split(maxsplit=1)[1].strip() if len(words) > 1 else "")
            case ["format", kind, _]:
                if kind not in _ORDERS:
                    raise refusal(
                        path, f"line {number}", f"format {kind!r}", "save it as a binary PLY"
                    )
                order = _ORDERS[kind]
            case ["element", name, count] if count.isdecimal() and int(count) <= MAX_ROWS:
                tables.append((name, int(count), [], False))
            case ["property", "list", *_] if tables:
                name, rows, columns, _ = tables[-1]
                tables[-1] = (name, rows, columns, True)
            case ["property", kind, name] if tables and kind in _KINDS:
                tables[-1][2].append((name, _KINDS[kind]))
            case _:
                raise refusal(
                    path,
                    f"line {number}",
                    f"{line[:80]!r} is no PLY header line",
                    "the file is damaged or foreign",
                )
    if not order:
        raise refusal(path, "", "no format line in the PLY header", "save it as a binary PLY")
    return PlyHeader(_row_layout(path, tables, order, data_offset), tuple(comments))


def _row_layout(
    path: Path,
    tables: list[tuple[str, int, list[tuple[str, str]], bool]],
    order: str,
    data_offset: int,
) -> dict[str, PlyElement]:
    elements: dict[str, PlyElement] = {}
    offset: int | None = data_offset
    for name, count, columns, varying in tables:
        names = [column for column, _ in columns]
        if name in elements or len(set(names)) != len(names):
            raise refusal(
                path, f"element {name!r}", "a name appears twice", "the file is damaged or foreign"
            )
        dtype = None if varying else np.dtype([(n, order + kind) for n, kind in columns])
        elements[name] = PlyElement(name, count, offset, dtype)
        if dtype is None or offset is None:
            offset = None
        else:
            offset += count * dtype.itemsize
    return elements
