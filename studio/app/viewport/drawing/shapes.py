"""Plain shapes of a room beside its splats: people, bodies, lines, cameras."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, fields
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from scenes.bodies.crowd import Crowd, colour_of
from scenes.frames import ARROW_FROM_CYLINDER
from scenes.mesh import CollisionMesh
from scenes.pose import Pose
from scenes.state import (
    STANDS_WITHIN_M,
    LiveSurface,
    Proposal,
    SceneState,
    SharedPrimitive,
    lines_now,
)
from studio.app.model.documents.added_mesh import Geometry
from studio.app.model.documents.document import Primitive, TwinEdits, shown_pose
from studio.view.overlay import STATE_COLOURS
from studio.view.shared_things import OPEN, SHAFT_SHARE, SHAFT_WIDTH

Colour = tuple[float, float, float]
Points = NDArray[np.float64]

FRUSTUM_M = 0.35
"""How far the corners of a placed camera's frustum are drawn, metres."""

SIGMAS = 3.0
"""Radius of a covariance ellipsoid in standard deviations: 97 % of the mass in three dimensions."""

MIN_SIGMA_M = 0.004
"""A smaller ellipsoid would vanish inside the object, metres."""

LIFT_M = 0.02
"""Height of the way of a proposal over the floor, metres: it lies on the splats, not in them."""

PROPOSED: Colour = OPEN
"""Of that way."""

FORMS: Mapping[str, Literal["ball", "box", "cylinder"]] = MappingProxyType(
    {"box": "box", "sphere": "ball", "cylinder": "cylinder"}
)
"""Forms of shared primitives that are one body."""

GREY: Colour = (0.6, 0.66, 0.74)
BUSY: Colour = (0.29, 0.66, 0.91)
GREEN: Colour = (0.35, 0.85, 0.45)
"""Of the collision mesh, as in most programs that draw one."""


@dataclass(frozen=True, slots=True, eq=False)
class Solid:
    """A body of simple form.

    Attributes:
        key: names it from picture to picture.
        form: a ball and a cylinder fill the box of `size_m`; a cone points along +x.
        size_m: extents (x, y, z).
        colour: red, green, blue, 0..1.
        world_from_body: pose of the body's centre.
        opacity: 0..1.
    """

    key: str
    form: Literal["ball", "box", "cylinder", "cone"]
    size_m: tuple[float, float, float]
    colour: Colour
    world_from_body: Pose
    opacity: float = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """A polyline (N, 3) in world metres; NaN rows part it into pieces."""

    key: str
    points: Points
    colour: Colour
    width_px: float = 2.0


@dataclass(frozen=True, slots=True, eq=False)
class Wire:
    """A mesh as a wireframe, in world metres."""

    key: str
    mesh: CollisionMesh
    colour: Colour


@dataclass(frozen=True, slots=True, eq=False)
class Squares:
    """Coloured squares on the floor.

    Attributes:
        key: names it.
        corners: (N, 4, 3) world metres.
        colours: (N, 3) 0..1.
        opacity: 0..1.
    """

    key: str
    corners: Points
    colours: Points
    opacity: float = 0.6


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """Coloured triangles.

    Attributes:
        key: names it.
        geometry: in the body's frame.
        world_from_body: its pose.
        scale: factors along the body's axes.
    """

    key: str
    geometry: Geometry
    world_from_body: Pose
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class Skin:
    """A person's figure as it stands there.

    Attributes:
        key: names it.
        vertices: (V, 3) float32 world metres.
        normals: (V, 3) float32, outward.
        faces: (F, 3) int32; the same array as long as the same parts are shown.
        colours: (V, 3) uint8; the same array as long as it is the same person.
        fades: whether it is transparent where it stands before the viewer.
    """

    key: str
    vertices: NDArray[np.float32]
    normals: NDArray[np.float32]
    faces: NDArray[np.int32]
    colours: NDArray[np.uint8]
    fades: bool = False


Shape = Solid | Line | Wire | Squares | Surface | Skin


