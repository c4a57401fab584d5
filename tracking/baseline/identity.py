"""Which detection is which object, and what can be seen of it (paper 4.4.1)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from tracking.baseline.detect import Detection

GATE_PX = 100.0
"""A detection farther from the object's last place is not it (paper)."""

SIZE_CHANGE = 0.20
"""A box that changes more than this between frames is partly hidden (paper)."""

MOTION_PX = 3.0
"""A box centre that moved more than this since the last pose has moved (not given in the paper)."""


class Visibility(StrEnum):
    """What the identity layer says about an object in a frame."""

    VISIBLE = "visible"
    PARTIAL = "partially occluded"
    HIDDEN = "fully occluded"


@dataclass(frozen=True, slots=True, eq=False)
class Track2D:
    """An object in the picture.

    Attributes:
        object_id: which object.
        centre_px: (2,) last known box centre.
        size_px: (2,) last known box size.
        settled_px: (2,) box centre when its pose was last estimated.
        visibility: in the latest frame.
        moved: whether it is far enough from `settled_px` to need a new pose.
        detection: in the latest frame, or None.
    """

    object_id: str
    centre_px: NDArray[np.float64]
    size_px: NDArray[np.float64]
    settled_px: NDArray[np.float64]
    visibility: Visibility
    moved: bool
    detection: Detection | None


def begin_track(object_id: str, detection: Detection) -> Track2D:
    """A track of an object that the user, or the ray association, found in this detection."""
    centre = detection.centre_px()
    return Track2D(
        object_id, centre, detection.size_px(), centre, Visibility.VISIBLE, False, detection
    )


def update_tracks(
    tracks: Mapping[str, Track2D], detections: Sequence[Detection]
) -> Mapping[str, Track2D]:
    """Give every track its nearest detection within the gate, the nearest pairs first.

    Args:
        tracks: by object id.
        detections: of the new frame, in any order and without regard to labels.
    """
    centres = [d.centre_px() for d in detections]
    pairs = sorted(
        (float(np.linalg.norm(track.centre_px - centre)), object_id, index)
        for object_id, track in tracks.items()
        for index, centre in enumerate(centres)
    )
    chosen: dict[str, int] = {}
    taken: set[int] = set()
    for distance, object_id, index in pairs:
        if distance <= GATE_PX and object_id not in chosen and index not in taken:
            chosen[object_id] = index
            taken.add(index)
    updated = {
        object_id: _next(track, detections[chosen[object_id]] if object_id in chosen else None)
        for object_id, track in tracks.items()
    }
    return MappingProxyType(updated)


def settle(track: Track2D) -> Track2D:
    """The track after its pose was estimated: motion counts from here."""
    return Track2D(
        track.object_id,
        track.centre_px,
        track.size_px,
        track.centre_px,
        track.visibility,
        False,
        track.detection,
    )


def _next(track: Track2D, detection: Detection | None) -> Track2D:
    if detection is None:
        return Track2D(
            track.object_id,
            track.centre_px,
            track.size_px,
            track.settled_px,
            Visibility.HIDDEN,
            False,
            None,
        )
    centre, size = detection.centre_px(), detection.size_px()
    change = np.abs(size - track.size_px) / np.maximum(track.size_px, 1.0)
    partial = bool((change > SIZE_CHANGE).any())
    moved = float(np.linalg.norm(centre - track.settled_px)) > MOTION_PX
    return Track2D(
        track.object_id,
        centre,
        size,
        track.settled_px,
        Visibility.PARTIAL if partial else Visibility.VISIBLE,
        moved,
        detection,
    )
