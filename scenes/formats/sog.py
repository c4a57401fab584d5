# pyright: standard
"""PlayCanvas SOG, versions 1 and 2, a folder or zip of WebP textures and meta.json. Read only.

Layout from the public splat-transform sources. One pixel a splat: 16-bit positions split over two
textures in a signed-log range, rotations as three bytes and the index of the largest of w, x, y, z
(252 + i), scales and colours as indices into codebooks (version 1: bytes between bounds), and
higher SH as a palette of 64 entries a row with a 16-bit label a splat. The file's axes are kept, as
with PLY.
"""

from __future__ import annotations

import io
import json
import warnings
import zipfile
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from scenes.formats.storage.activation import (
    cloud_from_file,
    damaged_values_are_quiet,
    exponential,
    rotations_from_three,
    sigmoid,
)
from scenes.formats.storage.bad_rows import intact, without_bad_rows
from scenes.formats.storage.blocks import ROWS_PER_BLOCK, SplatBlocks, extents
from scenes.formats.storage.error import FormatError, refusal
from scenes.splats import SH_COUNTS, SplatCloud

META = "meta.json"
MAX_PIXELS = 2**26
MAX_FILE_BYTES = 2**29
MAX_META_BYTES = 2**22
PALETTE_COLUMNS = 64
FIRST_TAG = 252

_MISFIT = (LookupError, AttributeError, TypeError, ValueError, ArithmeticError, RecursionError)
"""Errors that reading a meta.json of another shape raises."""

_BAD_ZIP = (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, ValueError)
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)

Bytes = NDArray[np.uint8]
Floats = NDArray[np.float64]
Column = Callable[[slice], NDArray[np.floating]]
"""Unpacks a range of rows."""


def is_sog_folder(path: Path) -> bool:
    """Whether this folder holds a SOG: its meta.json lists position textures."""
    if not (path / META).is_file():
        return False
    try:
        meta = json.loads(_Source(path).read(META))
    except (ValueError, RecursionError):
        return False
    return isinstance(meta, dict) and isinstance(meta.get("means"), dict)


def read_sog(path: Path) -> SplatCloud:
    """Read a SOG folder, its meta.json, or a `.sog` zip, in the file's own frame and unit.

    Raises:
        FormatError: a texture is missing, damaged or too small, or meta.json does not fit.
        OSError: a file cannot be read.
    """
    return intact(path, read_sog_blocks(path))


def read_sog_blocks(path: Path, rows: int = ROWS_PER_BLOCK) -> SplatBlocks:
    """As `read_sog`, `rows` splats at a time; bad values are found when their block is read.

    Textures can only be unpacked whole, so all of them are kept in memory: 4 bytes a splat each.
    """
    source = _Source(path.parent if path.name == META else path)
    try:
        columns = _columns(source, json.loads(source.read(META)))
    except FormatError:
        raise
    except _MISFIT as error:
        raise refusal(
            path,
            META,
            f"{type(error).__name__}: {error}",
            "the file is damaged or of another version, export it again",
        ) from None
    blocks = (_decode(columns, *extent) for extent in extents(columns.count, rows))
    return without_bad_rows(path, SplatBlocks(columns.count, SH_COUNTS.index(columns.k), blocks))


