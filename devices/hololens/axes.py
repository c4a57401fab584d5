"""The headset's numbers as the studio's values: axes, units, times; what is no number is refused.

The headset's world is right-handed, y up, -z ahead, and its matrices are for row vectors. The
display's is left-handed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.hololens.values import JOINTS, HandJoints, HeadAndHands, Ray, SpatialSurface
from devices.hololens.wire.packets import Packet
from devices.hololens.wire.personal_video import VideoTrailer
from devices.hololens.wire.spatial_input import SpatialInput, Valid
from devices.hololens.wire.spatial_mapping import ObservedSurface
from devices.hololens.wire.surface_mesh import MeshNumbers
from devices.hololens.wire.taking import WireError
from scenes.cameras import Pinhole
from scenes.frames import OPENGL_FROM_OPENCV, UNITY_FROM_WORLD, WORLD_FROM_GLTF, head_axes
from scenes.pose import Pose, quaternion_from_rotation, renormalised, rotation_from_quaternion

Floats = NDArray[np.float64]

NEARLY = 1e-2
"""How far a matrix of the headset's may be from a rotation, chosen: float32 is off by 1e-6, other
matrices by 1."""

FIRST_PIXEL = 0.5
"""Middle of the first pixel in the studio's counting; in the headset's it is 0."""

MAX_DISTANCE_M = 1e4
"""Farthest that anything of a headset can be from where its program began."""

SessionTime = Callable[[int], int]
"""Turns the headset's ticks into session time, nanoseconds."""


def pose_of_rows(matrix: ArrayLike) -> Pose:
    """Return the pose of a matrix (4, 4) for row vectors, in the headset's own axes.

    Raises:
        WireError: it is no rotation with a place.
    """
    m = np.asarray(matrix, dtype=np.float64)
    rotation, place = m[:3, :3].T, m[3, :3]
    with np.errstate(all="ignore"):
        off = np.abs(rotation @ rotation.T - np.eye(3)).max()
    if not (off < NEARLY and np.linalg.det(rotation) > 0 and _is_near(place)):
        raise WireError(f"pose {m.ravel().tolist()}: no rotation and place")
    for _ in range(4):
        rotation = renormalised(rotation)
    return Pose(rotation, place)


def camera_pose(packet: Packet) -> Pose | None:
    """Return `world_from_camera`, OpenCV axes; None where the headset did not know.

    Raises:
        WireError: the pose is none.
    """
    if packet.pose is None or not packet.is_located:
        return None
    return WORLD_FROM_GLTF @ pose_of_rows(packet.pose) @ OPENGL_FROM_OPENCV


def camera_of(trailer: VideoTrailer, width_px: int, *, height_px: int) -> Pinhole:
    """Return the camera that took a picture.

    Raises:
        WireError: its focal length is none.
    """
    fx, fy = (abs(each) for each in trailer.focal)
    cx, cy = (each + FIRST_PIXEL for each in trailer.principal)
    numbers = np.array([fx, fy, cx, cy])
    if not (np.isfinite(numbers).all() and min(fx, fy) > 1.0 and numbers.max() < 1e5):
        raise WireError(f"personal video: focal {trailer.focal}, principal {trailer.principal}")
    return Pinhole(width_px, height_px, fx, fy, cx, cy)


def head_and_hands(sample: SpatialInput, *, seq: int, t_ns: int, arrived_ns: int) -> HeadAndHands:
    """Return where the wearer is; what is not valid, or no number, is None."""
    # Any 32 bits may come, and some of them are no numbers even to a cast.
    with np.errstate(all="ignore"):
        position, forward, up = sample.head.astype(np.float64)
        origin, direction = sample.eyes.astype(np.float64)
        return HeadAndHands(
            seq,
            t_ns,
            arrived_ns,
            _head(position, forward, up=up) if Valid.HEAD in sample.valid else None,
            _ray(origin, direction) if Valid.EYES in sample.valid else None,
            _hand(sample.left) if Valid.LEFT in sample.valid else None,
            _hand(sample.right) if Valid.RIGHT in sample.valid else None,
        )


def _head(position: Floats, forward: Floats, *, up: Floats) -> Pose | None:
    turn = WORLD_FROM_GLTF.rotation
    if not _is_near(position):
        return None
    try:
        return Pose(head_axes(turn @ forward, turn @ up), turn @ position)
    except ValueError:
        return None


def _ray(origin: Floats, direction: Floats) -> Ray | None:
    turn = WORLD_FROM_GLTF.rotation
    length = float(np.linalg.norm(direction))
    if not (_is_near(origin) and 1e-3 < length < 1e3):
        return None
    return Ray(turn @ origin, turn @ direction / length)


def _hand(joints: NDArray[Any]) -> HandJoints | None:
    xyzw = joints["orientation"].astype(np.float64)
    positions = joints["position"].astype(np.float64)
    radii = joints["radius"].astype(np.float64)
    lengths = np.linalg.norm(xyzw, axis=1)
    is_turned = bool(((lengths > 0.5) & (lengths < 2.0)).all())
    if not (is_turned and _is_near(positions) and np.isfinite(radii).all()):
        return None
    assert positions.shape == (JOINTS, 3)
    turn = WORLD_FROM_GLTF.rotation
    rotations = turn @ rotation_from_quaternion(xyzw[:, [3, 0, 1, 2]])
    return HandJoints(positions @ turn.T, rotations, radii, joints["accuracy"] == 0)


def surface_of(
    listed: ObservedSurface, numbers: MeshNumbers, *, pose: NDArray[np.float32], t_ns: int
) -> SpatialSurface:
    """Return a surface.

    Raises:
        WireError: its pose is none, or it is farther than anything can be.
    """
    if not _is_near(numbers.vertices_m):
        raise WireError(f"surface {listed.guid.hex()}: farther than {MAX_DISTANCE_M:g} m")
    # The headset winds triangles the other way round.
    triangles = np.ascontiguousarray(numbers.triangles[:, ::-1])
    return SpatialSurface(
        listed.guid.hex(),
        listed.update_time,
        t_ns,
        numbers.vertices_m,
        triangles,
        WORLD_FROM_GLTF @ pose_of_rows(pose),
    )


def in_headset_m(in_world_m: ArrayLike) -> Floats:
    """Return places (..., 3) in the headset's own axes."""
    return WORLD_FROM_GLTF.inverse() @ np.asarray(in_world_m, dtype=np.float64)


def unity_transform(world_from_item: Pose, size_m: ArrayLike) -> tuple[float, ...]:
    """Return the display's ten numbers: position, quaternion x y z w, scale."""
    u = UNITY_FROM_WORLD
    w, x, y, z = quaternion_from_rotation(u @ world_from_item.rotation @ u.T).tolist()
    place = (u @ world_from_item.translation).tolist()
    scale = (u @ np.asarray(size_m, dtype=np.float64)).tolist()
    return (*place, x, y, z, w, *scale)


def _is_near(places: Floats) -> bool:
    with np.errstate(all="ignore"):
        return bool((np.abs(places) < MAX_DISTANCE_M).all())
