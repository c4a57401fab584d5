"""The state of a live room: immutable values and the reducer that makes the next one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from types import MappingProxyType
from typing import Literal, TypeVar, get_args

import numpy as np
from numpy.typing import NDArray

from scenes.coverage.record import Coverage
from scenes.mesh import BoxPart
from scenes.pose import Pose
from scenes.splats import SplatCloud

T = TypeVar("T")


class TrackState(StrEnum):
    """Knowledge of the tracker about an object in a frame."""

    STATIC = "static"
    """Seen at rest where it was."""
    TRACKED = "tracked"
    """Moving or moved, and measured in this frame."""
    OCCLUDED = "occluded"
    """Hidden in whole or part: the pose is held or predicted."""
    LOST = "lost"
    """Not found where it should be; being searched for."""


@dataclass(frozen=True, slots=True, eq=False)
class ObjectModel:
    """A movable object as the scan knows it.

    Attributes:
        object_id: unique in the scene.
        name: shown to people.
        kind: shared by identical twins; empty if unique.
        splats: in the object's frame (origin on the support plane, Z up), metres.
        box_m: extents (x, y, z) in metres of the up-fixed bounding box.
        support_z_m: height of the plane it stood on in the scan, world metres.
        world_from_object: last known pose.
        parts: solid boxes for contact, in the object's frame; empty where nobody has made any.
        guessed_mass_kg: from its size alone, easily wrong by a factor of three; None if not
            guessed.
        coverage: from where photos saw its splats; None where nobody has measured it.

    Raises:
        ValueError: the coverage is of another number of splats.
    """

    object_id: str
    name: str
    kind: str
    splats: SplatCloud
    box_m: tuple[float, float, float]
    support_z_m: float
    world_from_object: Pose
    parts: tuple[BoxPart, ...] = ()
    guessed_mass_kg: float | None = None
    coverage: Coverage | None = None

    def __post_init__(self) -> None:
        if self.coverage is not None and len(self.coverage) != len(self.splats):
            raise ValueError(
                f"object {self.object_id!r}: coverage of {len(self.coverage)} splats, wanted of "
                f"its {len(self.splats)}; other splats need a coverage measured anew, or None"
            )

    def sphere(self) -> tuple[NDArray[np.float64], float]:
        """(3,) centre of the box in the object's frame, and the radius that holds the box."""
        return np.array([0.0, 0.0, 0.5 * self.box_m[2]]), 0.5 * float(np.linalg.norm(self.box_m))


SURE = 0.5
"""Confidence below which a tracker says of itself that a pose may be wrong: likelier than not."""


@dataclass(frozen=True, slots=True, eq=False)
class TrackedObject:
    """One object's pose at one frame.

    Attributes:
        object_id: which object.
        t_ns: capture time of the frame, session clock.
        world_from_object: estimated pose.
        covariance: (4, 4) of x, y, z in metres and yaw in radians.
        visible_fraction: 0..1 of the silhouette that is not hidden.
        state: see `TrackState`.
        confidence: 0..1.
        source_seq: sequence number of the frame.
    """

    object_id: str
    t_ns: int
    world_from_object: Pose
    covariance: NDArray[np.float64]
    visible_fraction: float
    state: TrackState
    confidence: float
    source_seq: int

    @property
    def is_flagged(self) -> bool:
        """Whether the tracker says of itself that this pose may be wrong."""
        return self.state in (TrackState.LOST, TrackState.OCCLUDED) or self.confidence < SURE


@dataclass(frozen=True, slots=True, eq=False)
class LiveSurface:
    """A quad that shows live video (paper 4.3).

    Attributes:
        surface_id: unique in the session.
        corners_in_world: (4, 3) metres, clockwise from the top left, between which it is filmed;
            (0, 3) of one that is removed.
        size_px: (width, height) of the rectified picture.
        stream_id: which camera it is taken from.
        carried_to: (4, 3) metres, between which its picture is seen where somebody has carried it
            away; None where it is seen in its place.
    """

    surface_id: str
    corners_in_world: NDArray[np.float64]
    size_px: tuple[int, int]
    stream_id: str
    carried_to: NDArray[np.float64] | None = None

    @property
    def seen_in_world(self) -> NDArray[np.float64]:
        """(4, 3) corners between which its picture is seen."""
        return self.corners_in_world if self.carried_to is None else self.carried_to


