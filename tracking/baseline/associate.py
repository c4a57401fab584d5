"""Which splat copy a detection is: the ray through its box centre hits it (paper 4.4.2)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Camera
from scenes.pose import Pose
from scenes.state import ObjectModel
from tracking.baseline.detect import Detection


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
