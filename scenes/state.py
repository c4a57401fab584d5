"""The state of a live room: immutable values and the reducer that makes the next one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from types import MappingProxyType
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

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
        corners_in_world: (4, 3) metres, clockwise from the top left; (0, 3) of one that is removed.
        size_px: (width, height) of the rectified picture.
        stream_id: which camera it is taken from.
    """

    surface_id: str
    corners_in_world: NDArray[np.float64]
    size_px: tuple[int, int]
    stream_id: str


@dataclass(frozen=True, slots=True, eq=False)
class Avatar:
    """A person as others see them.

    Attributes:
        user_id: unique in the session.
        role: "local" or "remote".
        world_from_head: OpenCV axes (x right, y down, z where the person looks).
        hands: (J, 3) joints per hand in world metres; may be empty.
        ray: (2, 3) start and end of the pointing ray in world metres, or None.
    """

    user_id: str
    role: str
    world_from_head: Pose
    hands: tuple[NDArray[np.float64], ...] = ()
    ray: NDArray[np.float64] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Annotation:
    """A polyline (N, 3) drawn in the world, in metres, by a user; without points it is erased."""

    annotation_id: str
    user_id: str
    points_in_world: NDArray[np.float64]
    colour: tuple[float, float, float]


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
        world_from_rig: pose of the 360° camera, or None before it is known.
    """

    version: int = 0
    t_ns: int = 0
    objects: Mapping[str, TrackedObject] = field(default_factory=lambda: MappingProxyType({}))
    surfaces: Mapping[str, LiveSurface] = field(default_factory=lambda: MappingProxyType({}))
    avatars: Mapping[str, Avatar] = field(default_factory=lambda: MappingProxyType({}))
    annotations: Mapping[str, Annotation] = field(default_factory=lambda: MappingProxyType({}))
    world_from_rig: Pose | None = None


StateChange = TrackedObject | LiveSurface | Avatar | AvatarGone | Annotation
"""Changes that the reducer accepts."""


def reduce_state(state: SceneState, change: StateChange, t_ns: int) -> SceneState:
    """Return the next state.

    The same state is returned for a pose older than the one known, and for the end of what is not
    there. A surface without corners and an annotation without points remove the one with their id.

    Args:
        state: current state; stays valid.
        change: a pose, surface, avatar or annotation, replacing the one with its id; or an
            avatar's end.
        t_ns: session time of the change.
    """
    match change:
        case TrackedObject():
            known = state.objects.get(change.object_id)
            if known is not None and known.t_ns > change.t_ns:
                return state
            changed = {"objects": _with(state.objects, change.object_id, change)}
        case LiveSurface():
            is_there = len(change.corners_in_world) > 0
            items = _set(state.surfaces, change.surface_id, value=change if is_there else None)
            changed = {"surfaces": items}
        case Avatar():
            changed = {"avatars": _with(state.avatars, change.user_id, change)}
        case AvatarGone():
            changed = {"avatars": _set(state.avatars, change.user_id, value=None)}
        case Annotation():
            is_there = len(change.points_in_world) > 0
            items = _set(
                state.annotations, change.annotation_id, value=change if is_there else None
            )
            changed = {"annotations": items}
    if all(value is getattr(state, name) for name, value in changed.items()):
        return state
    return replace(state, version=state.version + 1, t_ns=max(state.t_ns, t_ns), **changed)


def _with(mapping: Mapping[str, T], key: str, value: T) -> Mapping[str, T]:
    return MappingProxyType({**mapping, key: value})


def _set(mapping: Mapping[str, T], key: str, *, value: T | None) -> Mapping[str, T]:
    """Return the mapping with a value, or without it; the same one where it never was."""
    if value is not None:
        return _with(mapping, key, value)
    if key not in mapping:
        return mapping
    return MappingProxyType({k: v for k, v in mapping.items() if k != key})
