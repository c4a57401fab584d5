"""Items of the twin, as a list for people: kind, name, state, place, size, certainty."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from scenes.package import ScenePackage
from scenes.pose import Pose
from scenes.state import SceneState, TrackedObject, TrackState
from studio.app.model.documents.document import Document
from studio.app.model.names import shown_name
from studio.app.twin.bodies import mass_kg
from studio.app.twin.edits import ItemKind, heading_rad, kind_of, name_of, pose_of
from studio.reports.seen_sides import seen_words

TITLES = {
    ItemKind.OBJECT: "Objects",
    ItemKind.PRIMITIVE: "Primitives",
    ItemKind.PROPOSAL: "Proposals",
    ItemKind.AVATAR: "People",
    ItemKind.CAMERA: "Cameras",
    ItemKind.SURFACE: "Live surfaces",
    ItemKind.ANNOTATION: "Annotations",
    ItemKind.MESH: "Meshes",
}
"""Heading of each kind, in the order in which they are listed."""

STATES = {
    TrackState.STATIC: ("●", "at rest"),
    TrackState.TRACKED: ("▶", "tracked"),
    TrackState.OCCLUDED: ("◐", "hidden"),
    TrackState.LOST: ("✖", "lost"),
}
"""Shape and word of what the tracker knows."""


@dataclass(frozen=True, slots=True, eq=False)
class TwinItem:
    """One item of the twin.

    Attributes:
        item_id: unique.
        kind: what it is.
        name: shown to people.
        state: its shape and word, such as "● at rest".
        world_from_item: `world_from_item`, as `edits.pose_of` has it.
        yaw_deg: heading, or None for what is made of points.
        size_m: sides (x, y, z), or None.
        mass_kg: or None where nobody knows it.
        confidence: 0..1 of the tracker, or None where nothing is tracked.
        sigma: 1-sigma of x, y, z in m and yaw in rad, or None.
        seen: what photos saw of an object, in a sentence; "" of all else.
        is_moved: whether it is an object that was moved by hand.
        is_of_session: whether people of the session have it, and hands here cannot change it.
    """

    item_id: str
    kind: ItemKind
    name: str
    state: str
    world_from_item: Pose
    yaw_deg: float | None
    size_m: tuple[float, float, float] | None = None
    mass_kg: float | None = None
    confidence: float | None = None
    sigma: tuple[float, float, float, float] | None = None
    seen: str = ""
    is_moved: bool = False
    is_of_session: bool = False


def scanned_poses(scene: ScenePackage | None) -> dict[str, Pose]:
    """Return the scan's poses of its movable objects, by id."""
    return {} if scene is None else {o.object_id: o.world_from_object for o in scene.objects}


def items_of(
    scene: ScenePackage | None, document: Document, state: SceneState, *, is_by_hand: bool
) -> tuple[TwinItem, ...]:
    """Everything in the twin, by kind and in the order it was added.

    Args:
        scene: what is open.
        document: with what was edited.
        state: what is shown.
        is_by_hand: whether no session or recording decides where objects are.
    """
    scanned = scanned_poses(scene)
    items = [
        _object_item(scene, document, scanned, key, None if is_by_hand else state.objects.get(key))
        for key in scanned
    ]
    twin = document.twin
    tables = (twin.primitives, twin.avatars, twin.cameras, twin.surfaces, twin.annotations)
    for table in (*tables, twin.meshes):
        items += [_added_item(document, scanned, key) for key in table]
    known = {item.item_id for item in items}
    items += [
        item
        for item in _items_of_session(state, scene=scene, document=document)
        if item.item_id not in known
    ]
    return tuple(items)


def _items_of_session(
    state: SceneState, *, scene: ScenePackage | None, document: Document
) -> Iterator[TwinItem]:
    """Yield people, and what they have put into the room."""

    def called(item_id: str) -> str:
        return shown_name(item_id, document, scene, people=state.avatars)

    for key, avatar in state.avatars.items():
        pose, kind = avatar.world_from_head, ItemKind.AVATAR
        yaw = math.degrees(heading_rad(kind, pose))
        where = "on site" if avatar.role == "local" else "elsewhere"
        yield TwinItem(key, kind, called(key), where, pose, yaw, is_of_session=True)
    for key, body in state.primitives.items():
        pose, state_words = body.world_from_primitive, f"of {called(body.user_id)}"
        kind, name = ItemKind.PRIMITIVE, body.shape or key
        yaw = math.degrees(heading_rad(kind, pose))
        yield TwinItem(
            key, kind, name, state_words, pose, yaw, size_m=body.size_m, is_of_session=True
        )
    for key, proposal in state.proposals.items():
        pose, kind = proposal.world_from_object, ItemKind.PROPOSAL
        yaw = math.degrees(heading_rad(kind, pose))
        who = proposal.user_name or called(proposal.user_id)
        yield TwinItem(
            key, kind, called(proposal.object_id), f"of {who}", pose, yaw, is_of_session=True
        )
    for key, surface in state.surfaces.items():
        place = Pose(np.eye(3), surface.seen_in_world.mean(axis=0))
        words = "in its place" if surface.carried_to is None else "carried away"
        yield TwinItem(key, ItemKind.SURFACE, key, words, place, None, is_of_session=True)


def _object_item(
    scene: ScenePackage | None,
    document: Document,
    scanned: Mapping[str, Pose],
    item_id: str,
    tracked: TrackedObject | None,
) -> TwinItem:
    assert scene is not None
    model = scene.object_by_id(item_id)
    pose = pose_of(document, scanned, item_id)
    is_moved = item_id in document.twin.poses
    state = "◆ moved by hand" if is_moved else "○ as scanned"
    confidence, sigma = None, None
    if tracked is not None:
        pose, confidence = tracked.world_from_object, tracked.confidence
        state = " ".join(STATES[tracked.state])
        x, y, z, yaw = np.sqrt(np.maximum(np.diagonal(tracked.covariance), 0.0)).tolist()
        sigma = (x, y, z, yaw)
    return TwinItem(
        item_id,
        ItemKind.OBJECT,
        name_of(document, item_id, model.name),
        state,
        pose,
        math.degrees(heading_rad(ItemKind.OBJECT, pose)),
        size_m=model.box_m,
        mass_kg=model.guessed_mass_kg,
        confidence=confidence,
        sigma=sigma,
        seen=seen_words(model),
        is_moved=is_moved,
    )


def _added_item(document: Document, scanned: Mapping[str, Pose], item_id: str) -> TwinItem:
    kind = kind_of(document, scanned, item_id)
    pose = pose_of(document, scanned, item_id)
    is_turnable = kind not in (ItemKind.SURFACE, ItemKind.ANNOTATION)
    twin, size, mass = document.twin, None, None
    state = ""
    if kind is ItemKind.PRIMITIVE:
        body = twin.primitives[item_id]
        size, mass, state = body.size_m, mass_kg(body), body.shape
    elif kind is ItemKind.AVATAR:
        state = twin.avatars[item_id].role
    elif kind is ItemKind.SURFACE:
        width, height = twin.surfaces[item_id].size_px
        state = f"{width} × {height} px"
    elif kind is ItemKind.MESH:
        mesh = twin.meshes[item_id]
        size, state = mesh.size_m, mesh.source
    elif kind is ItemKind.ANNOTATION:
        state = f"{len(twin.annotations[item_id].points_in_world)} points"
    return TwinItem(
        item_id,
        kind,
        name_of(document, item_id),
        state,
        pose,
        math.degrees(heading_rad(kind, pose)) if is_turnable else None,
        size_m=size,
        mass_kg=mass,
    )
