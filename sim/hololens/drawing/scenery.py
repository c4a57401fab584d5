"""A room's meshes and what moves in it, drawn for the camera of a simulated HoloLens."""

from __future__ import annotations

import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Pinhole
from scenes.frames import CAMERA_FROM_BOARD
from scenes.mesh import CollisionMesh, PhysicalRoom, TexturedMesh
from scenes.pose import Pose
from scenes.quad import QrCode
from scenes.samples.pictures.graphics import qr_symbol
from sim.camera.camera360 import default_rig
from sim.camera.stand import camera_stand
from sim.camera.tessellate import refine_mesh
from sim.phone.raster import LitMesh, PinholeRasteriser

CAMERA = "camera-360"
"""Name of the 360° camera among what moves."""

CAMERA_CODE = "nexus:camera"
"""Payload of the code on the 360° camera."""

CAMERA_CODE_M = 0.10
"""Side of that code: a headset reads it from 2 m."""

RIG_FROM_CODE = Pose(CAMERA_FROM_BOARD.rotation, np.array([0.0, 0.26, 0.03]))
"""Place of the code: on the stand, below the lenses, facing ahead."""

QUIET_MODULES = 4
"""Light rim of a printed code, modules."""

OBJECT_EDGE_M = 0.04
"""Longest edge of an object's triangles when it is lit."""

WALL = 190
"""Grey value of a scanned room's mesh under full light."""

BEFORE_WALL_M = 0.01
"""How far before a scanned wall its codes are drawn: more than the mesh is rough."""

CARD = 236
"""Grey value of a code's card."""


@dataclass(frozen=True, slots=True, eq=False)
class Moving:
    """Something that moves.

    Attributes:
        meshes: in its own frame, lit.
        world_from_object: where it is at first, in the room.
    """

    meshes: tuple[LitMesh, ...]
    world_from_object: Pose


class Scenery:
    """A room, and where everything in it is; any thread may ask and move.

    Args:
        room: its meshes, objects, and where its 360° camera stands.
        has_camera: whether the 360° camera is to be seen, with its code.
    """

    def __init__(self, room: PhysicalRoom, *, has_camera: bool = True) -> None:
        self.room = room
        self._still = [_still(mesh) for mesh in room.static]
        if room.collision is not None:
            self._still += _scanned(room, room.collision)
        self._moving = {
            item.object_id: Moving(
                tuple(_lit(mesh, room, at=item.world_from_object) for mesh in item.meshes),
                item.world_from_object,
            )
            for item in room.objects
        }
        if has_camera:
            self._moving[CAMERA] = Moving(_camera(room.world_from_rig), room.world_from_rig)
        self._lock = threading.Lock()
        self._poses = {name: each.world_from_object for name, each in self._moving.items()}

    @property
    def code_on_camera(self) -> QrCode | None:
        """The code on the 360° camera where that is now; None without a camera."""
        with self._lock:
            rig = self._poses.get(CAMERA)
        return None if rig is None else QrCode(CAMERA_CODE, CAMERA_CODE_M, rig @ RIG_FROM_CODE)

    def poses(self) -> Mapping[str, Pose]:
        """Return where everything that moves is, in the room."""
        with self._lock:
            return dict(self._poses)

    def move(self, poses: Mapping[str, Pose]) -> None:
        """Have objects, or `CAMERA`, elsewhere; names that are not there are left out."""
        with self._lock:
            self._poses.update({name: p for name, p in poses.items() if name in self._poses})

    @property
    def drawn(self) -> DrawnScene:
        """All that is drawn, for the process that draws."""
        return DrawnScene(self._still, {name: each.meshes for name, each in self._moving.items()})


@dataclass(frozen=True, slots=True, eq=False)
class DrawnScene:
    """Meshes of a scenery.

    Attributes:
        still: in the room.
        moving: of what moves, each in its own frame, by name.
    """

    still: Sequence[LitMesh]
    moving: Mapping[str, tuple[LitMesh, ...]]


@dataclass(frozen=True, slots=True)
class Shot:
    """One picture to be drawn.

    Attributes:
        camera: with the picture's size.
        room_from_camera: where it is, OpenCV axes.
        poses: where everything that moves is, in the room.
        burnt_us: time to be burnt into it, microseconds; None for none.
    """

    camera: Pinhole
    room_from_camera: Pose
    poses: Mapping[str, Pose]
    burnt_us: int | None = None


