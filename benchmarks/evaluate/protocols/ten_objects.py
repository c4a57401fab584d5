"""The lab with ten movable objects: its own five, a third chair and stool, and small objects.

The scan knows the copies by the splats of the objects they are copies of.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scenes.mesh import PhysicalObject, PhysicalRoom
from scenes.opening import open_scene
from scenes.package import ScenePackage
from scenes.pose import Pose
from scenes.samples import sample_room
from scenes.state import ObjectModel

DESK_M, BENCH_M = 0.74, 0.5
"""Heights of the lab's desk and bench."""
MOVES = 3000
"""So many are tried until no object of a layout hides another: ten leave little room for that."""


@dataclass(frozen=True, slots=True)
class Copy:
    """A further object: whose copy it is, in which room that is, and where it stands."""

    object_id: str
    scene: str
    original: str
    world_from_object: Pose


COPIES = (
    Copy("chair-3", "lab", "chair-1", Pose.from_yaw(0.6, (-1.75, 1.75, 0.0))),
    Copy("stool-3", "lab", "stool-1", Pose.from_yaw(0.2, (-0.45, 0.15, 0.0))),
    Copy("book-2", "desk", "book-1", Pose.from_yaw(1.3, (1.25, 2.27, BENCH_M))),
    Copy("mug-1", "desk", "mug-1", Pose.from_yaw(0.4, (2.38, 0.66, DESK_M))),
    Copy("box-1", "desk", "box-1", Pose.from_yaw(-0.4, (0.75, 2.27, BENCH_M))),
)


def ten_objects() -> tuple[PhysicalRoom, ScenePackage]:
    """The physical room and its scan; the scan knows every object where it stands."""
    rooms = {name: sample_room(name) for name in ("lab", "desk")}
    scans = {name: open_scene(name) for name in rooms}
    objects: list[PhysicalObject] = list(rooms["lab"].objects)
    models: list[ObjectModel] = list(scans["lab"].objects)
    for copy in COPIES:
        item = rooms[copy.scene].object_by_id(copy.original)
        objects.append(
            replace(item, object_id=copy.object_id, world_from_object=copy.world_from_object)
        )
        model = next(m for m in scans[copy.scene].objects if m.object_id == copy.original)
        models.append(
            replace(
                model,
                object_id=copy.object_id,
                name=copy.object_id,
                support_z_m=float(copy.world_from_object.translation[2]),
                world_from_object=copy.world_from_object,
            )
        )
    room = replace(rooms["lab"], objects=tuple(objects))
    return room, replace(scans["lab"], objects=tuple(models))


def scanned_poses(room: PhysicalRoom) -> Mapping[str, Pose]:
    """Return every object's pose when the room was scanned, by id."""
    return {item.object_id: item.world_from_object for item in room.objects}


def shuffled(room: PhysicalRoom, rng: np.random.Generator) -> Mapping[str, Pose]:
    """All objects somewhere else: furniture on the floor, small objects on desk and bench.

    No two are so near that they touch, nor so nearly in line that one hides the other from the
    camera: of a random layout, one object after the other is put elsewhere, where that helps.
    """
    eye = room.world_from_rig.translation

    def anywhere(item: PhysicalObject) -> Pose:
        return Pose.from_yaw(float(rng.uniform(-np.pi, np.pi)), _place(item, rng))

    poses = {item.object_id: anywhere(item) for item in room.objects}
    widest = _spread(room, poses, eye)
    for _ in range(MOVES):
        item = room.objects[rng.integers(len(room.objects))]
        moved = {**poses, item.object_id: anywhere(item)}
        spread = _spread(room, moved, eye)
        if spread >= widest:
            poses, widest = moved, spread
    return poses


def _place(item: PhysicalObject, rng: np.random.Generator) -> NDArray[np.float64]:
    """Somewhere free of what never moves: around the rug, on the desk's front, on the bench."""
    if item.box_m[2] > 0.3:
        return np.array([rng.uniform(-2.2, 1.7), rng.uniform(0.1, 1.75), 0.0])
    if rng.random() < 0.5:
        return np.array([rng.uniform(2.36, 2.42), rng.uniform(0.15, 0.78), DESK_M])
    return np.array([rng.uniform(0.65, 1.55), rng.uniform(2.24, 2.3), BENCH_M])


def _spread(
    room: PhysicalRoom,
    poses: Mapping[str, Pose],
    eye: NDArray[np.float64],
) -> float:
    """How free the tightest pair is: above 1 by the angle between them, below 0 they touch."""
    places = np.array([poses[item.object_id].translation for item in room.objects])
    radii = np.array([0.5 * float(np.hypot(*item.box_m[:2])) for item in room.objects])
    sight = places - eye
    azimuth = np.arctan2(sight[:, 1], sight[:, 0])
    away = np.hypot(sight[:, 0], sight[:, 1])
    half_angle = np.arcsin(np.minimum(radii / away, 0.9))
    first, second = np.triu_indices(len(places), 1)
    # An object on the desk and one on the floor neither touch nor hide each other from above.
    height = places[:, 2]
    level = (np.abs(height[first] - height[second]) < 0.1) | (
        np.minimum(height[first], height[second]) == 0
    )
    first, second = first[level], second[level]
    gap = np.linalg.norm(places[first, :2] - places[second, :2], axis=1)
    gap -= radii[first] + radii[second]
    angle = np.abs(azimuth[first] - azimuth[second]) - half_angle[first] - half_angle[second]
    return float(np.where(gap < 0, gap / 0.1, 1.0 + angle).min())