@dataclass(frozen=True, slots=True)
class Shown:
    """Layers that are drawn.

    Attributes:
        labels: names and states over objects and people.
        avatars: people.
        cameras: frusta of placed cameras, and the 360° camera.
        annotations: what people have drawn, put into the room and proposed.
        surfaces: edges of live surfaces.
        collision: wireframe of what stops objects.
        covariance: ellipsoids of the poses' uncertainty.
        errors: the tracker's error by place, on the floor.
        unseen: parts of objects' boxes that no photo saw.
    """

    labels: bool = True
    avatars: bool = True
    cameras: bool = True
    annotations: bool = True
    surfaces: bool = True
    collision: bool = False
    covariance: bool = False
    errors: bool = False
    unseen: bool = False

    @classmethod
    def of(cls, layers: Mapping[str, bool]) -> Shown:
        """The first values with those of a user's settings, by name; unknown names are passed."""
        known = {item.name for item in fields(cls)}
        return cls(**{name: is_on for name, is_on in layers.items() if name in known})


def shapes_of(
    state: SceneState,
    *,
    shown: Shown,
    twin: TwinEdits,
    world_from_rig: Pose | None,
    seen_by: str = "",
    crowd: Crowd | None = None,
) -> list[Shape]:
    """Everything but the splats.

    Args:
        state: what happens.
        shown: which kinds.
        twin: what was put into it: bodies, meshes and cameras.
        world_from_rig: the 360° camera, or None.
        seen_by: whose view it is: of themselves people see their hands and what they point at.
        crowd: people from picture to picture; None lays them out anew.
    """
    found: list[Shape] = []
    for key, item in twin.primitives.items():
        found.append(primitive_solid(item, shown_pose(state, key, item.world_from_primitive)))
    for key, mesh in twin.meshes.items():
        place = shown_pose(state, key, mesh.world_from_mesh)
        found.append(Surface(f"mesh {key}", mesh.geometry, place, mesh.scale))
    if shown.avatars:
        found += people_shapes(state, crowd or Crowd(), seen_by=seen_by)
    if shown.annotations:
        for line in lines_now(state):
            found.append(Line(f"note {line.annotation_id}", line.points_in_world, line.colour, 4.0))
        for body in state.primitives.values():
            found += shared_solids(body)
        found += [proposed_way(state, proposal) for proposal in state.proposals.values()]
    if shown.surfaces:
        found += [surface_outline(surface) for surface in state.surfaces.values()]
    if shown.cameras:
        others = {key: pose for key, pose in twin.cameras.items() if key != seen_by}
        found += [frustum(f"camera {key}", pose) for key, pose in others.items()]
        if world_from_rig is not None and seen_by != "camera":
            found += rig_shapes(world_from_rig)
    if shown.covariance:
        found += list(_ellipsoids(state))
    return found


def primitive_solid(item: Primitive, world_from_base: Pose) -> Solid:
    """A virtual body that stands somewhere."""
    up = Pose(np.eye(3), np.array([0.0, 0.0, 0.5 * item.size_m[2]]))
    return Solid(
        f"body {item.primitive_id}",
        item.shape,
        item.size_m,
        item.colour,
        world_from_base @ up,
    )


def shared_solids(item: SharedPrimitive) -> list[Shape]:
    """Return a primitive that somebody shares: one body, or an arrow's shaft and head."""
    x, y, z = item.size_m
    key = f"shared {item.primitive_id}"
    world_from_middle = item.world_from_primitive @ Pose(np.eye(3), np.array([0, 0, 0.5 * z]))
    if item.shape == "arrow":
        shaft, head = SHAFT_SHARE * x, (1.0 - SHAFT_SHARE) * x
        at_shaft = Pose(ARROW_FROM_CYLINDER.rotation, np.array([0.5 * (shaft - x), 0.0, 0.0]))
        at_head = Pose(np.eye(3), np.array([0.5 * (x - head), 0.0, 0.0]))
        thin = (SHAFT_WIDTH * z, SHAFT_WIDTH * y, shaft)
        return [
            Solid(f"{key} shaft", "cylinder", thin, item.colour, world_from_middle @ at_shaft),
            Solid(f"{key} head", "cone", (head, y, z), item.colour, world_from_middle @ at_head),
        ]
    form = FORMS[item.shape or "box"]
    return [Solid(key, form, item.size_m, item.colour, world_from_middle)]


def proposed_way(state: SceneState, proposal: Proposal) -> Line:
    """Return the way from where an object is to where it is proposed to go."""
    wanted = proposal.world_from_object.translation
    tracked = state.objects.get(proposal.object_id)
    start = wanted if tracked is None else tracked.world_from_object.translation
    if float(np.linalg.norm(start - wanted)) < STANDS_WITHIN_M:
        start = wanted + np.array([0.0, 0.0, STANDS_WITHIN_M])
    lifted = np.stack([start, wanted]) + np.array([0.0, 0.0, LIFT_M])
    return Line(f"proposal {proposal.proposal_id}", lifted, PROPOSED, 2.0)


