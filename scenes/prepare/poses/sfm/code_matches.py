"""Matches between two different printed codes, which are none.

Symbols share their finder patterns, their sheets a frame: on plain walls 84 features of one code
agreed with those of a code on another wall, and half of a room was turned by a quarter. What the
codes say tells them apart.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.prepare.align.codes.anchors import april_tags, qr_codes

FloatArray = NDArray[np.float64]
Matches = NDArray[np.uint32]
"""(M, 2) places of features in the first and the second picture."""

SHEET = 1.5
"""Of a sheet's side to its symbol's: a quiet zone of four modules of 21 makes 1.4, and features of
the sheet's edge lie beside it."""

NO_CODE = -1
"""Label of a feature beside all codes."""


@dataclass(frozen=True, slots=True, eq=False)
class Sheet:
    """A printed code that could be read in a picture.

    Attributes:
        payload: what it says.
        corners_px: (4, 2) of its symbol, around.
    """

    payload: str
    corners_px: FloatArray


def sheets_in(folder: Path, names: Sequence[str]) -> dict[str, tuple[Sheet, ...]]:
    """Codes that can be read, by picture; a hundredth of a second a picture."""
    sheets: dict[str, tuple[Sheet, ...]] = {}
    for name in names:
        grey = cv2.imread(str(folder / name), cv2.IMREAD_GRAYSCALE)
        if grey is not None:
            picture = np.asarray(grey, dtype=np.uint8)
            found = [*qr_codes(picture), *april_tags(picture)]
            sheets[name] = tuple(Sheet(code.payload, code.corners_px) for code in found)
    return sheets


def labels_of(
    keypoints: FloatArray, sheets: Sequence[Sheet], *, numbers: Mapping[str, int]
) -> NDArray[np.intp]:
    """(K,) number of the code on whose sheet each feature lies, or `NO_CODE`.

    Args:
        keypoints: (K, 2) px.
        sheets: of the picture.
        numbers: by payload.
    """
    labels = np.full(len(keypoints), NO_CODE, dtype=np.intp)
    for sheet in sheets:
        middle = sheet.corners_px.mean(axis=0)
        corners = middle + SHEET * (sheet.corners_px - middle)
        edges = np.roll(corners, -1, axis=0) - corners
        apart = keypoints[:, None] - corners
        side = edges[:, 0] * apart[..., 1] - edges[:, 1] * apart[..., 0]
        inside = (side >= 0).all(axis=1) | (side <= 0).all(axis=1)
        labels[inside] = numbers[sheet.payload]
    return labels


def drop_mixed_codes(
    database: Any, pairs: Sequence[tuple[str, str]], *, sheets: Mapping[str, Sequence[Sheet]]
) -> list[tuple[str, str]]:
    """Pairs of pictures whose matches between different codes were dropped, to be verified anew.

    Args:
        database: COLMAP's, with matches; changed where there are such.
        pairs: names of matched pictures.
        sheets: codes that were read, by picture.
    """
    payloads = sorted({sheet.payload for found in sheets.values() for sheet in found})
    numbers = {payload: number for number, payload in enumerate(payloads)}
    shown = {name for name, found in sheets.items() if found}
    asked = [pair for pair in pairs if shown.issuperset(pair)] if len(payloads) > 1 else []
    images = {name: database.read_image_with_name(name).image_id for pair in asked for name in pair}
    labels = {
        name: labels_of(
            np.asarray(database.read_keypoints(image).data)[:, :2].astype(np.float64),
            sheets[name],
            numbers=numbers,
        )
        for name, image in images.items()
    }
    changed: list[tuple[str, str]] = []
    for pair in asked:
        first, second = (images[name] for name in pair)
        matches: Matches = np.asarray(database.read_matches(first, second), dtype=np.uint32)
        if not len(matches):
            continue
        a, b = (labels[name][matches[:, side]] for side, name in enumerate(pair))
        mixed = (a != NO_CODE) & (b != NO_CODE) & (a != b)
        if mixed.any():
            database.delete_matches(first, second)
            database.write_matches(first, second, matches[~mixed])
            if database.exists_two_view_geometry(first, second):
                database.delete_two_view_geometry(first, second)
            changed.append(pair)
    return changed
