"""True picture of a fisheye: range, visible bodies, and every object's silhouette alone.

A pass of its own over the meshes at the true poses, at exact pixel centres; the camera's pictures
are drawn elsewhere, on a finer grid.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Rig
from scenes.mesh import PhysicalRoom, TexturedMesh
from scenes.pose import Pose
from sim.bodies import Body, BodyPart
from sim.camera.camera360 import BODY_EDGE_M, ROOM_EDGE_M, ROOM_EDGE_RAD
from sim.camera.lens_picture import Tolerances
from sim.camera.lens_raster import UNLIT, FisheyeRasteriser, PixelRect
from sim.camera.stand import camera_stand
from sim.camera.tessellate import refine_mesh
from sim.dataset.truth.surfaces import meshes_of_object, meshes_of_room
from sim.truth import PersonTruth

SCAN_BIAS_M = 0.03
"""An object wins over a scanned surface that is nearer by less, metres: the scan's own detail."""

BODY_TILE_PX = 512
"""Side of the square that is drawn at a time: about an object's picture."""

PAD_PX = 2
"""Margin around the vertices of a body, pixels: edges bend a little between them."""

BEYOND_RAD = 0.1
"""How far outside the lens's circle vertices count for the rectangle, radians."""

ROOM = 0
"""Id of everything that never moves."""


@dataclass(frozen=True, slots=True, eq=False)
class Silhouette:
    """Silhouette of a body with nothing in front.

    Attributes:
        rect: the part of the picture that `mask` covers.
        mask: (h, w) bool.
    """

    rect: PixelRect
    mask: NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class LensTruth:
    """One lens in one frame.

    Attributes:
        lens: its camera.
        world_from_lens: its true pose.
        range_m: (H, W) float32 distance from the lens; inf where nothing is.
        ids: (H, W) uint8: `ROOM`, k for the k-th object (from 1), one more than that for people.
        silhouettes: of every object that is at least partly within the lens, by id.
    """

    lens: Fisheye
    world_from_lens: Pose
    range_m: NDArray[np.float32]
    ids: NDArray[np.uint8]
    silhouettes: Mapping[str, Silhouette]


@dataclass(frozen=True, slots=True, eq=False)
class _Drawn:
    rect: PixelRect
    range_m: NDArray[np.float32]