@dataclass(frozen=True, slots=True)
class _Source:
    """Folder or zip that holds the files of one SOG."""

    path: Path

    def read(self, name: str) -> bytes:
        if not name or set(name) & set("/\\:\0") or name in (".", ".."):
            raise refusal(self.path, META, f"file name {name!r:.80}", "do not trust this file")
        limit = MAX_META_BYTES if name == META else MAX_FILE_BYTES
        if self.path.is_dir():
            file = self.path / name
            if not file.is_file() or file.stat().st_size > limit:
                raise refusal(
                    self.path, name, "missing or too large", "copy or export the folder again"
                )
            return file.read_bytes()
        try:
            with zipfile.ZipFile(self.path) as archive:
                entry = archive.getinfo(name)
                if entry.file_size > limit or entry.compress_type not in _METHODS:
                    raise refusal(
                        self.path,
                        name,
                        f"{entry.file_size} bytes by method {entry.compress_type}, limits {limit} "
                        "and stored or deflated",
                        "give a SOG file",
                    )
                return archive.read(name)
        except KeyError:
            raise refusal(self.path, name, "not in the zip", "give a SOG file") from None
        except FormatError:
            raise
        except _BAD_ZIP as error:
            raise refusal(
                self.path, name, f"{error}", "the file is truncated, copy or export it again"
            ) from None

    def texture(self, name: str) -> Bytes:
        """(H, W, 4) RGBA."""
        data = self.read(name)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", Image.DecompressionBombWarning)
                picture = Image.open(io.BytesIO(data), formats=("WEBP", "PNG"))
            if picture.width * picture.height > MAX_PIXELS:
                raise refusal(
                    self.path, name, f"{picture.size} pixels", f"limit {MAX_PIXELS} in all"
                )
            return np.asarray(picture.convert("RGBA"))
        except (OSError, SyntaxError, Image.DecompressionBombError) as error:
            raise refusal(
                self.path, name, f"{error}", "the texture is damaged, copy or export it again"
            ) from None

    def pixels(self, name: str, count: int) -> Bytes:
        """(count, 4) first pixels in row-major order."""
        rgba = self.texture(name).reshape(-1, 4)
        if len(rgba) < count:
            raise refusal(
                self.path, name, f"{len(rgba)} pixels for {count} splats", "export it again"
            )
        # A copy, so that a large texture for few splats is not kept.
        return rgba[:count].copy()


@dataclass(frozen=True, slots=True)
class _Columns:
    """The splats of a SOG still packed; each column unpacks a range of rows.

    Attributes:
        count: splats.
        k: coefficients of the spherical harmonics.
        means: (n, 3) positions.
        log_scales: (n, 3).
        rotations: (n, 4) RGBA of the three smallest components and the tag.
        dc: (n, 3) coefficients of degree 0.
        opacities: (n,) 0..1.
        higher: (n, k - 1, 3) coefficients above degree 0, if there are any.
    """

    count: int
    k: int
    means: Column
    log_scales: Column
    rotations: Bytes
    dc: Column
    opacities: Column
    higher: Column | None


def _columns(source: _Source, meta: dict[str, Any]) -> _Columns:
    version = meta.get("version", 1)
    if version not in (1, 2):
        raise refusal(
            source.path, META, f"SOG version {version!r}, wanted 1 or 2", "update this program"
        )
    coded = version == 2
    count = meta["count"] if coded else meta["means"]["shape"][0]
    if type(count) is not int or not 0 <= count <= MAX_PIXELS:
        raise refusal(
            source.path, META, f"{count!r} splats, limit {MAX_PIXELS}", "the file is damaged"
        )
    rgba = source.pixels(meta["sh0"]["files"][0], count)
    scale_pixels = source.pixels(meta["scales"]["files"][0], count)[:, :3]
    if coded:
        log_scales = _look_up(_codebook(meta["scales"]["codebook"]), scale_pixels)
        dc = _look_up(_codebook(meta["sh0"]["codebook"]), rgba[:, :3])
        opacities: Column = lambda rows: rgba[rows, 3] / np.float32(255.0)  # noqa: E731
    else:
        low, high = _limits(meta["sh0"], 4)
        log_scales = _between(*_limits(meta["scales"], 3), scale_pixels)
        dc = _between(low[:3], high[:3], rgba[:, :3])
        logits = _between(low[3:], high[3:], rgba[:, 3:])
        opacities = lambda rows: sigmoid(logits(rows)[:, 0].astype(np.float32))  # noqa: E731
    k, higher = 1, None
    if meta.get("shN"):
        k, higher = _higher(source, meta["shN"], count, coded=coded)
    return _Columns(
        count,
        k,
        _means(source, meta["means"], count),
        log_scales,
        _rotations(source, meta["quats"]["files"][0], count),
        dc,
        opacities,
        higher,
    )


