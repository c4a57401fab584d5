"""Additions to the twin, as pure functions that give the document and the new id.

`scanned` is where the scan has its movable objects, by id, as in `edits.py`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scenes.frames import look_at
from scenes.pose import Pose
from scenes.quad import quad_of
from scenes.state import Annotation, Avatar, LiveSurface
from studio.app.model.documents.added_mesh import AddedMesh, Axis, Geometry
from studio.app.model.documents.document import Document, Primitive, Shape, with_item
from studio.app.twin.edits import EditError, checked_place, new_id

Hit = Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64] | None]
"""The first point (3,) that a ray from an eye (3,) along a unit direction (3,) meets, or None."""

SHAPES: tuple[Shape, ...] = ("box", "ball", "cylinder")
MIN_SIZE_M, MAX_SIZE_M = 0.01, 20.0
"""Sides of a primitive, metres: physics passes through what is smaller; no room holds what is
larger."""
ROLES = ("local", "remote")
EYE_HEIGHT_M = 1.6
"""Of a person who stands, above the floor: the middle of adults (DIN 33402-2)."""
HANDS_M = ((-0.22, 0.55, 0.25), (0.22, 0.55, 0.25))
"""Left and right hand as seen from the head (x right, y down, z ahead), metres: forearms held
out."""
COLOURS = ((0.90, 0.45, 0.20), (0.20, 0.55, 0.85), (0.30, 0.65, 0.40), (0.75, 0.40, 0.70))
"""Of primitives and annotations, in turn: distinct for whoever sees colours, named in the tree."""
SURFACE_PX = 640
"""Longer side of the picture that a new live surface shows, pixels; a session makes it as fine as
its camera sees it."""
STREAM_ID = "camera-360"
"""Camera that live surfaces are taken from."""
SIMPLIFIED_M = 0.004
"""Points of a drawn line nearer than that to the last one are left out: a pen's width."""
MAX_POINTS = 2000
"""Of one annotation: 8 m of a drawn line."""


def primitive_added(
    document: Document,
    scanned: Mapping[str, Pose],
    *,
    shape: Shape,
    place: ArrayLike,
    size_m: Sequence[float] = (0.3, 0.3, 0.3),
    yaw_rad: float = 0.0,
) -> tuple[Document, str]:
    """A virtual body more, standing on `place` (3,).

    Raises:
        EditError: no such shape, a size out of bounds, or a place that is none.
    """
    if shape not in SHAPES:
        raise EditError(f"primitive: shape {shape!r}, wanted one of {', '.join(SHAPES)}")
    primitive_id = new_id(document, scanned, shape)
    colour = COLOURS[len(document.twin.primitives) % len(COLOURS)]
    pose = Pose.from_yaw(yaw_rad, checked_place(primitive_id, place))
    size = _checked_size(primitive_id, shape, size_m)
    item = Primitive(primitive_id, shape, size, colour, pose)
    twin = document.twin
    twin = replace(twin, primitives=with_item(twin.primitives, primitive_id, item))
    return replace(document, twin=twin), primitive_id


def primitive_resized(document: Document, primitive_id: str, size_m: Sequence[float]) -> Document:
    """A virtual body of another size; it stays where it stands.

    Raises:
        EditError: no such primitive, or a side out of bounds.
    """
    items = document.twin.primitives
    if primitive_id not in items:
        raise EditError(f"{primitive_id!r}: no such primitive; there are: {sorted(items)}")
    item = items[primitive_id]
    resized = replace(item, size_m=_checked_size(primitive_id, item.shape, size_m))
    twin = replace(document.twin, primitives=with_item(items, primitive_id, resized))
    return replace(document, twin=twin)


def mesh_added(
    document: Document,
    scanned: Mapping[str, Pose],
    geometry: Geometry,
    *,
    source: str,
    place: ArrayLike,
    yaw_rad: float = 0.0,
    unit: str = "m",
    up: Axis = "z",
) -> tuple[Document, str]:
    """A mesh more, standing on `place` (3,).

    Args:
        document: without it.
        scanned: see the module.
        geometry: its triangles.
        source: name of the file it came from.
        place: of the middle of its base, world metres.
        yaw_rad: heading.
        unit: that the file's lengths were taken to be in.
        up: which of its axes was taken to be up.

    Raises:
        EditError: the place is none.
    """
    mesh_id = new_id(document, scanned, "mesh")
    pose = Pose.from_yaw(yaw_rad, checked_place(mesh_id, place))
    item = AddedMesh(mesh_id, source, geometry, pose, unit, up)
    twin = document.twin
    twin = replace(twin, meshes=with_item(twin.meshes, mesh_id, item))
    return replace(document, twin=twin), mesh_id


