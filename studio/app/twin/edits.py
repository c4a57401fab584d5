"""Changes of what is in the twin, as pure functions from document to document.

`scanned` is where the scan has its movable objects: `world_from_object` by object id.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scenes.frames import CAMERA_FROM_AHEAD
from scenes.pose import Pose, wrap_angle
from scenes.state import Annotation, Avatar, LiveSurface
from studio.app.model.documents.document import (
    Document,
    Primitive,
    TwinEdits,
    with_item,
    without_item,
)

T = TypeVar("T")

FARTHEST_M = 1000.0
"""Distance from the world's origin up to which something can be put: no room is larger."""


class EditError(ValueError):
    """An edit cannot be made; says what, where, the value, and what is wanted."""


class ItemKind(Enum):
    """Kinds of items of the twin."""

    OBJECT = "object"
    PRIMITIVE = "primitive"
    AVATAR = "avatar"
    CAMERA = "camera"
    SURFACE = "surface"
    ANNOTATION = "annotation"
    MESH = "mesh"
    PROPOSAL = "proposal"


TURNABLE = frozenset(ItemKind) - {ItemKind.SURFACE, ItemKind.ANNOTATION}
"""Kinds that have a pose; the others are made of points."""

TILTABLE = TURNABLE - {ItemKind.AVATAR}
"""Kinds that can lean to a side, too; people stand upright."""

LOOKING = (ItemKind.AVATAR, ItemKind.CAMERA)
"""Kinds whose frame is a camera's (OpenCV axes): their x axis here is where they look."""


@dataclass(frozen=True, slots=True)
class Stance:
    """Numbers that say where an item is, as forms, scripts and the gizmo have them.

    Attributes:
        place: (x, y, z) world metres, to a tenth of a millimetre.
        yaw_deg: heading about up, from world +X.
        tilt_x_deg, tilt_y_deg: turn about its own x axis, then about y, before the heading: of a
            camera x is where it looks, and a negative y looks up. All to a hundredth of a degree.
    """

    place: tuple[float, float, float]
    yaw_deg: float = 0.0
    tilt_x_deg: float = 0.0
    tilt_y_deg: float = 0.0

    @classmethod
    def of(cls, kind: ItemKind, world_from_item: Pose) -> Stance:
        """How an item stands."""
        x, y, z = (round(float(v), 4) for v in world_from_item.translation)
        if kind not in TURNABLE:
            return cls((x, y, z))
        heading = heading_rad(kind, world_from_item)
        axes = world_from_item.rotation
        if kind in LOOKING:
            axes = axes @ CAMERA_FROM_AHEAD.rotation
        rest = Pose.from_yaw(-heading).rotation @ axes
        about_y = math.atan2(-rest[2, 0], rest[0, 0])
        about_x = math.atan2(-rest[1, 2], rest[1, 1])
        angles = (round(math.degrees(angle), 2) + 0.0 for angle in (heading, about_x, about_y))
        return cls((x, y, z), *angles)

    def pose(self, kind: ItemKind) -> Pose:
        """`world_from_item` of an item that stands so."""
        yaw, about_x, about_y = map(math.radians, (self.yaw_deg, self.tilt_x_deg, self.tilt_y_deg))
        c, s = math.cos(about_y), math.sin(about_y)
        tilt_y = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
        c, s = math.cos(about_x), math.sin(about_x)
        tilt_x = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
        axes = Pose.from_yaw(yaw).rotation @ tilt_y @ tilt_x
        if kind in LOOKING:
            axes = axes @ CAMERA_FROM_AHEAD.rotation.T
        return Pose(axes, np.array(self.place))

    def values(self) -> dict[str, float]:
        """As arguments of `twin.place`; a tilt of 0 is left out."""
        x, y, z = self.place
        tilts = {"tilt_x_deg": self.tilt_x_deg, "tilt_y_deg": self.tilt_y_deg}
        upright = {"x": x, "y": y, "z": z, "yaw_deg": self.yaw_deg}
        return upright | {name: angle for name, angle in tilts.items() if angle}


def kind_of(document: Document, scanned: Mapping[str, Pose], item_id: str) -> ItemKind:
    """Return the kind of an item.

    Raises:
        EditError: nothing of that id is there.
    """
    for kind, items in _tables(document.twin).items():
        if item_id in items:
            return kind
    if item_id in scanned:
        return ItemKind.OBJECT
    known = ", ".join(sorted(taken_ids(document, scanned))) or "none"
    raise EditError(f"{item_id!r}: no such item in the twin; there are: {known}")


def taken_ids(document: Document, scanned: Mapping[str, Pose]) -> frozenset[str]:
    """Ids of everything that is in the twin."""
    return frozenset(scanned).union(document.twin.poses, *_tables(document.twin).values())


def new_id(document: Document, scanned: Mapping[str, Pose], stem: str) -> str:
    """An id that is not taken: the stem with the lowest number that is free, such as "box-2"."""
    taken = taken_ids(document, scanned)
    number = 1
    while f"{stem}-{number}" in taken:
        number += 1
    return f"{stem}-{number}"


