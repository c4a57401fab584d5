"""Objects in a rectified picture: the `Detector` protocol and one that needs no network weights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from tracking.baseline.rectify import RectifiedView
from tracking.model.colours import ColourModel

BoolArray = NDArray[np.bool_]

SMALLEST_BLOB_PX = 40
"""Smaller blobs are noise."""

REACH = 0.25
"""A detection may lie this many box sides away from where its object was."""

PART_GAP_PX = 11
"""Parts of an object may be this far apart in its mask."""

MIN_COLOUR_SIMILARITY = 0.08
"""Pixels whose colour is less like the object's than this belong to something else."""


@dataclass(frozen=True, slots=True, eq=False)
class Detection:
    """One object found in a picture.

    Attributes:
        label: class name, or the object's id if the detector knows it.
        score: 0..1.
        box_px: (4,) left, top, right, bottom in pixels.
        mask: (H, W) bool, of the picture's size.
    """

    label: str
    score: float
    box_px: NDArray[np.float64]
    mask: BoolArray

    def centre_px(self) -> NDArray[np.float64]:
        """(2,) centre of the box."""
        return 0.5 * (self.box_px[:2] + self.box_px[2:])

    def size_px(self) -> NDArray[np.float64]:
        """(2,) width and height of the box."""
        return self.box_px[2:] - self.box_px[:2]


@dataclass(frozen=True, slots=True, eq=False)
class Expected:
    """An object as far as a detector may know it beforehand.

    Attributes:
        object_id: which object.
        label: class that a trained detector would give it.
        box_px: (4,) where it was last, or would be drawn.
        colours: what its pixels look like.
    """

    object_id: str
    label: str
    box_px: NDArray[np.float64]
    colours: ColourModel


class Detector(Protocol):
    """Finds objects in a rectified picture."""

    def detect(self, view: RectifiedView, expected: Sequence[Expected]) -> tuple[Detection, ...]:
        """Everything found; `expected` may help and may be ignored."""
        ...


class BackgroundDetector:
    """Finds differences to the empty room and splits them among the objects expected there.

    A blob may hold a person and an object at once: each pixel goes to the expected object that its
    colour and place fit best, or to nobody.
    """

    def detect(self, view: RectifiedView, expected: Sequence[Expected]) -> tuple[Detection, ...]:
        """One detection at most per expected object, labelled with its id.

        Raises:
            ValueError: the view was not compared with an empty room.
        """
        if view.difference is None:
            raise ValueError("BackgroundDetector: the view has no difference to the empty room")
        foreground = view.difference.mask() & view.valid
        pixel_scores = [_pixel_score(view, foreground, candidate) for candidate in expected]
        found: list[Detection] = []
        for index, candidate in enumerate(expected):
            mine = pixel_scores[index]
            for other_index, other in enumerate(pixel_scores):
                if other_index != index:
                    mine = np.where(other > mine, 0.0, mine)
            detection = _largest_blob(candidate.object_id, mine, view.difference.probability)
            if detection is not None:
                found.append(detection)
        return tuple(found)


def _pixel_score(
    view: RectifiedView, foreground: BoolArray, candidate: Expected
) -> NDArray[np.float32]:
    """(H, W) score of each pixel for an object: colour similarity times nearness."""
    scores = np.zeros(foreground.shape, np.float32)
    height, width = foreground.shape
    centre = 0.5 * (candidate.box_px[:2] + candidate.box_px[2:])
    side = np.maximum(candidate.box_px[2:] - candidate.box_px[:2], 8.0)
    reach = (0.5 + REACH) * side + 8.0
    left, top = np.floor(np.clip(centre - reach, 0, (width, height))).astype(int)
    right, bottom = np.ceil(np.clip(centre + reach, 0, (width, height))).astype(int)
    if right - left < 2 or bottom - top < 2:
        return scores
    window = (slice(top, bottom), slice(left, right))
    similarity = candidate.colours.colour_similarity(view.image[window])
    similarity = cv2.GaussianBlur(similarity, (5, 5), 1.2)
    y, x = np.mgrid[top:bottom, left:right] + 0.5
    apart = np.maximum(np.abs(x - centre[0]) / side[0], np.abs(y - centre[1]) / side[1])
    nearness = np.exp(-np.maximum(apart - 0.5, 0.0))
    accepted = foreground[window] & (similarity > MIN_COLOUR_SIMILARITY)
    scores[window] = np.where(accepted, similarity * nearness, 0.0)
    return scores


def _largest_blob(
    label: str, scores: NDArray[np.float32], probability: NDArray[np.float32]
) -> Detection | None:
    """The largest connected claim, with its holes closed."""
    mask = (scores > 0).astype(np.uint8)
    mask = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    if count < 2:
        return None
    areas = stats[1:, cv2.CC_STAT_AREA]
    largest = int(np.argmax(areas)) + 1
    if areas[largest - 1] < SMALLEST_BLOB_PX:
        return None
    # Thin legs and arm rests often come apart from the seat: keep what lies beside it.
    grown = cv2.dilate((labels == largest).astype(np.uint8), np.ones((PART_GAP_PX, PART_GAP_PX)))
    touching = np.unique(labels[(grown > 0) & (labels > 0)])
    parts = [part for part in touching if areas[part - 1] >= 0.03 * areas[largest - 1]]
    blob = np.isin(labels, parts)
    rows, columns = np.flatnonzero(blob.any(axis=1)), np.flatnonzero(blob.any(axis=0))
    box = np.array([columns[0], rows[0], columns[-1] + 1, rows[-1] + 1], dtype=np.float64)
    return Detection(label, float(probability[blob].mean()), box, blob)
