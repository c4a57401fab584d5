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
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from scenes.formats.activation import (
    cloud_from_file,
    damaged_values_are_quiet,
    exponential,
    rotations_from_three,
    sigmoid,
)
from scenes.formats.error import FormatError, refusal
from scenes.splats import SH_COUNTS, SplatCloud

META = "meta.json"
MAX_PIXELS = 2**26
MAX_FILE_BYTES = 2**29
PALETTE_COLUMNS = 64
FIRST_TAG = 252

Bytes = NDArray[np.uint8]
Floats = NDArray[np.float64]


def is_sog_folder(path: Path) -> bool:
    """Whether this folder holds a SOG: its meta.json lists position textures."""
    if not (path / META).is_file():
        return False
    try:
        meta = json.loads((path / META).read_bytes()[:MAX_FILE_BYTES])
    except ValueError:
        return False
    return isinstance(meta, dict) and isinstance(meta.get("means"), dict)


@damaged_values_are_quiet
def read_sog(path: Path) -> SplatCloud:
    """Read a SOG folder, its meta.json, or a `.sog` zip, in the file's own frame and unit.

    Raises:
        FormatError: a texture is missing, damaged or too small, or meta.json does not fit.
        OSError: a file cannot be read.
    """
    source = _Source(path.parent if path.name == META else path)
    try:
        meta = json.loads(source.read(META))
        return _decode(source, meta)
    except FormatError:
        raise
    except (KeyError, IndexError, TypeError, ValueError, OverflowError) as error:
        raise refusal(
            path,
            META,
            f"{type(error).__name__}: {error}",
            "the file is damaged or of another version, export it again",
        ) from None


@dataclass(frozen=True, slots=True)
class _Source:
    """Where the files of one SOG are: a folder or a zip."""

    path: Path

    def read(self, name: str) -> bytes:
        if not name or set(name) & set("/\\:\0") or name in (".", ".."):
            raise refusal(self.path, META, f"file name {name!r:.80}", "do not trust this file")
        if self.path.is_dir():
            file = self.path / name
            if not file.is_file() or file.stat().st_size > MAX_FILE_BYTES:
                raise refusal(
                    self.path, name, "missing or too large", "copy or export the folder again"
                )
            return file.read_bytes()
        try:
            with zipfile.ZipFile(self.path) as archive:
                if archive.getinfo(name).file_size > MAX_FILE_BYTES:
                    raise refusal(self.path, name, "too large", "give a SOG file")
                return archive.read(name)
        except KeyError:
            raise refusal(self.path, name, "not in the zip", "give a SOG file") from None
        except (zipfile.BadZipFile, EOFError, NotImplementedError, RuntimeError) as error:
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
        return rgba[:count]


def _decode(source: _Source, meta: dict[str, Any]) -> SplatCloud:
    version = meta.get("version", 1)
    if version not in (1, 2):
        raise refusal(
            source.path, META, f"SOG version {version!r}, wanted 1 or 2", "update this program"
        )
    coded = version == 2
    count = meta["count"] if coded else meta["means"]["shape"][0]
    if not isinstance(count, int) or not 0 <= count <= MAX_PIXELS:
        raise refusal(
            source.path, META, f"{count!r} splats, limit {MAX_PIXELS}", "the file is damaged"
        )
    colour_and_alpha = source.pixels(meta["sh0"]["files"][0], count)
    scale_pixels = source.pixels(meta["scales"]["files"][0], count)[:, :3]
    if coded:
        log_scales = _codebook(meta["scales"]["codebook"])[scale_pixels]
        dc = _codebook(meta["sh0"]["codebook"])[colour_and_alpha[:, :3]]
        opacities = colour_and_alpha[:, 3].astype(np.float32) / np.float32(255.0)
    else:
        log_scales = _between(meta["scales"], scale_pixels)
        values = _between(meta["sh0"], colour_and_alpha)
        dc, opacities = values[:, :3], sigmoid(values[:, 3].astype(np.float32))
    higher = _higher(source, meta["shN"], count, coded=coded) if meta.get("shN") else None
    sh = dc[:, None, :] if higher is None else np.concatenate([dc[:, None, :], higher], axis=1)
    return cloud_from_file(
        source.path,
        means=_means(source, meta["means"], count),
        scales=exponential(log_scales.astype(np.float32)),
        quaternions=_rotations(source, meta["quats"]["files"][0], count),
        opacities=opacities,
        sh=sh.astype(np.float32),
    )


def _means(source: _Source, meta: dict[str, Any], count: int) -> NDArray[np.float32]:
    low, high = (source.pixels(name, count)[:, :3].astype(np.uint32) for name in meta["files"][:2])
    stored = _bounds(meta["mins"], meta["maxs"], 3, (low | high << 8) / 65535.0)
    return (np.sign(stored) * np.expm1(np.abs(stored))).astype(np.float32)


def _rotations(source: _Source, name: str, count: int) -> NDArray[np.float32]:
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
    three = (rgba[:, :3] / 255.0 * 2.0 - 1.0) * np.sqrt(0.5)
    return rotations_from_three(source.path, three, rgba[:, 3].astype(np.intp) - FIRST_TAG)


def _higher(source: _Source, meta: dict[str, Any], count: int, *, coded: bool) -> Floats:
    """(N, K - 1, 3) coefficients above degree 0 from the palette."""
    centroids = source.texture(meta["files"][0])[:, :, :3]
    rgba = source.pixels(meta["files"][1], count)
    labels = rgba[:, 0].astype(np.intp) | rgba[:, 1].astype(np.intp) << 8
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
        return _codebook(meta["codebook"])[palette[labels]]
    low, high = float(meta["mins"]), float(meta["maxs"])
    return low + (high - low) * (palette[labels].astype(np.float64) / 255.0)


def _codebook(values: Sequence[Any]) -> Floats:
    book = np.array(values, dtype=np.float64)
    if book.shape != (256,):
        raise ValueError(f"codebook of shape {book.shape}, wanted 256 numbers")
    return book


def _between(meta: dict[str, Any], pixels: Bytes) -> Floats:
    return _bounds(meta["mins"], meta["maxs"], pixels.shape[1], pixels / 255.0)


def _bounds(mins: Sequence[Any], maxs: Sequence[Any], count: int, share: Floats) -> Floats:
    low, high = np.array(mins, dtype=np.float64), np.array(maxs, dtype=np.float64)
    if low.shape != (count,) or high.shape != (count,):
        raise ValueError(f"bounds of shapes {low.shape} and {high.shape}, wanted {count} numbers")
    return low + (high - low) * share