@dataclass(frozen=True, slots=True, eq=False)
class Avatar:
    """A person as others see them.

    Attributes:
        user_id: unique in the session.
        role: "local" or "remote".
        world_from_head: OpenCV axes (x right, y down, z where the person looks).
        hands: (J, 3) joints per hand in world metres; may be empty.
        ray: (2, 3) start and end of the pointing ray in world metres, or None.
        name: as they call themselves; empty where they have none.
        gaze: (2, 3) an eye and a point a metre ahead of it where it looks, or None.
    """

    user_id: str
    role: str
    world_from_head: Pose
    hands: tuple[NDArray[np.float64], ...] = ()
    ray: NDArray[np.float64] | None = None
    name: str = ""
    gaze: NDArray[np.float64] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Annotation:
    """A line that a user has drawn.

    Attributes:
        annotation_id: unique in the session.
        user_id: whose it is.
        points_in_world: (N, 3) metres, where they were drawn; none of one that is erased.
        colour: red, green, blue, 0..1.
        object_id: on which it was drawn, and with which it goes; empty of one that stays.
        world_from_object: of that object where the line was begun, to which all points belong.
    """

    annotation_id: str
    user_id: str
    points_in_world: NDArray[np.float64]
    colour: tuple[float, float, float]
    object_id: str = ""
    world_from_object: Pose | None = None


PrimitiveShape = Literal["box", "sphere", "cylinder", "arrow"]
"""Forms of shared primitives: boxes and cylinders stand for furniture and for free space, a sphere
marks a place, an arrow says which way."""

PRIMITIVE_SHAPES: tuple[PrimitiveShape, ...] = get_args(PrimitiveShape)
"""The same, to be looked through."""


@dataclass(frozen=True, slots=True, eq=False)
class SharedPrimitive:
    """A plain body that a user has put into the room, shown to everybody.

    Attributes:
        primitive_id: unique in the session.
        user_id: whose it is.
        shape: None of one that is erased. An arrow points along its +x.
        size_m: extents (x, y, z).
        colour: red, green, blue, 0..1.
        world_from_primitive: its origin is the middle of its base, Z up.
    """

    primitive_id: str
    user_id: str
    shape: PrimitiveShape | None
    size_m: tuple[float, float, float]
    colour: tuple[float, float, float]
    world_from_primitive: Pose


STANDS_WITHIN_M, STANDS_WITHIN_RAD = 0.05, float(np.radians(10.0))
"""How far an object may be off and still stand where it was proposed, metres and radians. The
tracker's error at 95 % (3.4 cm of an object that is carried, 1.1 cm and 0.6° at rest, see
docs/evaluation.md) and that of somebody who places a chair by eye (3 cm and 9°, chosen), added as
squares: 4.5 cm and 9.0°, rounded up."""


@dataclass(frozen=True, slots=True, eq=False)
class Proposal:
    """A copy of a tracked object that a user has put where the object itself should go.

    Attributes:
        proposal_id: unique in the session.
        user_id: whose it is.
        user_name: as they called themselves.
        object_id: what is to be moved; empty of one that is withdrawn.
        world_from_object: where to.
    """

    proposal_id: str
    user_id: str
    user_name: str
    object_id: str
    world_from_object: Pose

    def is_met(self, world_from_object: Pose, *, symmetry: int = 1) -> bool:
        """Return whether an object that is somewhere stands as proposed.

        Args:
            world_from_object: where it is.
            symmetry: how many yaws in a turn look the same; 0 where all do.
        """
        apart = world_from_object.translation - self.world_from_object.translation
        if not float(np.linalg.norm(apart)) <= STANDS_WITHIN_M:
            return False
        turn = self.world_from_object.rotation.T @ world_from_object.rotation
        if symmetry == 1:
            cosine = 0.5 * (float(np.trace(turn)) - 1.0)
            return float(np.arccos(np.clip(cosine, -1.0, 1.0))) <= STANDS_WITHIN_RAD
        lean = float(np.arccos(np.clip(turn[2, 2], -1.0, 1.0)))
        if lean > STANDS_WITHIN_RAD or symmetry == 0:
            return lean <= STANDS_WITHIN_RAD
        yaw = float(np.arctan2(turn[1, 0] - turn[0, 1], turn[0, 0] + turn[1, 1]))
        step = 2.0 * np.pi / symmetry
        return abs((yaw + 0.5 * step) % step - 0.5 * step) <= STANDS_WITHIN_RAD


@dataclass(frozen=True, slots=True)
class AvatarGone:
    """End of an avatar: its user has left, or shows no body any more."""

    user_id: str


