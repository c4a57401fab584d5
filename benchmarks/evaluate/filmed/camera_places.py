"""Pictures of a 360° camera that stands anywhere in a room, with people about and objects moved.

Drawn from the physical meshes by the simulated camera, never from splats.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.evaluate.filmed.conditions import Conditions
from devices.messages import Frame
from scenes.cameras import Rig
from scenes.frames import WORLD_FROM_FORWARD_CAMERA
from scenes.mesh import BoxPart, PhysicalRoom
from scenes.pose import Pose, rotation_from_vector
from sim.bodies import Placement, body_of_object
from sim.camera.camera360 import Camera360, default_rig
from sim.camera.sensor import Sensor
from sim.people.figure import person_body
from sim.people.posture import SIDES, Posture, part_poses, resting_hand
from sim.rehearsal import STREAM_ID

FloatArray = NDArray[np.float64]

HEIGHTS_M = (0.3, 2.2)
"""Least and most height of the camera over the floor, metres."""

CLEAR_M = 0.3
"""Least distance in metres from the middle of the lenses to walls, furniture and objects: half of
a stand's foot, and of a table's edge a hand."""

BELOW_CEILING_M = 0.2
"""Least distance in metres to the ceiling."""

TILT_RAD = math.radians(10.0)
"""Largest tilt: a stand on a rug, or turned a little by hand."""

LENS_ERROR = 0.01
"""Largest share by which the focal length that is known of the lenses is wrong."""

MAX_PEOPLE = 2
"""People in view, none to so many."""

PERSON_CLEAR_M = 0.7
"""Least distance in metres between a person's axis and the camera, seen from above."""

MOVED_SHARE = 0.3
"""Of the objects, how many are not where they were scanned; half of those are in another room."""

MOVED_M = 0.5
"""Largest shift along each axis of an object that was moved, metres."""

DRIFT = 4.0
"""Times the simulated sensor's drift: the exposure differs by 10 %, its colours by 3 %."""

TRIES = 1000
"""Places that are drawn before a room is called full."""


@dataclass(frozen=True, slots=True, eq=False)
class CameraPlace:
    """One picture of a camera somewhere.

    Attributes:
        world_from_rig: where it truly stood.
        true_rig: the lenses that took the pictures.
        frame: the pictures, with lenses as they are known beforehand and no pose.
        people: how many were in the room.
        moved: ids of the objects that were not where they were scanned.
    """

    world_from_rig: Pose
    true_rig: Rig
    frame: Frame
    people: int
    moved: tuple[str, ...]


def film_place(
    room: PhysicalRoom,
    conditions: Conditions,
    rng: np.random.Generator,
    *,
    rig: Rig | None = None,
) -> CameraPlace:
    """Put a camera somewhere in a room and take a picture through each of its lenses.

    Args:
        room: with its objects where they were scanned.
        conditions: of the sensor; the pose error and the bit rate are not used here.
        rng: decides everything: place, people, objects, exposure and the error of the known lens.
        rig: of that camera; the simulated camera's own if not given.

    Raises:
        ValueError: nothing in the room is free.
    """
    of_place, of_people, of_objects, of_sensor, of_lens = rng.spawn(5)
    world_from_rig = free_place(room, of_place)
    objects, moved = _objects(room, world_from_rig.translation, of_objects)
    standing = _people(room, world_from_rig.translation, of_people)
    figures = [person_body(name, of_people) for name in standing]
    true_rig = default_rig(conditions.lens_size_px) if rig is None else rig
    bodies = [*(body_of_object(item) for item in room.objects), *figures]
    camera = Camera360(room, true_rig, world_from_rig, bodies)
    view = camera.view({**objects, **standing})
    camera.close()
    drifting = replace(conditions, drift=DRIFT * conditions.drift)
    sensor = Sensor(true_rig, of_sensor, options=drifting.sensor())
    images = tuple(sensor.expose([lens.rgb for lens in view.lenses], 0.0))
    wrong = 1.0 + float(of_lens.uniform(-LENS_ERROR, LENS_ERROR))
    known = tuple(replace(lens, f_px=wrong * lens.f_px) for lens in true_rig.lenses)
    frame = Frame(STREAM_ID, 0, 0, 0, images, Rig(known, true_rig.rig_from_lens), None)
    return CameraPlace(world_from_rig, true_rig, frame, len(standing), moved)