def pose_of(document: Document, scanned: Mapping[str, Pose], item_id: str) -> Pose:
    """Return the pose of an item, `world_from_item`.

    Of avatars and cameras the frame is a camera's (OpenCV axes). Live surfaces and annotations are
    made of points: their frame is the world's, moved to the middle of the points.

    Raises:
        EditError: nothing of that id is there.
    """
    twin = document.twin
    kind = kind_of(document, scanned, item_id)
    if kind is ItemKind.OBJECT:
        return twin.poses.get(item_id, scanned[item_id])
    if kind is ItemKind.PRIMITIVE:
        return twin.primitives[item_id].world_from_primitive
    if kind is ItemKind.AVATAR:
        return twin.avatars[item_id].world_from_head
    if kind is ItemKind.CAMERA:
        return twin.cameras[item_id]
    if kind is ItemKind.MESH:
        return twin.meshes[item_id].world_from_mesh
    return Pose.from_yaw(0.0, _points(twin, kind, item_id).mean(axis=0))


def heading_rad(kind: ItemKind, world_from_item: Pose) -> float:
    """About up, from world +X, in [-π, π): where a person or camera looks; an object's yaw."""
    if kind in LOOKING:
        forward = world_from_item.rotation[:, 2]
        # One that looks straight up or down heads to where the top of its picture is.
        along = forward if math.hypot(*forward[:2]) > 1e-6 else -world_from_item.rotation[:, 1]
        return wrap_angle(math.atan2(along[1], along[0]))
    along = world_from_item.rotation[:, 0]
    # One whose x axis is upright heads to where its y axis says.
    if math.hypot(*along[:2]) < 1e-6:
        x, y, _ = world_from_item.rotation[:, 1]
        return wrap_angle(math.atan2(-x, y))
    return wrap_angle(math.atan2(along[1], along[0]))


def put(
    document: Document, scanned: Mapping[str, Pose], item_id: str, world_from_item: Pose
) -> Document:
    """The item at another `world_from_item`; a person's hands and a surface's corners go along.

    Raises:
        EditError: nothing of that id is there, or the place is out of bounds.
    """
    kind = kind_of(document, scanned, item_id)
    checked_place(item_id, world_from_item.translation)
    twin = document.twin
    if kind is ItemKind.OBJECT:
        return _with(document, poses=with_item(twin.poses, item_id, world_from_item))
    if kind is ItemKind.PRIMITIVE:
        item = replace(twin.primitives[item_id], world_from_primitive=world_from_item)
        return _with(document, primitives=with_item(twin.primitives, item_id, item))
    if kind is ItemKind.AVATAR:
        person = _moved_avatar(twin.avatars[item_id], world_from_item)
        return _with(document, avatars=with_item(twin.avatars, item_id, person))
    if kind is ItemKind.CAMERA:
        return _with(document, cameras=with_item(twin.cameras, item_id, world_from_item))
    if kind is ItemKind.MESH:
        mesh = replace(twin.meshes[item_id], world_from_mesh=world_from_item)
        return _with(document, meshes=with_item(twin.meshes, item_id, mesh))
    before = pose_of(document, scanned, item_id)
    points = world_from_item @ (before.inverse() @ _points(twin, kind, item_id))
    if kind is ItemKind.SURFACE:
        surface = replace(twin.surfaces[item_id], corners_in_world=points)
        return _with(document, surfaces=with_item(twin.surfaces, item_id, surface))
    note = replace(twin.annotations[item_id], points_in_world=points)
    return _with(document, annotations=with_item(twin.annotations, item_id, note))


def put_all(document: Document, scanned: Mapping[str, Pose], poses: Mapping[str, Pose]) -> Document:
    """Several items at other poses: one throw."""
    for item_id, pose in poses.items():
        document = put(document, scanned, item_id, pose)
    return document


def moved(
    document: Document, scanned: Mapping[str, Pose], item_id: str, place: ArrayLike
) -> Document:
    """The item at another place (3,), world metres; it stays turned as it is."""
    before = pose_of(document, scanned, item_id)
    return put(document, scanned, item_id, Pose(before.rotation, checked_place(item_id, place)))


def turned(
    document: Document, scanned: Mapping[str, Pose], item_id: str, to_rad: float
) -> Document:
    """The item turned about up to another heading; it keeps its tilt.

    Raises:
        EditError: it is made of points, not there, or the angle is not finite.
    """
    kind = kind_of(document, scanned, item_id)
    if kind not in TURNABLE:
        raise EditError(f"{item_id}: a {kind.value} is made of points; drag those instead")
    if not math.isfinite(to_rad):
        raise EditError(f"{item_id}: turned to {to_rad} rad, wanted a finite angle")
    before = pose_of(document, scanned, item_id)
    turn = Pose.from_yaw(wrap_angle(to_rad - heading_rad(kind, before)))
    pose = Pose(turn.rotation @ before.rotation, before.translation)
    return put(document, scanned, item_id, pose)


