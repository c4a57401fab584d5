# pyright: standard
"""Printed symbols as exact module matrices: QR codes and AprilTags.

A QR code's modules follow from its payload, version, error correction level and mask alone. So a
decoded photo gives the whole printed square, which a photo can then be matched against.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, cast

import cv2
import numpy as np
import zxingcpp
from numpy.typing import NDArray

QR_QUIET_MODULES = 4
"""White border of a QR code, in modules (ISO/IEC 18004)."""

TAG_QUIET_MODULES = 1
"""White border of an AprilTag, in modules."""

TAG_PREFIX = "apriltag:36h11:"
TAG_COUNT = 587
"""Codes of the family 36h11."""

AGREEMENT = 0.9
"""A symbol written anew is believed if so many of the modules that were seen agree with it."""


@dataclass(frozen=True, slots=True, eq=False)
class Symbol:
    """A printed square of dark and light modules.

    Attributes:
        kind: which family it belongs to.
        payload: what it says; an AprilTag says `apriltag:36h11:<number>`.
        dark: (M, M) bool, row 0 on top, without the quiet zone; its outer edge is the printed side.
        quiet_modules: light border around it.
    """

    kind: Literal["qr", "apriltag"]
    payload: str
    dark: NDArray[np.bool_]
    quiet_modules: int

    def __post_init__(self) -> None:
        dark = np.array(self.dark, dtype=np.bool_)
        if dark.ndim != 2 or dark.shape[0] != dark.shape[1] or len(dark) < 8:
            raise ValueError(f"Symbol.dark: shape {dark.shape}, wanted a square of 8 or more")
        dark.setflags(write=False)
        object.__setattr__(self, "dark", dark)

    @property
    def modules(self) -> int:
        """Along one side, without the quiet zone."""
        return len(self.dark)

    def picture(self, *, module_px: int, dark: int = 0, light: int = 255) -> NDArray[np.uint8]:
        """The symbol in its quiet zone, (H, W) grey levels."""
        modules = np.pad(self.dark, self.quiet_modules)
        big = np.kron(modules, np.ones((module_px, module_px), dtype=np.bool_))
        return np.where(big, dark, light).astype(np.uint8)


def qr_symbol(
    payload: str, *, level: str = "M", version: int | None = None, mask: int | None = None
) -> Symbol:
    """The QR code that says `payload`.

    Args:
        payload: the shorter, the larger the modules: 14 characters fit version 1 at level M.
        level: error correction, one of L M Q H.
        version: 1 to 40; the smallest that holds the payload if not given.
        mask: 0 to 7; the best by the standard's own rule if not given.

    Raises:
        ValueError: the payload is empty or does not fit.
    """
    options: dict[str, str | int] = {"ec_level": level}
    if version is not None:
        options["version"] = version
    if mask is not None:
        options["data_mask"] = mask
    try:
        barcode = zxingcpp.create_barcode(payload, zxingcpp.BarcodeFormat.QRCode, **options)
    except ValueError as error:
        raise ValueError(f"QR code of {payload[:40]!r}: {error}; shorten the payload") from None
    return Symbol("qr", payload, _modules(barcode), QR_QUIET_MODULES)


def symbol_of(barcode: zxingcpp.Barcode) -> Symbol | None:
    """The exact symbol behind a decoded QR code, or None if it was seen mirrored.

    Written anew from what was decoded, because single modules may have been read wrong; an encoder
    that packs its payload another way is met by the modules as they were seen.
    """
    seen = _modules(barcode)
    extra = cast(dict[str, str], barcode.extra)
    written = qr_symbol(
        barcode.text,
        level=str(barcode.ec_level),
        version=int(extra["Version"]),
        mask=int(extra["DataMask"]),
    )
    if np.mean(written.dark == seen) >= AGREEMENT:
        return written
    format_cells = _format_cells(len(seen))
    agree = [np.mean(written.dark[format_cells] == way[format_cells]) for way in (seen, seen.T)]
    if agree[1] > agree[0]:
        return None
    return Symbol("qr", barcode.text, seen, QR_QUIET_MODULES)


def april_tag(number: int) -> Symbol:
    """AprilTag `number` of the family 36h11; its side is measured over the black border.

    Raises:
        ValueError: there is no such tag.
    """
    if not 0 <= number < TAG_COUNT:
        raise ValueError(f"AprilTag 36h11: number {number}, wanted 0 to {TAG_COUNT - 1}")
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    picture = cv2.aruco.generateImageMarker(family, number, 8)
    return Symbol("apriltag", f"{TAG_PREFIX}{number}", picture < 128, TAG_QUIET_MODULES)


def _modules(barcode: zxingcpp.Barcode) -> NDArray[np.bool_]:
    return np.asarray(barcode.to_image(scale=1, add_quiet_zones=False)) < 128


def _format_cells(modules: int) -> NDArray[np.bool_]:
    """Cells that hold level and mask: the same for every packing, and not the same mirrored.

    Source: ISO/IEC 18004, 7.9.
    """
    cells = np.zeros((modules, modules), dtype=np.bool_)
    around = [k for k in range(9) if k != 6]
    cells[8, around] = cells[around, 8] = True
    cells[8, modules - 8 :] = cells[modules - 8 :, 8] = True
    return cells