def free_place(room: PhysicalRoom, rng: np.random.Generator) -> Pose:
    """`world_from_rig` of a camera in the free space of a room, turned anyhow and a little tilted.

    Raises:
        ValueError: nothing is free.
    """
    low, high = np.asarray(room.footprint_m, dtype=np.float64)
    ceiling = float(max(mesh.vertices[:, 2].max() for mesh in room.static)) - BELOW_CEILING_M
    for _ in range(TRIES):
        place = np.array(
            [*rng.uniform(low + CLEAR_M, high - CLEAR_M), rng.uniform(*HEIGHTS_M)],
            dtype=np.float64,
        )
        yaw, lean, tilt = rng.uniform((-math.pi, -math.pi, 0.0), (math.pi, math.pi, TILT_RAD))
        if place[2] > ceiling or _gap(room, place) < CLEAR_M:
            continue
        leaning = rotation_from_vector(tilt * np.array([math.cos(lean), math.sin(lean), 0.0]))
        level = Pose.from_yaw(yaw).rotation @ WORLD_FROM_FORWARD_CAMERA.rotation
        return Pose(leaning @ level, place)
    raise ValueError(f"room {room.name}: none of {TRIES} places is {CLEAR_M} m free on all sides")


def _gap(room: PhysicalRoom, point: FloatArray) -> float:
    """Distance in metres from a point to the nearest solid or scanned object."""
    gaps = [_outside(solid, Pose.identity(), point) for solid in room.solids]
    gaps += [
        _outside(part, item.world_from_object, point)
        for item in room.objects
        for part in item.parts
    ]
    return min(gaps, default=math.inf)


def _outside(box: BoxPart, world_from_object: Pose, point: FloatArray) -> float:
    local = (world_from_object @ box.object_from_box).inverse() @ point
    apart = np.maximum(np.abs(local) - np.asarray(box.half_size_m), 0.0)
    return float(np.linalg.norm(apart))


def _objects(
    room: PhysicalRoom, camera: FloatArray, rng: np.random.Generator
) -> tuple[Mapping[str, Placement], tuple[str, ...]]:
    """Placements of the objects that are there, and which are not where they were scanned."""
    placements: dict[str, Placement] = {}
    moved: list[str] = []
    for item in room.objects:
        pose, height = item.world_from_object, float(item.world_from_object.translation[2])
        is_moved, is_gone = rng.random(2) < (MOVED_SHARE, 0.5)
        shift = np.array([*rng.uniform(-MOVED_M, MOVED_M, 2), 0.0])
        turned = Pose.from_yaw(float(rng.uniform(-math.pi, math.pi)), pose.translation + shift)
        if is_moved:
            moved.append(item.object_id)
            pose = turned
        is_in_lens = any(_outside(part, pose, camera) < CLEAR_M for part in item.parts)
        if not (is_moved and (is_gone or is_in_lens)):
            placements[item.object_id] = Placement((pose,), height)
    return placements, tuple(moved)


def _people(
    room: PhysicalRoom, camera: FloatArray, rng: np.random.Generator
) -> Mapping[str, Placement]:
    """People who stand about, clear of the camera and of what never moves."""
    low, high = np.asarray(room.footprint_m, dtype=np.float64)
    placements: dict[str, Placement] = {}
    wanted = int(rng.integers(MAX_PEOPLE + 1))
    for _ in range(TRIES):
        if len(placements) == wanted:
            break
        at, yaw = rng.uniform(low + CLEAR_M, high - CLEAR_M), float(rng.uniform(-math.pi, math.pi))
        waist = np.array([*at, 1.0])
        is_free = all(_outside(solid, Pose.identity(), waist) > CLEAR_M for solid in room.solids)
        if is_free and np.linalg.norm(at - camera[:2]) > PERSON_CLEAR_M:
            name = f"person-{len(placements) + 1}"
            placements[name] = Placement(part_poses(_standing(at, yaw)), 0.0)
    return placements


def _standing(at: FloatArray, yaw: float) -> Posture:
    """A person who stands upright with hanging arms."""
    nowhere = np.zeros(3)
    still = Posture(at, yaw, 0.0, 0.0, 0.0, 0.0, nowhere, nowhere)
    left, right = (resting_hand(still, side) for side in SIDES)
    return replace(still, left_hand=left, right_hand=right)