def avatar_added(
    document: Document,
    scanned: Mapping[str, Pose],
    *,
    place: ArrayLike,
    facing_rad: float = 0.0,
    role: str = "remote",
) -> tuple[Document, str]:
    """A person more, standing on `place` (3,), who faces a heading about up, from world +X.

    Raises:
        EditError: no such role, or a place that is none.
    """
    if role not in ROLES:
        raise EditError(f"avatar: role {role!r}, wanted one of {', '.join(ROLES)}")
    user_id = new_id(document, scanned, role)
    head = checked_place(user_id, place) + np.array([0.0, 0.0, EYE_HEIGHT_M])
    ahead = np.array([math.cos(facing_rad), math.sin(facing_rad), 0.0])
    world_from_head = look_at(head, head + ahead)
    hands = tuple(world_from_head @ np.array([hand]) for hand in HANDS_M)
    twin = document.twin
    person = Avatar(user_id, role, world_from_head, hands)
    return replace(
        document, twin=replace(twin, avatars=with_item(twin.avatars, user_id, person))
    ), user_id


def camera_added(
    document: Document, scanned: Mapping[str, Pose], *, place: ArrayLike, looks_at: ArrayLike
) -> tuple[Document, str]:
    """A camera more at `place` (3,) that looks at a point (3,), level.

    Raises:
        EditError: one of the two is no place, or they are the same.
    """
    camera_id = new_id(document, scanned, "camera")
    eye, target = checked_place(camera_id, place), checked_place(camera_id, looks_at)
    if np.linalg.norm(target - eye) < 1e-3:
        raise EditError(f"{camera_id}: looks at its own place {eye.tolist()}; wanted another point")
    twin = document.twin
    cameras = with_item(twin.cameras, camera_id, look_at(eye, target))
    return replace(document, twin=replace(twin, cameras=cameras)), camera_id


def surface_added(
    document: Document,
    scanned: Mapping[str, Pose],
    picks: ArrayLike,
    *,
    eye: ArrayLike | None = None,
) -> tuple[Document, str]:
    """A live surface more, of four picks in any order.

    Args:
        document: without it.
        scanned: see the module.
        picks: (4, 3) world metres.
        eye: (3,) from where they were picked: its picture is upright for whoever stands there. None
            takes the picks as they are: clockwise from the top left.

    Raises:
        EditError: they span no flat convex quad.
    """
    surface_id = new_id(document, scanned, "surface")
    corners = _checked_points(surface_id, picks, count=4)
    if eye is not None:
        corners = ordered_corners(corners, checked_place(surface_id, eye))
    surface = LiveSurface(surface_id, corners, _picture_px(surface_id, corners), STREAM_ID)
    twin = document.twin
    surfaces = with_item(twin.surfaces, surface_id, surface)
    return replace(document, twin=replace(twin, surfaces=surfaces)), surface_id


def corner_dragged(document: Document, surface_id: str, corner: int, place: ArrayLike) -> Document:
    """A live surface with one corner (0 top left, clockwise) at another place (3,).

    Raises:
        EditError: no such surface or corner, or the corners would span no flat convex quad.
    """
    surfaces = document.twin.surfaces
    if surface_id not in surfaces:
        raise EditError(f"{surface_id!r}: no such live surface; there are: {sorted(surfaces)}")
    if corner not in range(4):
        raise EditError(f"{surface_id}: corner {corner!r}, wanted 0 to 3 (0 is the top left)")
    corners = surfaces[surface_id].corners_in_world.copy()
    corners[corner] = checked_place(surface_id, place)
    _picture_px(surface_id, corners)
    dragged = replace(surfaces[surface_id], corners_in_world=corners)
    twin = replace(document.twin, surfaces=with_item(surfaces, surface_id, dragged))
    return replace(document, twin=twin)


def annotated(
    document: Document,
    scanned: Mapping[str, Pose],
    points: ArrayLike,
    *,
    user_id: str = "me",
    colour: tuple[float, float, float] | None = None,
) -> tuple[Document, str]:
    """A line more through points (N, 3) of the world.

    Raises:
        EditError: fewer than two different points, too many, or one that is no place.
    """
    annotation_id = new_id(document, scanned, "note")
    line = simplified(_checked_points(annotation_id, points))
    if len(line) < 2:
        raise EditError(f"{annotation_id}: a line of {len(line)} point; draw at least two apart")
    if len(line) > MAX_POINTS:
        raise EditError(f"{annotation_id}: a line of {len(line)} points, limit {MAX_POINTS}")
    twin = document.twin
    colour = colour or COLOURS[len(twin.annotations) % len(COLOURS)]
    note = Annotation(annotation_id, user_id, line, colour)
    notes = with_item(twin.annotations, annotation_id, note)
    return replace(document, twin=replace(twin, annotations=notes)), annotation_id