def people_shapes(state: SceneState, crowd: Crowd, *, seen_by: str) -> list[Shape]:
    """Return everybody, and what they point at; of themselves people see forearms and hands."""
    found: list[Shape] = []
    objects = {key: track.world_from_object for key, track in state.objects.items()}
    figures = crowd.figures(state.avatars, state.t_ns, objects=objects)
    for avatar in state.avatars.values():
        person, key = figures[avatar.user_id], f"avatar {avatar.user_id}"
        is_own = avatar.user_id == seen_by
        if not is_own or avatar.hands:
            found.append(
                Skin(
                    f"{key} arms" if is_own else f"{key} body",
                    person.vertices,
                    person.normals,
                    person.arm_faces if is_own else person.faces,
                    person.colours,
                    fades=avatar.role == "remote" and not is_own,
                )
            )
        if avatar.ray is not None:
            found.append(Line(f"{key} ray", avatar.ray, colour_of(avatar), 2.5))
    return found


def surface_outline(surface: LiveSurface) -> Line:
    """The edge of a live surface."""
    corners = surface.seen_in_world
    return Line(f"surface {surface.surface_id}", corners[[0, 1, 2, 3, 0]], BUSY, 2.0)


def frustum(key: str, world_from_camera: Pose) -> Line:
    """A camera's place and what it looks at, as edges of a pyramid (OpenCV axes)."""
    x, y = 0.6 * FRUSTUM_M, 0.34 * FRUSTUM_M
    eye, z = np.zeros(3), FRUSTUM_M
    a, b, c, d = (np.array([sx * x, sy * y, z]) for sx, sy in ((-1, -1), (1, -1), (1, 1), (-1, 1)))
    path = np.array([eye, a, b, eye, c, d, eye, b, c, d, a])
    return Line(key, world_from_camera @ path, GREY, 2.0)


def rig_shapes(world_from_rig: Pose) -> list[Shape]:
    """The 360° camera: its body and the way its front lens looks."""
    up = Pose(np.eye(3), world_from_rig.translation)
    ahead = world_from_rig @ np.array([[0.0, 0.0, 0.04], [0.0, 0.0, 0.3]])
    return [
        Solid("camera body", "box", (0.05, 0.05, 0.13), (0.12, 0.13, 0.15), up),
        Line("camera front", ahead, BUSY, 3.0),
    ]


def box_edges(key: str, box_m: tuple[float, float, float], world_from_object: Pose) -> Line:
    """The edges of an object's box, which stands on its base."""
    x, y, z = 0.5 * box_m[0], 0.5 * box_m[1], box_m[2]
    floor = np.array([[x, y, 0], [-x, y, 0], [-x, -y, 0], [x, -y, 0], [x, y, 0]], dtype=float)
    top = floor + np.array([0.0, 0.0, z])
    gap = np.full((1, 3), np.nan)
    posts = [np.stack([floor[i], top[i]]) for i in range(4)]
    parts = [floor, gap, top]
    for post in posts:
        parts += [gap, post]
    path = np.concatenate(parts)
    return Line(key, world_from_object @ path, BUSY, 2.5)


def pieces(points: Points) -> list[Points]:
    """A polyline parted at its NaN rows."""
    holes = np.flatnonzero(np.isnan(points).any(axis=1))
    return [part[~np.isnan(part).any(axis=1)] for part in np.split(points, holes) if len(part)]


def _ellipsoids(state: SceneState) -> Iterator[Solid]:
    for key, track in state.objects.items():
        covariance = np.asarray(track.covariance)[:3, :3]
        values, axes = np.linalg.eigh(0.5 * (covariance + covariance.T))
        if np.linalg.det(axes) < 0:
            axes = axes * (1, 1, -1)
        sigma = np.sqrt(np.maximum(values, MIN_SIGMA_M**2))
        x, y, z = (float(2 * SIGMAS * s) for s in sigma)
        r, g, b = STATE_COLOURS[track.state]
        place = Pose(axes, track.world_from_object.translation + np.array([0.0, 0.0, 0.02]))
        colour = (r / 255, g / 255, b / 255)
        yield Solid(f"covariance {key}", "ball", (x, y, z), colour, place, 0.55)


def without(shapes: Iterable[Shape], key: str) -> list[Shape]:
    """Shapes of another key."""
    return [shape for shape in shapes if shape.key != key]
