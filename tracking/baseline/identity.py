"""Identity of detections and visibility of objects (paper 4.4.1).

In the first frame a detection is the copy that the ray through its box centre hits (4.4.2).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Camera
from scenes.pose import Pose
from scenes.state import ObjectModel
from tracking.baseline.detect import Detection

GATE_PX = 100.0
"""A detection farther from the object's last place is not it (paper)."""

SIZE_CHANGE = 0.20
"""A box that changes more than this between frames is partly hidden (paper)."""

MOTION_PX = 3.0
"""A box centre that moved more than this since the last pose has moved (not given in the paper)."""


class Visibility(StrEnum):
    """Visibility of an object in a frame, by the identity layer."""

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


def ray_hits_box(
    origin: NDArray[np.float64],
    direction: NDArray[np.float64],
    *,
    world_from_object: Pose,
    box_m: tuple[float, float, float],
) -> float | None:
    """Distance in metres along a world ray to an object's box, or None if it misses.

    Args:
        origin: (3,) metres.
        direction: (3,) unit vector.
        world_from_object: pose of the object; its origin is on the support plane.
        box_m: extents (x, y, z) of the box that stands on the origin.
    """
    object_from_world = world_from_object.inverse()
    start = object_from_world @ origin
    heading = object_from_world.rotation @ direction
    half = np.array([0.5 * box_m[0], 0.5 * box_m[1], 0.5 * box_m[2]])
    start = start - np.array([0.0, 0.0, half[2]])
    with np.errstate(divide="ignore", invalid="ignore"):
        near = np.where(heading != 0, (-np.sign(heading) * half - start) / heading, -np.inf)
        far = np.where(heading != 0, (np.sign(heading) * half - start) / heading, np.inf)
    parallel_outside = (heading == 0) & (np.abs(start) > half)
    enter, leave = float(near.max()), float(far.min())
    if parallel_outside.any() or leave < max(enter, 0.0):
        return None
    return max(enter, 0.0)


def associate(
    detections: Sequence[Detection],
    objects: Sequence[ObjectModel],
    poses: Mapping[str, Pose],
    *,
    camera: Camera,
    world_from_camera: Pose,
) -> dict[str, int]:
    """Index of the detection of each object whose copy is hit first by a ray through its centre.

    Args:
        detections: of one picture.
        objects: the splat copies.
        poses: by object id, where the copies stand.
        camera: that took the picture.
        world_from_camera: its pose.
    """
    found: dict[str, int] = {}
    order = sorted(range(len(detections)), key=lambda i: -detections[i].score)
    for index in order:
        ray = camera.unproject(detections[index].centre_px()[None])[0]
        direction = world_from_camera.rotation @ ray
        hits = [
            (distance, model.object_id)
            for model in objects
            if model.object_id not in found
            and (
                distance := ray_hits_box(
                    world_from_camera.translation,
                    direction,
                    world_from_object=poses[model.object_id],
                    box_m=model.box_m,
                )
            )
            is not None
        ]
        if hits:
            found[min(hits)[1]] = index
    return found
