"""Any picture file as pixels: upright as its metadata say, or as it is stored."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import ExifTags, Image

from scenes.formats.storage.atomic import write_file

HEIF_SUFFIXES = frozenset({".heic", ".heif", ".hif", ".avif"})
"""Formats that phones store instead of JPEG."""
UPRIGHT = 1
"""EXIF's number for a picture that is shown as it is stored."""
APP1, START_OF_SCAN = b"\xe1", b"\xda"
BRAND = slice(8, 12)
HEIF_BRANDS = frozenset(
    {b"heic", b"heix", b"heim", b"heis", b"hevc", b"hevx", b"mif1", b"msf1", b"avif", b"avis"}
)
"""Source: ISO/IEC 23008-12, annexes B and E, and the AV1 Image File Format."""


def read_upright(file: Path) -> NDArray[np.uint8] | None:
    """(H, W, 3) BGR turned as its metadata say, or None if it is no readable picture."""
    return _read(file, cv2.IMREAD_COLOR)


def read_stored(file: Path) -> NDArray[np.uint8] | None:
    """(H, W, 3) BGR as it is stored, or None: poses that come from elsewhere are of those pixels.

    A HEIF file has no other orientation than the one it is shown in.
    """
    return _read(file, cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)


def forget_turn(file: Path) -> None:
    """Take the metadata out of a picture that would be shown turned; its pixels stay as they are.

    Raises:
        OSError: it cannot be read or written.
    """
    with Image.open(file) as opened:
        turn = opened.getexif().get(ExifTags.Base.Orientation, UPRIGHT)
        kind = opened.format
    if turn == UPRIGHT:
        return
    if kind == "JPEG":
        write_file(file, [without_exif(file.read_bytes())])
        return
    stored = read_stored(file)
    if stored is not None:
        cv2.imwrite(str(file), stored)


def without_exif(jpeg: bytes) -> bytes:
    """A JPEG file without its EXIF segments; nothing is decoded.

    Source: ITU-T T.81, B.1.1; segments end where the first scan begins.
    """
    kept, at = [jpeg[:2]], 2
    while jpeg[at : at + 1] == b"\xff" and jpeg[at + 1 : at + 2] != START_OF_SCAN:
        size = 2 + int.from_bytes(jpeg[at + 2 : at + 4], "big")
        segment = jpeg[at : at + size]
        if not (segment[1:2] == APP1 and segment[4:8] == b"Exif"):
            kept.append(segment)
        at += size
    return b"".join([*kept, jpeg[at:]])


def _read(file: Path, flags: int) -> NDArray[np.uint8] | None:
    try:
        data = np.fromfile(file, dtype=np.uint8)
    except OSError:
        return None
    if not len(data):
        return None
    if is_heif(data[: BRAND.stop].tobytes()):
        return _read_heif(file)
    try:
        picture = cv2.imdecode(data, flags)
    except cv2.error:
        return None
    return None if picture is None else np.asarray(picture, dtype=np.uint8)


def is_heif(head: bytes) -> bool:
    """Whether a file that begins so is a picture in an ISO container, whatever it is called."""
    return head[4:8] == b"ftyp" and head[BRAND] in HEIF_BRANDS


def _read_heif(file: Path) -> NDArray[np.uint8] | None:
    reads_heif()
    try:
        with Image.open(file) as opened:
            return np.ascontiguousarray(np.asarray(opened.convert("RGB"))[..., ::-1])
    except (OSError, ValueError, SyntaxError):
        return None


def reads_heif() -> bool:
    """Whether HEIC files can be read here: the library for it has no wheel for every machine."""
    try:
        library: Any = importlib.import_module("pi_heif")
    except ImportError:
        return False
    library.register_heif_opener()
    return True
