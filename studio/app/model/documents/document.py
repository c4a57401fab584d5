"""The document that a user edits: a scene, its scenario, and changes of the twin by hand."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any, Literal, Protocol, TypeVar

import numpy as np

from scenes.pose import Pose
from scenes.state import (
    Annotation,
    Avatar,
    LiveSurface,
    SceneState,
    TrackedObject,
    TrackState,
    reduce_state,
)
from studio.app.model.documents.added_mesh import AddedMesh
from tracking.options import TrackerOptions

T = TypeVar("T")

Shape = Literal["box", "ball", "cylinder"]


def no_items() -> Mapping[str, Any]:
    """An empty mapping that nobody can change."""
    return MappingProxyType({})


@dataclass(frozen=True, slots=True, eq=False)
class Primitive:
    """A virtual body that a user has put into the twin.

    Attributes:
        primitive_id: unique in the document.
        shape: of a ball and a cylinder, x is the diameter.
        size_m: extents (x, y, z), metres.
        colour: red, green, blue, 0..1.
        world_from_primitive: its frame stands on the body's base, Z up.
    """

    primitive_id: str
    shape: Shape
    size_m: tuple[float, float, float]
    colour: tuple[float, float, float]
    world_from_primitive: Pose


@dataclass(frozen=True, slots=True)
class Marker:
    """A named instant of the timeline."""

    t_ns: int
    text: str


@dataclass(frozen=True, slots=True, eq=False)
class TwinEdits:
    """Changes of the twin by hand, by id.

    Attributes:
        poses: `world_from_object` of objects that were moved.
        names: of objects that were renamed.
        primitives: virtual bodies.
        avatars: people who were placed.
        cameras: `world_from_camera` of cameras that were placed (OpenCV axes).
        surfaces: where live video is shown.
        annotations: lines that were drawn.
        meshes: of files, that were put into the room.
    """

    poses: Mapping[str, Pose] = field(default_factory=no_items)
    names: Mapping[str, str] = field(default_factory=no_items)
    primitives: Mapping[str, Primitive] = field(default_factory=no_items)
    avatars: Mapping[str, Avatar] = field(default_factory=no_items)
    cameras: Mapping[str, Pose] = field(default_factory=no_items)
    surfaces: Mapping[str, LiveSurface] = field(default_factory=no_items)
    annotations: Mapping[str, Annotation] = field(default_factory=no_items)
    meshes: Mapping[str, AddedMesh] = field(default_factory=no_items)


@dataclass(frozen=True, slots=True)
class TrackerChoice:
    """Tracker of the next session, with its settings.

    Attributes:
        name: of a built-in one, or of a plug-in's.
        is_beside: whether our own runs beside it, for comparison.
        options: of our own.
    """

    name: str = "own"
    is_beside: bool = False
    options: TrackerOptions = field(default_factory=TrackerOptions)


@dataclass(frozen=True, slots=True, eq=False)
class Document:
    """Everything that is saved with a project. Every edit makes a new value.

    Attributes:
        scene: name of a built-in room, or path of a package or splat file.
        scenario_name: what the scenario is called; a rehearsal of it is named so.
        scenario: TOML text with its comments; empty for the scene's own scenario.
        seed: of everything random in a rehearsal.
        twin: what was changed by hand.
        markers: of the timeline, in order of time.
        tracker: of the next session.
        draft: text of the scenario that was typed and is none yet; None if there is no such.
    """

    scene: str
    scenario_name: str = ""
    scenario: str = ""
    seed: int = 0
    twin: TwinEdits = field(default_factory=TwinEdits)
    markers: tuple[Marker, ...] = ()
    tracker: TrackerChoice = field(default_factory=TrackerChoice)
    draft: str | None = None


def with_item(items: Mapping[str, T], key: str, value: T) -> Mapping[str, T]:
    """The mapping with one item added or replaced."""
    return MappingProxyType({**items, key: value})


def without_item(items: Mapping[str, T], key: str) -> Mapping[str, T]:
    """The mapping without one item; the same if it has none of that key."""
    return MappingProxyType({k: v for k, v in items.items() if k != key})


def hand_state(twin: TwinEdits) -> SceneState:
    """The state of the room as it was arranged by hand, before any session."""
    changes: list[TrackedObject | LiveSurface | Avatar | Annotation] = [
        _placed(object_id, pose) for object_id, pose in twin.poses.items()
    ]
    changes += [*twin.surfaces.values(), *twin.avatars.values(), *twin.annotations.values()]
    state = SceneState()
    for change in changes:
        state = reduce_state(state, change, 0)
    return state


def composed(base: SceneState | None, twin: TwinEdits) -> SceneState:
    """Compose the shown state: a session's or recording's, with what was added by hand.

    Objects are where the session has them; without one, where they were put by hand.
    """
    by_hand = hand_state(twin)
    if base is None:
        return by_hand
    return replace(
        base,
        surfaces=MappingProxyType({**by_hand.surfaces, **base.surfaces}),
        avatars=MappingProxyType({**by_hand.avatars, **base.avatars}),
        annotations=MappingProxyType({**by_hand.annotations, **base.annotations}),
    )


def shown_pose(state: SceneState, item_id: str, world_from_item: Pose) -> Pose:
    """Return the pose of a body or mesh: of the running physics, else as it was put."""
    moving = state.objects.get(item_id)
    return world_from_item if moving is None else moving.world_from_object


def _placed(object_id: str, world_from_object: Pose) -> TrackedObject:
    return TrackedObject(
        object_id=object_id,
        t_ns=0,
        world_from_object=world_from_object,
        covariance=np.zeros((4, 4)),
        visible_fraction=1.0,
        state=TrackState.STATIC,
        confidence=1.0,
        source_seq=0,
    )


@dataclass(frozen=True, slots=True, eq=False)
class Change:
    """One step of undo.

    Attributes:
        label: what was done, such as "Move chair-1".
        before: the document without it.
        after: the document with it.
        merge: changes in a row with the same key that is not empty are one step: a drag.
    """

    label: str
    before: Document
    after: Document
    merge: str = ""

    def merged(self, later: Change) -> Change | None:
        """Both as one step; None if they are two."""
        if not self.merge or self.merge != later.merge:
            return None
        return Change(self.label, self.before, later.after, self.merge)


class History(Protocol):
    """A stack of changes; the window's is Qt's undo stack."""

    @property
    def undoes(self) -> str:
        """Label of the change that `undo` takes back; "" if there is none."""
        ...

    @property
    def redoes(self) -> str:
        """Label of the change that `redo` makes again; "" if there is none."""
        ...

    def push(self, change: Change) -> None:
        """Remember a change that has been made."""
        ...

    def undo(self) -> None:
        """Take the last change back, if there is one."""
        ...

    def redo(self) -> None:
        """Make the change again that was taken back last."""
        ...

    def clear(self) -> None:
        """Forget all: another document was opened."""
        ...