def projected(eye: ArrayLike, directions: ArrayLike, hit: Hit) -> NDArray[np.float64]:
    """A line drawn in the view, in the room: (N, 3) points on what its rays meet.

    A ray that meets nothing ends at the distance of the nearest one along the line that does.

    Args:
        eye: (3,) of the view, world metres.
        directions: (N, 3) of the rays through what was drawn, of any length.
        hit: what rays meet.

    Raises:
        EditError: a direction has no length, or no ray meets anything.
    """
    origin = checked_place("annotation", eye)
    rays = _checked_points("annotation", directions)
    lengths = np.linalg.norm(rays, axis=1, keepdims=True)
    if (lengths < 1e-9).any():
        raise EditError("annotation: a ray without direction; draw it anew")
    rays = rays / lengths
    met = [hit(origin, ray) for ray in rays]
    ranges = np.array([np.nan if p is None else float(np.linalg.norm(p - origin)) for p in met])
    there = np.flatnonzero(np.isfinite(ranges))
    if not len(there):
        raise EditError("annotation: the line meets nothing of the room; draw it over a surface")
    nearest = there[np.argmin(np.abs(np.arange(len(rays))[:, None] - there[None]), axis=1)]
    return origin + rays * ranges[nearest][:, None]


def simplified(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """The line without points that are hardly apart; its ends stay."""
    kept = [points[0]]
    for point in points[1:]:
        if np.linalg.norm(point - kept[-1]) >= SIMPLIFIED_M:
            kept.append(point)
    return np.array(kept)


def ordered_corners(picks: NDArray[np.float64], eye: NDArray[np.float64]) -> NDArray[np.float64]:
    """Four picks (4, 3), clockwise from the top left as seen from an eye (3,)."""
    centre = picks.mean(axis=0)
    away = centre - eye
    view = look_at(eye, centre) if np.linalg.norm(away) > 1e-6 else Pose.identity()
    seen = view.inverse() @ picks
    flat = seen[:, :2] / np.maximum(seen[:, 2:], 1e-6)
    middle = flat.mean(axis=0)
    # y runs down in a picture, so growing angles run clockwise.
    order = np.argsort(np.arctan2(*(flat - middle).T[::-1]), kind="stable")
    first = int(np.argmin((flat - middle)[order].sum(axis=1)))
    return picks[np.roll(order, -first)]


def _picture_px(surface_id: str, corners: NDArray[np.float64]) -> tuple[int, int]:
    """(width, height) of a surface's picture."""
    try:
        quad_of(corners)
    except ValueError as error:
        raise EditError(f"{surface_id}: {error}") from None
    sides = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    width, height = sides[0] + sides[2], sides[1] + sides[3]
    longest = max(width, height)
    return max(2, round(SURFACE_PX * width / longest)), max(2, round(SURFACE_PX * height / longest))


def _checked_points(
    item_id: str, points: ArrayLike, *, count: int | None = None
) -> NDArray[np.float64]:
    try:
        checked: NDArray[np.float64] | None = np.array(points, dtype=np.float64)
    except (ValueError, TypeError):
        checked = None
    is_list = checked is not None and checked.shape == (checked.size // 3, 3) and checked.size > 0
    if checked is None or not is_list or count not in (None, len(checked)):
        wanted = "some" if count is None else count
        raise EditError(f"{item_id}: points {points!r}, wanted {wanted} of (x, y, z)")
    for point in checked:
        checked_place(item_id, point)
    return checked


def _checked_size(
    item_id: str, shape: Shape, size_m: Sequence[float]
) -> tuple[float, float, float]:
    try:
        x, y, z = (float(side) for side in size_m)
    except (ValueError, TypeError):
        raise EditError(f"{item_id}: size {size_m!r}, wanted three lengths in m") from None
    if not all(MIN_SIZE_M <= side <= MAX_SIZE_M for side in (x, y, z)):
        raise EditError(
            f"{item_id}: size {x:g} × {y:g} × {z:g} m, limits {MIN_SIZE_M:g} to "
            f"{MAX_SIZE_M:g} m a side"
        )
    if shape == "ball":
        return x, x, x
    return (x, x, z) if shape == "cylinder" else (x, y, z)