class LensTruthPass:
    """Draws the truth of a rig's lenses. Not thread safe: it owns windows; close it at the end.

    Args:
        room: meshes, or the collision mesh of a scanned room.
        rig: the lenses, in the pixels wanted.
        stand: whether the camera's pole is in the picture.
        camera_moves: whether the camera is elsewhere in every frame; the room is then cut into
            short edges once, for all places.
    """

    def __init__(
        self, room: PhysicalRoom, rig: Rig, *, stand: bool = True, camera_moves: bool = False
    ) -> None:
        self._room, self._rig, self._stand = room, rig, stand
        self._rooms: tuple[FisheyeRasteriser, list[int]] | None = None
        self._camera_moves = camera_moves
        self._bias_m = Tolerances().contact_m if room.static else SCAN_BIAS_M
        self._rasteriser = FisheyeRasteriser(min(BODY_TILE_PX, _largest(rig)))
        self._bodies: dict[str, list[list[int]]] = {}
        self._outlines: dict[str, list[NDArray[np.float64]]] = {}
        self._rest: tuple[NDArray[np.float64], list[NDArray[np.float32]]] | None = None
        self._known: dict[str, tuple[bytes, list[_Drawn | None]]] = {}
        for item in room.objects:
            self._upload(Body(item.object_id, (BodyPart(meshes_of_object(item), ()),)))

    def frame(
        self,
        world_from_rig: Pose,
        world_from_object: Mapping[str, Pose],
        people: Mapping[str, PersonTruth],
    ) -> tuple[LensTruth, ...]:
        """The truth of all lenses, objects and people being where they are said to be."""
        for name, person in people.items():
            if name not in self._bodies:
                self._upload(person.body)
        places = {name: (pose,) for name, pose in world_from_object.items()}
        places |= {name: person.world_from_part for name, person in people.items()}
        lenses = [world_from_rig @ pose for pose in self._rig.rig_from_lens]
        rest = self._empty_room(world_from_rig, lenses)
        drawn = {name: self._draw(name, place, lenses) for name, place in places.items()}
        number = {item.object_id: 1 + k for k, item in enumerate(self._room.objects)}
        truths: list[LensTruth] = []
        for index, (lens, world_from_lens) in enumerate(zip(self._rig.lenses, lenses, strict=True)):
            range_m = rest[index].copy()
            ids = np.full(range_m.shape, ROOM, np.uint8)
            for name in places:
                body = drawn[name][index]
                if body is not None:
                    self._put(body, number.get(name, 1 + len(number)), range_m, ids)
            silhouettes = {
                name: Silhouette(body.rect, body.range_m < np.inf)
                for name in world_from_object
                if (body := drawn[name][index]) is not None and (body.range_m < np.inf).any()
            }
            truths.append(LensTruth(lens, world_from_lens, range_m, ids, silhouettes))
        return tuple(truths)

    def close(self) -> None:
        """Free the window, on the thread that drew."""
        self._rasteriser.close()
        if self._rooms is not None:
            self._rooms[0].close()

    def _put(
        self, body: _Drawn, number: int, range_m: NDArray[np.float32], ids: NDArray[np.uint8]
    ) -> None:
        """Let a body hide what is behind it; over the room it wins within the contact's bias."""
        where = body.rect.rows_columns
        behind, seen = range_m[where], ids[where]
        bias_m = np.where(seen == ROOM, np.float32(self._bias_m), np.float32(0.0))
        nearer = body.range_m < behind + bias_m
        behind[nearer] = body.range_m[nearer]
        seen[nearer] = number

    def _upload(self, body: Body) -> None:
        self._bodies[body.body_id] = [
            [self._rasteriser.add(refine_mesh(m, max_edge_m=BODY_EDGE_M)) for m in part.meshes]
            for part in body.parts
        ]
        self._outlines[body.body_id] = [
            np.concatenate([mesh.vertices for mesh in part.meshes]) for part in body.parts
        ]

    def _draw(
        self, name: str, world_from_part: Sequence[Pose], lenses: Sequence[Pose]
    ) -> list[_Drawn | None]:
        """The body alone through every lens; again only if something has moved."""
        key = b"".join(pose.matrix().tobytes() for pose in (*world_from_part, *lenses))
        known = self._known.get(name)
        if known is not None and known[0] == key:
            return known[1]
        drawn: list[_Drawn | None] = []
        for lens, world_from_lens in zip(self._rig.lenses, lenses, strict=True):
            lens_from_part = [world_from_lens.inverse() @ pose for pose in world_from_part]
            outline = np.concatenate(
                [p @ points for p, points in zip(lens_from_part, self._outlines[name], strict=True)]
            )
            rect = _seen_rect(outline, lens)
            if rect is None:
                drawn.append(None)
                continue
            parts = [
                (number, pose)
                for numbers, pose in zip(self._bodies[name], lens_from_part, strict=True)
                for number in numbers
            ]
            drawn.append(_Drawn(rect, self._rasteriser.draw(parts, lens, rect, light=UNLIT)[1]))
        self._known[name] = (key, drawn)
        return drawn

    def _empty_room(
        self, world_from_rig: Pose, lenses: Sequence[Pose]
    ) -> list[NDArray[np.float32]]:
        """Range of what never moves through every lens; again only if the camera has moved."""
        matrix = world_from_rig.matrix()
        if self._rest is not None and np.array_equal(self._rest[0], matrix):
            return self._rest[1]
        rasteriser, numbers = self._room_meshes(world_from_rig, lenses)
        ranges: list[NDArray[np.float32]] = []
        for lens, world_from_lens in zip(self._rig.lenses, lenses, strict=True):
            whole = PixelRect(0, 0, lens.width_px, lens.height_px)
            parts = [(number, world_from_lens.inverse()) for number in numbers]
            ranges.append(rasteriser.draw(parts, lens, whole, light=UNLIT)[1])
        self._rest = (matrix, ranges)
        return ranges

    def _room_meshes(
        self, world_from_rig: Pose, lenses: Sequence[Pose]
    ) -> tuple[FisheyeRasteriser, list[int]]:
        """Static meshes on the device; a camera that stands still may have longer far edges."""
        if self._camera_moves and self._rooms is not None:
            return self._rooms
        if self._rooms is not None:
            self._rooms[0].close()
        static: list[TexturedMesh] = list(meshes_of_room(self._room))
        if self._stand and self._room.static:
            static.append(camera_stand(world_from_rig, self._rig))
        rasteriser = FisheyeRasteriser(_largest(self._rig))
        eye = np.mean([pose.translation for pose in lenses], axis=0)
        numbers = [
            rasteriser.add(
                refine_mesh(mesh, max_edge_m=BODY_EDGE_M)
                if self._camera_moves
                else refine_mesh(mesh, max_edge_m=ROOM_EDGE_M, eye=eye, max_edge_rad=ROOM_EDGE_RAD)
            )
            for mesh in static
        ]
        self._rooms = (rasteriser, numbers)
        return self._rooms


def _largest(rig: Rig) -> int:
    return max(max(lens.width_px, lens.height_px) for lens in rig.lenses)


def _seen_rect(points_in_lens: NDArray[np.float64], lens: Fisheye) -> PixelRect | None:
    """Rectangle around the points within the lens's circle; None if there are none."""
    off_axis = np.hypot(points_in_lens[:, 0], points_in_lens[:, 1])
    theta = np.arctan2(off_axis, points_in_lens[:, 2])
    if not len(theta) or theta.min() > lens.max_angle:
        return None
    seen = theta < lens.max_angle + BEYOND_RAD
    gain = lens.radius_px(theta[seen]) / np.maximum(off_axis[seen], 1e-12)
    x = gain * points_in_lens[seen, 0] + lens.cx
    y = gain * points_in_lens[seen, 1] + lens.cy
    x0 = max(0, math.floor(x.min()) - PAD_PX)
    y0 = max(0, math.floor(y.min()) - PAD_PX)
    x1 = min(lens.width_px, math.ceil(x.max()) + PAD_PX)
    y1 = min(lens.height_px, math.ceil(y.max()) + PAD_PX)
    return PixelRect(x0, y0, x1, y1) if x0 < x1 and y0 < y1 else None