@dataclass(frozen=True, slots=True, eq=False)
class SceneState:
    """Everything a viewer needs to draw one instant. Every change makes a new value.

    Attributes:
        version: grows by one per change.
        t_ns: session time of the newest change.
        objects: by object id.
        surfaces: by surface id.
        avatars: by user id.
        annotations: by annotation id.
        primitives: by primitive id.
        proposals: by proposal id.
        world_from_rig: pose of the 360° camera, or None before it is known.
    """

    version: int = 0
    t_ns: int = 0
    objects: Mapping[str, TrackedObject] = field(default_factory=lambda: MappingProxyType({}))
    surfaces: Mapping[str, LiveSurface] = field(default_factory=lambda: MappingProxyType({}))
    avatars: Mapping[str, Avatar] = field(default_factory=lambda: MappingProxyType({}))
    annotations: Mapping[str, Annotation] = field(default_factory=lambda: MappingProxyType({}))
    primitives: Mapping[str, SharedPrimitive] = field(default_factory=lambda: MappingProxyType({}))
    proposals: Mapping[str, Proposal] = field(default_factory=lambda: MappingProxyType({}))
    world_from_rig: Pose | None = None


Placed = SharedPrimitive | Proposal
"""Things that people put into the room with a pose."""

Shared = Annotation | Placed
"""Things that people put into the room, but for live surfaces."""

StateChange = TrackedObject | LiveSurface | Avatar | AvatarGone | Shared
"""Changes that the reducer accepts."""


def reduce_state(state: SceneState, change: StateChange, t_ns: int) -> SceneState:
    """Return the next state.

    The same state is returned for a pose older than the one known, and for the end of what is not
    there. A surface without corners, an annotation without points, a primitive without shape and a
    proposal without object remove the one with their id.

    Args:
        state: current state; stays valid.
        change: a pose, surface, avatar, annotation, primitive or proposal, replacing the one with
            its id; or an avatar's end.
        t_ns: session time of the change.
    """
    match change:
        case TrackedObject():
            known = state.objects.get(change.object_id)
            if known is not None and known.t_ns > change.t_ns:
                return state
            changed = {"objects": _with(state.objects, change.object_id, change)}
        case LiveSurface():
            value = change if is_there(change) else None
            items = _set(state.surfaces, change.surface_id, value=value)
            changed = {"surfaces": items}
        case Avatar():
            changed = {"avatars": _with(state.avatars, change.user_id, change)}
        case AvatarGone():
            changed = {"avatars": _set(state.avatars, change.user_id, value=None)}
        case Annotation():
            value = change if is_there(change) else None
            changed = {"annotations": _set(state.annotations, change.annotation_id, value=value)}
        case SharedPrimitive():
            value = change if is_there(change) else None
            changed = {"primitives": _set(state.primitives, change.primitive_id, value=value)}
        case Proposal():
            value = change if is_there(change) else None
            changed = {"proposals": _set(state.proposals, change.proposal_id, value=value)}
    if all(value is getattr(state, name) for name, value in changed.items()):
        return state
    return replace(state, version=state.version + 1, t_ns=max(state.t_ns, t_ns), **changed)


def lines_now(state: SceneState) -> tuple[Annotation, ...]:
    """Return the lines where they are: those that were drawn on objects have gone along with them.

    A line whose object nobody follows stays where it was drawn.
    """
    return tuple(_line_now(line, state.objects) for line in state.annotations.values())


def _line_now(line: Annotation, objects: Mapping[str, TrackedObject]) -> Annotation:
    track = objects.get(line.object_id)
    if track is None or line.world_from_object is None:
        return line
    now_from_then = track.world_from_object @ line.world_from_object.inverse()
    return replace(line, points_in_world=now_from_then @ line.points_in_world)


def is_there(value: LiveSurface | Shared) -> bool:
    """Return whether a thing is in the room, rather than the end of one."""
    match value:
        case LiveSurface():
            return len(value.corners_in_world) > 0
        case Annotation():
            return len(value.points_in_world) > 0
        case SharedPrimitive():
            return value.shape is not None
        case Proposal():
            return value.object_id != ""


def id_of(value: LiveSurface | Shared) -> str:
    """Return the id of a thing that people put into the room."""
    match value:
        case LiveSurface():
            return value.surface_id
        case Annotation():
            return value.annotation_id
        case SharedPrimitive():
            return value.primitive_id
        case Proposal():
            return value.proposal_id


def _with(mapping: Mapping[str, T], key: str, value: T) -> Mapping[str, T]:
    return MappingProxyType({**mapping, key: value})


def _set(mapping: Mapping[str, T], key: str, *, value: T | None) -> Mapping[str, T]:
    """Return the mapping with a value, or without it; the same one where it never was."""
    if value is not None:
        return _with(mapping, key, value)
    if key not in mapping:
        return mapping
    return MappingProxyType({k: v for k, v in mapping.items() if k != key})