@damaged_values_are_quiet
def _decode(columns: _Columns, start: int, stop: int) -> SplatCloud:
    rows = slice(start, stop)
    sh = columns.dc(rows)[:, None, :]
    if columns.higher is not None:
        sh = np.concatenate([sh, columns.higher(rows)], axis=1)
    rgba = columns.rotations[rows]
    three = (rgba[:, :3] / 255.0 * 2.0 - 1.0) * np.sqrt(0.5)
    largest = rgba[:, 3].astype(np.intp) - FIRST_TAG
    return cloud_from_file(
        means=columns.means(rows).astype(np.float32),
        scales=exponential(columns.log_scales(rows).astype(np.float32)),
        quaternions=rotations_from_three(three, largest),
        opacities=columns.opacities(rows).astype(np.float32),
        sh=sh.astype(np.float32),
    )


def _means(source: _Source, meta: dict[str, Any], count: int) -> Column:
    low, high = _limits(meta, 3)
    fine, coarse = (source.pixels(name, count)[:, :3] for name in meta["files"][:2])

    def unpack(rows: slice) -> Floats:
        level = fine[rows].astype(np.uint32) | coarse[rows].astype(np.uint32) << 8
        stored = low + (high - low) * (level / 65535.0)
        return np.sign(stored) * np.expm1(np.abs(stored))

    return unpack


def _rotations(source: _Source, name: str, count: int) -> Bytes:
    rgba = source.pixels(name, count)
    bad = rgba[:, 3] < FIRST_TAG
    if bad.any():
        first = int(np.argmax(bad))
        raise refusal(
            source.path,
            f"{name}, splat {first}",
            f"rotation tag {rgba[first, 3]}, wanted {FIRST_TAG} to 255",
            "the texture is damaged or was saved with losses, export it again",
        )
    return rgba


def _higher(
    source: _Source, meta: dict[str, Any], count: int, *, coded: bool
) -> tuple[int, Column]:
    """K, and the (n, K - 1, 3) coefficients above degree 0 from the palette."""
    centroids = source.texture(meta["files"][0])[:, :, :3]
    rgba = source.pixels(meta["files"][1], count)
    labels = rgba[:, 0].astype(np.uint16) | rgba[:, 1].astype(np.uint16) << 8
    k = centroids.shape[1] // PALETTE_COLUMNS
    if centroids.shape[1] % PALETTE_COLUMNS or k + 1 not in SH_COUNTS[1:]:
        raise refusal(
            source.path,
            meta["files"][0],
            f"palette {centroids.shape[1]} pixels wide, wanted {PALETTE_COLUMNS} × 3, 8 or 15",
            "export it again",
        )
    palette = centroids.reshape(-1, k, 3)
    if count and labels.max() >= len(palette):
        raise refusal(
            source.path,
            f"{meta['files'][1]}, splat {int(np.argmax(labels))}",
            f"palette entry {labels.max()}, there are {len(palette)}",
            "export it again",
        )
    if coded:
        book = _codebook(meta["codebook"])
        return k + 1, lambda rows: book[palette[labels[rows]]]
    low, high = float(meta["mins"]), float(meta["maxs"])
    return k + 1, lambda rows: low + (high - low) * (palette[labels[rows]] / 255.0)


def _look_up(book: Floats, pixels: Bytes) -> Column:
    return lambda rows: book[pixels[rows]]


def _between(low: Floats, high: Floats, pixels: Bytes) -> Column:
    return lambda rows: low + (high - low) * (pixels[rows] / 255.0)


def _codebook(values: Sequence[Any]) -> Floats:
    book = np.array(values, dtype=np.float64)
    if book.shape != (256,):
        raise ValueError(f"codebook of shape {book.shape}, wanted 256 numbers")
    return book


def _limits(meta: dict[str, Any], count: int) -> tuple[Floats, Floats]:
    low, high = (np.array(meta[name], dtype=np.float64) for name in ("mins", "maxs"))
    if low.shape != (count,) or high.shape != (count,):
        raise ValueError(f"bounds of shapes {low.shape} and {high.shape}, wanted {count} numbers")
    return low, high