class Painter:
    """Draws a scene, on the thread that made it.

    Args:
        scene: what there is.
        width_px: of the pictures.
        height_px: of the pictures.
    """

    def __init__(self, scene: DrawnScene, width_px: int, *, height_px: int) -> None:
        meshes = list(scene.still)
        self._numbers: dict[str, range] = {}
        for name, parts in scene.moving.items():
            self._numbers[name] = range(len(meshes), len(meshes) + len(parts))
            meshes += parts
        self._rasteriser = PinholeRasteriser(meshes, width_px, height_px)

    def draw(
        self, camera: Pinhole, room_from_camera: Pose, *, poses: Mapping[str, Pose]
    ) -> NDArray[np.uint8]:
        """Return (H, W, 3) uint8 RGB, with everything that moves where `poses` says."""
        moved = {n: poses[name] for name, numbers in self._numbers.items() for n in numbers}
        return self._rasteriser.draw(camera, room_from_camera, shift_px=(0.0, 0.0), moved=moved)

    def close(self) -> None:
        """Free what it holds on the graphics device."""
        self._rasteriser.close()


def _still(mesh: TexturedMesh) -> LitMesh:
    """A static mesh, whose texture holds the room's light already."""
    light = np.ones((len(mesh.vertices), 3))
    return LitMesh(mesh.vertices, mesh.uv, mesh.faces, mesh.texture, light)


def _scanned(room: PhysicalRoom, collision: CollisionMesh) -> list[LitMesh]:
    """A scanned room, of which only the mesh is known: grey, with its codes where they hang."""
    vertices = collision.vertices.astype(np.float64)
    corners = vertices[collision.faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-12)
    # Each triangle has corners of its own: a mesh of a scan is drawn as flat as it is.
    light = room.ambient + room.key * np.maximum(across @ room.light_direction, 0.0)
    flat = corners.reshape(-1, 3)
    grey = np.full((1, 1, 3), WALL, np.uint8)
    faces = np.arange(len(flat)).reshape(-1, 3)
    uv = np.full((len(flat), 2), 0.5)
    mesh = LitMesh(flat, uv, faces, grey, np.repeat(np.repeat(light, 3)[:, None], 3, axis=1))
    before = Pose(np.eye(3), np.array([0.0, 0.0, BEFORE_WALL_M]))
    cards = [
        code_card(code.payload, code.side_m, frame_from_code=code.world_from_code @ before)
        for code in room.codes
    ]
    return [mesh, *cards]


def _lit(mesh: TexturedMesh, room: PhysicalRoom, *, at: Pose) -> LitMesh:
    """An object's mesh under the room's light as it falls where the object stands at first."""
    fine = refine_mesh(mesh, max_edge_m=OBJECT_EDGE_M)
    facing = fine.normals @ at.rotation.T @ room.light_direction
    light = room.ambient + room.key * np.maximum(facing, 0.0)
    return LitMesh(
        fine.vertices, fine.uv, fine.faces, fine.texture, np.repeat(light[:, None], 3, 1)
    )


def _camera(world_from_rig: Pose) -> tuple[LitMesh, ...]:
    """The 360° camera's stand and code, in the rig's frame."""
    stand = camera_stand(world_from_rig, default_rig())
    in_rig = world_from_rig.inverse() @ stand.vertices
    light = np.ones((len(in_rig), 3))
    return (
        LitMesh(in_rig, stand.uv, stand.faces, stand.texture, light),
        code_card(CAMERA_CODE, CAMERA_CODE_M, frame_from_code=RIG_FROM_CODE),
    )


def code_card(payload: str, side_m: float, *, frame_from_code: Pose) -> LitMesh:
    """Return a printed code on a card, seen from its front only."""
    symbol = qr_symbol(payload, module_px=12)
    rim = QUIET_MODULES * 12
    card = np.pad(symbol, ((rim, rim), (rim, rim), (0, 0)), constant_values=CARD)
    half = 0.5 * side_m * card.shape[0] / symbol.shape[0]
    corners = np.array([[-half, -half, 0], [half, -half, 0], [half, half, 0], [-half, half, 0]])
    uv = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    return LitMesh(frame_from_code @ corners, uv, faces, card, np.ones((4, 3)))
