# pyright: standard
"""Printed codes in the photos of a reconstruction: found, read and measured.

QR codes are read by zxing-cpp, AprilTags by OpenCV; both only give a start. Where a code is known
from two photos, it is also looked for in photos that are too far or too slanted to read it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import cv2
import numpy as np
import zxingcpp
from numpy.typing import NDArray

from scenes.cameras import Pinhole
from scenes.prepare.align.codes.corners import Corners, refine_corners
from scenes.prepare.align.codes.symbols import Symbol, april_tag, symbol_of
from scenes.prepare.align.codes.triangulate import find_square, predicted_corners
from scenes.prepare.progress import Progress, silent
from scenes.prepare.reconstruction import Reconstruction, View, read_picture

FloatArray = NDArray[np.float64]

QR_FORMATS = zxingcpp.barcode_formats_from_str("QRCodeModel2")

ENLARGED_UP_TO_PX = 2_500_000
"""Pictures of so many pixels are also read at twice their size."""

MIN_CORRELATION = 0.85
"""Photo and prediction correlate more than this, or the code is covered or is not there."""

MIN_CORRELATION_UNREAD = 0.93
"""The same where the code could not be read, but is expected."""

MAX_BLUR_MODULES = 0.7
MIN_MODULE_PX = 1.1
"""Modules smaller than this (on the short side) are not measured."""


@dataclass(frozen=True, slots=True, eq=False)
class Sighting:
    """A code's corners in one photo.

    Attributes:
        view: name of the photo.
        corners_px: (4, 2) px: top left, top right, bottom right, bottom left as printed.
        sigma_px: (4,) standard deviation of each corner.
        was_read: whether the code was read there, not only expected there.
    """

    view: str
    corners_px: FloatArray
    sigma_px: FloatArray
    was_read: bool


@dataclass(frozen=True, slots=True)
class Refusal:
    """A photo that shows a code but is not used for it, and why."""

    view: str
    reason: str


@dataclass(frozen=True, slots=True, eq=False)
class AnchorSightings:
    """Everything the photos say about one printed code."""

    payload: str
    symbol: Symbol | None
    sightings: tuple[Sighting, ...]
    refusals: tuple[Refusal, ...] = ()


@dataclass(slots=True)
class _Gathered:
    symbol: Symbol | None = None
    sightings: list[Sighting] = field(default_factory=list)
    refusals: list[Refusal] = field(default_factory=list)


@dataclass(frozen=True, slots=True, eq=False)
class CodeCandidate:
    """A code as a reader gives it: what it says, and corners (4, 2) to whole pixels.

    It is seen in a mirror where there is no symbol.
    """

    payload: str
    symbol: Symbol | None
    corners_px: FloatArray


def find_anchors(
    reconstruction: Reconstruction, *, progress: Progress = silent
) -> tuple[AnchorSightings, ...]:
    """Every printed code in the photos, by payload.

    Args:
        reconstruction: photos with poses; codes are measured in pinhole photos only.
        progress: called after each photo.

    Raises:
        ValueError: a photo cannot be read.
    """
    found: dict[str, _Gathered] = {}
    views = reconstruction.views
    for number, view in enumerate(views):
        for payload, outcome, symbol in _in_photo(view):
            gathered = found.setdefault(payload, _Gathered())
            gathered.symbol = gathered.symbol or symbol
            if isinstance(outcome, Sighting):
                gathered.sightings.append(outcome)
            else:
                gathered.refusals.append(outcome)
        progress(0.6 * (number + 1) / len(views), f"Looking for codes in {view.name}")
    _look_again(views, found, progress)
    return tuple(
        AnchorSightings(payload, g.symbol, tuple(g.sightings), tuple(g.refusals))
        for payload, g in sorted(found.items())
    )


def _in_photo(view: View) -> list[tuple[str, Sighting | Refusal, Symbol | None]]:
    if not isinstance(view.camera, Pinhole):
        return []
    grey = _grey(view)
    candidates = [*qr_codes(grey), *april_tags(grey)]
    payloads = [c.payload for c in candidates]
    results: list[tuple[str, Sighting | Refusal, Symbol | None]] = []
    for candidate in candidates:
        if payloads.count(candidate.payload) > 1:
            reason = "it is there more than once; every print needs a payload of its own"
            outcome: Sighting | Refusal = Refusal(view.name, reason)
        elif candidate.symbol is None:
            reason = "it is mirrored; switch off the front camera's mirror picture and film again"
            outcome = Refusal(view.name, reason)
        else:
            outcome = measure_code(
                view.name, grey, candidate.symbol, candidate.corners_px, was_read=True
            )
        results.append((candidate.payload, outcome, candidate.symbol))
    return results


def _grey(view: View) -> NDArray[np.uint8]:
    return np.asarray(cv2.cvtColor(read_picture(view), cv2.COLOR_RGB2GRAY), dtype=np.uint8)


def qr_codes(grey: NDArray[np.uint8]) -> list[CodeCandidate]:
    """Read codes with corners as zxing-cpp gives them: whole pixels.

    A picture that is not large is read at twice its size as well, where smaller codes are read.
    """
    found = _read(grey, 1)
    if grey.size <= ENLARGED_UP_TO_PX:
        height, width = grey.shape
        large = cv2.resize(grey, (2 * width, 2 * height), interpolation=cv2.INTER_CUBIC)
        known = {c.payload for c in found}
        found += [c for c in _read(np.asarray(large, np.uint8), 2) if c.payload not in known]
    return found


def _read(grey: NDArray[np.uint8], enlarged: int) -> list[CodeCandidate]:
    found = []
    for barcode in zxingcpp.read_barcodes(grey, formats=QR_FORMATS):
        p = barcode.position
        corners = [(c.x, c.y) for c in (p.top_left, p.top_right, p.bottom_right, p.bottom_left)]
        corners_px = np.array(corners, dtype=np.float64) / enlarged
        found.append(CodeCandidate(barcode.text, symbol_of(barcode), corners_px))
    return found


def april_tags(grey: NDArray[np.uint8]) -> list[CodeCandidate]:
    """Find tags of the family 36h11, with corners as OpenCV gives them."""
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    corners, numbers, _ = cv2.aruco.ArucoDetector(family).detectMarkers(grey)
    if numbers is None:
        return []
    symbols = [april_tag(int(number)) for number in np.ravel(numbers)]
    return [
        CodeCandidate(symbol.payload, symbol, c.reshape(4, 2).astype(np.float64) + 0.5)
        for symbol, c in zip(symbols, corners, strict=True)
    ]


def measure_code(
    view: str,
    grey: NDArray[np.uint8],
    symbol: Symbol,
    start_px: FloatArray,
    *,
    was_read: bool,
    is_close: bool = False,
) -> Sighting | Refusal:
    """Measure a code's corners in a picture: the sighting, or why there is none.

    Args:
        view: name of the picture.
        grey: (H, W) its luminance.
        symbol: what is printed there.
        start_px: (4, 2) corners, right to half a module.
        was_read: whether the code was read there, not only expected there.
        is_close: whether the corners are right to a tenth of a module.
    """
    shortest = float(np.linalg.norm(start_px - np.roll(start_px, 1, axis=0), axis=1).min())
    if shortest < MIN_MODULE_PX * symbol.modules:
        return Refusal(
            view,
            f"its shortest side is {shortest:.0f} px, limit "
            f"{MIN_MODULE_PX * symbol.modules:.0f}; come nearer or film it less from the side",
        )
    corners = refine_corners(grey, symbol, start_px, is_close=is_close)
    reason = _why_not(corners, start_px, MIN_CORRELATION if was_read else MIN_CORRELATION_UNREAD)
    if corners is None or reason:
        return Refusal(view, reason)
    return Sighting(view, corners.pixels, corners.sigma_px, was_read)


def _why_not(corners: Corners | None, start_px: FloatArray, min_correlation: float) -> str:
    if corners is None:
        return "its pattern could not be matched; part of it is outside the photo or covered"
    if corners.blur_modules > MAX_BLUR_MODULES:
        return (
            f"it is blurred over {corners.blur_modules:.1f} modules, limit {MAX_BLUR_MODULES}; "
            "hold still or come nearer"
        )
    if corners.correlation < min_correlation:
        return (
            f"it looks only {100 * corners.correlation:.0f} % like what is printed, limit "
            f"{100 * min_correlation:.0f} %; it is blurred, glaring or covered in part"
        )
    moved = float(np.linalg.norm(corners.pixels - start_px, axis=1).max())
    side = float(np.linalg.norm(start_px - np.roll(start_px, 1, axis=0), axis=1).max())
    if moved > 0.2 * side + 2.0:
        return f"its pattern was matched {moved:.0f} px away from where it was seen"
    return ""


def _look_again(views: tuple[View, ...], found: dict[str, _Gathered], progress: Progress) -> None:
    """Codes with a known place, in the photos that show them without their having been read."""
    by_name = {view.name: view for view in views}
    expected: dict[str, list[tuple[_Gathered, Symbol, FloatArray]]] = {}
    for gathered in found.values():
        if gathered.symbol is None:
            continue
        square = find_square(
            [by_name[s.view] for s in gathered.sightings],
            [s.corners_px for s in gathered.sightings],
        )
        if square is None:
            continue
        known = {s.view for s in gathered.sightings} | {r.view for r in gathered.refusals}
        for view in views:
            corners = predicted_corners(square.reconstruction_from_code, view)
            if view.name not in known and corners is not None:
                expected.setdefault(view.name, []).append((gathered, gathered.symbol, corners))
    for number, (name, wanted) in enumerate(expected.items()):
        view = by_name[name]
        if isinstance(view.camera, Pinhole):
            grey = _grey(view)
            for gathered, symbol, corners in wanted:
                outcome = measure_code(name, grey, symbol, corners, was_read=False)
                if isinstance(outcome, Sighting) and _is_near(outcome.corners_px, corners, symbol):
                    gathered.sightings.append(outcome)
        progress(0.6 + 0.4 * (number + 1) / len(expected), f"Looking again in {name}")
    order = {view.name: k for k, view in enumerate(views)}
    for gathered in found.values():
        gathered.sightings.sort(key=lambda s: order[s.view])
    progress(1.0, "Codes found")


def _is_near(corners_px: FloatArray, expected_px: FloatArray, symbol: Symbol) -> bool:
    side = math.sqrt(float(((expected_px - np.roll(expected_px, 1, axis=0)) ** 2).sum()) / 4)
    off = float(np.linalg.norm(corners_px - expected_px, axis=1).max())
    return off < max(2.0, 1.5 * side / symbol.modules)