def placed(
    document: Document, scanned: Mapping[str, Pose], item_id: str, stance: Stance
) -> Document:
    """The item where numbers say: what the gizmo, forms and scripts do.

    Raises:
        EditError: it is not there, cannot lean so, or a number is out of bounds.
    """
    kind = kind_of(document, scanned, item_id)
    angles = (stance.yaw_deg, stance.tilt_x_deg, stance.tilt_y_deg)
    if not all(map(math.isfinite, angles)):
        raise EditError(f"{item_id}: angles {angles} in degrees, wanted finite ones")
    if kind not in TURNABLE and any(angles):
        raise EditError(f"{item_id}: a {kind.value} is made of points; drag those instead")
    if kind not in TILTABLE and any(angles[1:]):
        raise EditError(f"{item_id}: a person stands upright; tilted by {angles[1:]} degrees")
    checked_place(item_id, stance.place)
    return put(document, scanned, item_id, stance.pose(kind))


def tilted(
    document: Document, scanned: Mapping[str, Pose], item_id: str, x_deg: float, y_deg: float
) -> Document:
    """The item leaning about its own x and y axes; place and heading stay.

    Raises:
        EditError: it is not there, cannot lean, or an angle is not finite.
    """
    kind = kind_of(document, scanned, item_id)
    before = Stance.of(kind, pose_of(document, scanned, item_id))
    after = replace(before, tilt_x_deg=x_deg, tilt_y_deg=y_deg)
    return placed(document, scanned, item_id, after)


def reset(document: Document, scanned: Mapping[str, Pose], item_id: str) -> Document:
    """An object where the scan has it again.

    Raises:
        EditError: it is not an object of the scan.
    """
    kind = kind_of(document, scanned, item_id)
    if kind is not ItemKind.OBJECT:
        raise EditError(f"{item_id}: a {kind.value} is not in the scan, so it has no place there")
    return _with(document, poses=without_item(document.twin.poses, item_id))


def name_of(document: Document, item_id: str, otherwise: str = "") -> str:
    """Return an item's name: the one it was given, or another one, or its id."""
    return document.twin.names.get(item_id) or otherwise or item_id


def renamed(document: Document, scanned: Mapping[str, Pose], item_id: str, name: str) -> Document:
    """The item under another name; "" gives it its own again. Ids never change."""
    kind_of(document, scanned, item_id)
    name = " ".join(name.split())
    names = document.twin.names
    if not name:
        return _with(document, names=without_item(names, item_id))
    return _with(document, names=with_item(names, item_id, name))


def removed(document: Document, scanned: Mapping[str, Pose], item_id: str) -> Document:
    """The twin without something that was added.

    Raises:
        EditError: it is not there, or an object of the scan.
    """
    kind = kind_of(document, scanned, item_id)
    if kind is ItemKind.OBJECT:
        raise EditError(
            f"{item_id}: an object of the scan stays in it; reset it to move it back, or take it "
            "out of the scan in the preparation"
        )
    twin = document.twin
    return _with(
        document,
        names=without_item(twin.names, item_id),
        primitives=without_item(twin.primitives, item_id),
        avatars=without_item(twin.avatars, item_id),
        cameras=without_item(twin.cameras, item_id),
        surfaces=without_item(twin.surfaces, item_id),
        annotations=without_item(twin.annotations, item_id),
        meshes=without_item(twin.meshes, item_id),
    )


def checked_place(item_id: str, place: ArrayLike) -> NDArray[np.float64]:
    """(3,) world metres, if something can be put there.

    Raises:
        EditError: it is not three finite numbers, or too far away.
    """
    try:
        point = np.array(place, dtype=np.float64)
    except (ValueError, TypeError):
        point = np.zeros(0)
    if point.shape != (3,) or not np.isfinite(point).all():
        raise EditError(f"{item_id}: place {place!r}, wanted three finite numbers x, y, z in m")
    if np.abs(point).max() > FARTHEST_M:
        raise EditError(f"{item_id}: place {point.tolist()} m, limit {FARTHEST_M:g} m each way")
    return point


def _tables(twin: TwinEdits) -> dict[ItemKind, Mapping[str, Any]]:
    return {
        ItemKind.PRIMITIVE: twin.primitives,
        ItemKind.AVATAR: twin.avatars,
        ItemKind.CAMERA: twin.cameras,
        ItemKind.SURFACE: twin.surfaces,
        ItemKind.ANNOTATION: twin.annotations,
        ItemKind.MESH: twin.meshes,
    }


def _points(twin: TwinEdits, kind: ItemKind, item_id: str) -> NDArray[np.float64]:
    item: LiveSurface | Annotation | Primitive = _tables(twin)[kind][item_id]
    if isinstance(item, LiveSurface):
        return item.corners_in_world
    assert isinstance(item, Annotation)
    return item.points_in_world


def _moved_avatar(person: Avatar, world_from_head: Pose) -> Avatar:
    way = world_from_head @ person.world_from_head.inverse()
    return replace(
        person,
        world_from_head=world_from_head,
        hands=tuple(way @ hand for hand in person.hands),
        ray=None if person.ray is None else way @ person.ray,
    )


def _with(document: Document, **changes: Any) -> Document:
    return replace(document, twin=replace(document.twin, **changes))
