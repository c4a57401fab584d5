# pyright: standard
"""Binary glTF 2.0 as a container: its JSON, its binary chunk, accessors into it; all distrusted.

Source: Khronos glTF 2.0 specification, sections 3.6 (binary data) and 4 (GLB).
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from scenes.formats.storage.error import FormatError, refusal

MAGIC = b"glTF"
MAX_JSON_BYTES = 2**22
MAX_BYTES = 2**32 - 1
"""The length of a GLB file is stored in 32 bits."""

FLOAT, UNSIGNED_BYTE = 5126, 5121
COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}

_FILE = struct.Struct("<4sII")
_CHUNK = struct.Struct("<I4s")
_JSON, _BINARY = b"JSON", b"BIN\0"
_KINDS = {5120: "<i1", UNSIGNED_BYTE: "<u1", 5122: "<i2", 5123: "<u2", FLOAT: "<f4"}
_MAX_STRIDE = 252
_VERTEX_DATA = 34962


@dataclass(frozen=True, slots=True)
class Glb:
    """A parsed GLB file.

    Attributes:
        path: the file.
        document: the JSON, an object; nothing in it has been checked.
        offset: the first byte of the binary chunk.
        size_bytes: how long that chunk is; all of it is in the file.
    """

    path: Path
    document: dict[str, Any]
    offset: int
    size_bytes: int


@dataclass(frozen=True, slots=True)
class Accessor:
    """An array in a GLB file, all of which is in its binary chunk.

    Attributes:
        name: what to call it in messages.
        dtype: of one component, little endian.
        width: components an element.
        count: elements.
        offset: first byte in the file.
        stride_bytes: from one element to the next.
    """

    name: str
    dtype: np.dtype[Any]
    width: int
    count: int
    offset: int
    stride_bytes: int

    def read(self, path: Path, file: IO[bytes], start: int, stop: int) -> NDArray[np.float32]:
        """(stop - start, width) float32; integers are normalised to 0..1 or -1..1.

        Raises:
            FormatError: the file has become shorter since it was opened.
        """
        element = self.width * self.dtype.itemsize
        wanted = (stop - start - 1) * self.stride_bytes + element if stop > start else 0
        file.seek(self.offset + start * self.stride_bytes)
        data = file.read(wanted)
        if len(data) != wanted:
            raise refusal(path, self.name, "the file was cut while it was read", "try again")
        values = np.ndarray(
            (stop - start, self.width),
            self.dtype,
            data,
            strides=(self.stride_bytes, self.dtype.itemsize),
        )
        if self.dtype.kind == "f":
            return values.astype(np.float32)
        limit = np.iinfo(self.dtype).max
        return np.maximum(values.astype(np.float64) / limit, -1.0).astype(np.float32)


def read_glb(path: Path) -> Glb:
    """Parse the header, the JSON chunk and the place of the binary chunk.

    Raises:
        FormatError: it is no GLB of version 2, is truncated, or its JSON is damaged.
        OSError: the file cannot be read.
    """
    size = path.stat().st_size
    with path.open("rb") as file:
        start = file.read(_FILE.size + _CHUNK.size)
        if len(start) < _FILE.size + _CHUNK.size or not start.startswith(MAGIC):
            raise refusal(path, "byte 0", "no GLB header", "give a whole binary glTF file (.glb)")
        _, version, announced = _FILE.unpack_from(start)
        json_bytes, kind = _CHUNK.unpack_from(start, _FILE.size)
        if version != 2 or kind != _JSON:
            raise refusal(
                path,
                "byte 4",
                f"glTF version {version} whose first chunk is {kind!r}, wanted 2 and {_JSON!r}",
                "export it as binary glTF 2.0",
            )
        offset = len(start) + json_bytes + _CHUNK.size
        if announced > size or json_bytes > MAX_JSON_BYTES or offset > announced:
            raise refusal(
                path,
                "byte 8",
                f"{announced} bytes with {json_bytes} of JSON (limit {MAX_JSON_BYTES}), "
                f"the file has {size}",
                "it is truncated or damaged, copy or export it again",
            )
        document = _parse(path, file.read(json_bytes))
        binary_bytes, kind = _CHUNK.unpack(file.read(_CHUNK.size))
    if kind != _BINARY or offset + binary_bytes > announced:
        raise refusal(
            path,
            f"byte {offset - _CHUNK.size}",
            f"chunk {kind!r} of {binary_bytes} bytes, wanted {_BINARY!r} within {announced} bytes",
            "the file is truncated, damaged or has its data elsewhere, export it as one .glb",
        )
    return Glb(path, document, offset, binary_bytes)


def accessor(glb: Glb, index: Any, name: str, kind: str) -> Accessor:
    """The array that an attribute points to, if it is of `kind` (a key of `COMPONENTS`).

    Integers must be normalised. Sparse accessors and data outside the file are refused.

    Raises:
        FormatError: it is of another kind, or not all of it is in the binary chunk.
    """
    entry = item(glb, "accessors", index)
    component = entry.get("componentType")
    if (
        entry.get("type") != kind
        or not isinstance(component, int)
        or component not in _KINDS
        or (component != FLOAT and entry.get("normalized") is not True)
        or "sparse" in entry
    ):
        raise _bad(
            glb,
            name,
            f"type {entry.get('type')!r:.20} of components {component!r:.20}, wanted {kind} of "
            "floats or normalised integers, not sparse",
        )
    view = item(glb, "bufferViews", entry.get("bufferView"))
    buffer = item(glb, "buffers", view.get("buffer"))
    if view.get("buffer") != 0 or "uri" in buffer:
        raise _bad(glb, name, "its data is in another file, export it as one .glb")
    dtype = np.dtype(_KINDS[component])
    element = COMPONENTS[kind] * dtype.itemsize
    count = natural(glb, f"{name} count", entry.get("count"))
    within = natural(glb, f"{name} byteOffset", entry.get("byteOffset", 0))
    view_start = natural(glb, f"{name} view byteOffset", view.get("byteOffset", 0))
    view_bytes = natural(glb, f"{name} view byteLength", view.get("byteLength"))
    stride = natural(glb, f"{name} view byteStride", view.get("byteStride", element))
    end = within + (count - 1) * stride + element if count else within
    if (
        not element <= stride <= _MAX_STRIDE
        or end > view_bytes
        or view_start + view_bytes > glb.size_bytes
    ):
        raise _bad(
            glb,
            name,
            f"{count} elements of {element} bytes, {stride} apart, end at byte {end} of a view of "
            f"{view_bytes} at byte {view_start} of {glb.size_bytes}",
        )
    return Accessor(name, dtype, COMPONENTS[kind], count, glb.offset + view_start + within, stride)


def item(glb: Glb, name: str, index: Any) -> dict[str, Any]:
    """Object number `index` of one of the document's top-level lists.

    Raises:
        FormatError: there is no such object.
    """
    entries = glb.document.get(name)
    if (
        not isinstance(entries, list)
        or isinstance(index, bool)
        or not isinstance(index, int)
        or not 0 <= index < len(entries)
        or not isinstance(entries[index], dict)
    ):
        raise _bad(glb, name, f"there is no number {index!r:.20}")
    return entries[index]


def natural(glb: Glb, name: str, value: Any) -> int:
    """A whole number that may be a count or an offset in such a file.

    Raises:
        FormatError: it is not.
    """
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= MAX_BYTES:
        raise _bad(glb, name, f"{value!r:.20}, wanted a whole number 0 to {MAX_BYTES}")
    return value


def glb_start(document: dict[str, Any], binary_bytes: int) -> bytes:
    """Everything of a GLB file before its binary data, which must be a multiple of 4 bytes."""
    text = json.dumps(document, separators=(",", ":"), allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    total = _FILE.size + 2 * _CHUNK.size + len(text) + binary_bytes
    return b"".join(
        [
            _FILE.pack(MAGIC, 2, total),
            _CHUNK.pack(len(text), _JSON),
            text,
            _CHUNK.pack(binary_bytes, _BINARY),
        ]
    )


def packed_views(sizes: Sequence[int]) -> Iterator[dict[str, int]]:
    """Buffer views of vertex data of these sizes, one after the other."""
    offset = 0
    for size in sizes:
        yield {"buffer": 0, "byteOffset": offset, "byteLength": size, "target": _VERTEX_DATA}
        offset += size


def _parse(path: Path, text: bytes) -> dict[str, Any]:
    try:
        document = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise refusal(
            path, "JSON", f"{type(error).__name__}: {error}", "the file is damaged, export it again"
        ) from None
    if not isinstance(document, dict):
        raise refusal(path, "JSON", "not an object", "the file is damaged, export it again")
    return document


def _bad(glb: Glb, name: str, what: str) -> FormatError:
    return refusal(glb.path, name, what, "the file is damaged or foreign, export it again")
