"""A session's state on the local user's headset: people, lines, bodies, outlines of objects."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.hololens.display_list import MAX_ITEMS, Colour, Item, Label, Shape, Solid
from scenes.pose import Pose
from scenes.state import (
    Annotation,
    Avatar,
    ObjectModel,
    Proposal,
    SceneState,
    SharedPrimitive,
    TrackedObject,
    TrackState,
)
from studio.live.hololens.showing.edges import CORNERS, arrow, outline, polyline, rod

Floats = NDArray[np.float64]

HEAD_M, VISOR_M = (0.16, 0.22, 0.20), (0.17, 0.09, 0.06)
"""Size of an avatar's head and of the visor before it, metres: of a person with a headset."""

VISOR_AT_M = (0.0, -0.01, 0.10)
"""Middle of the visor from that of the head: x right, y down, z ahead."""

JOINT_M, TIP_M = 0.018, 0.014
"""Diameter of a hand's joints and of its fingertips, metres."""

SHOWN_JOINTS = (0, 2, 4, 6, 9, 11, 14, 16, 19, 21, 24)
"""Joints of 25 that are drawn: wrist, and of each finger knuckle and tip; the others say nothing
more from two metres, and cost the headset twice as much."""

TIPS = frozenset((4, 9, 14, 19, 24))
"""Fingertips among 25 joints."""

RAY_M, RAY_END_M = 0.006, 0.024
"""Width of a pointing ray, and of the ball at its end, metres."""

LINE_M, LINE_TOLERANCE_M = 0.008, 0.003
"""Width of a drawn line, and by how much what is seen of it may be off, metres."""

EDGE_M, PROPOSED_EDGE_M = 0.004, 0.008
"""Width of the edges of an object's outline, and of a proposed one's, metres."""

NAME_ABOVE_M, NAME_M = 0.24, 0.05
"""Height of a name above a head, and of its letters, metres."""

MAX_TEXT = 60
"""Characters of a name that are shown, chosen: more is wider than a person."""

TURN_RAD = math.radians(15.0)
"""Steps in which labels turn to the wearer: readable, and not sent anew at every step."""

SKIN: Colour = (0.93, 0.76, 0.62, 1.0)
VISOR: Colour = (0.10, 0.12, 0.15, 1.0)
"""Colours of hands, and of a headset."""

PERSON_COLOURS: tuple[Colour, ...] = (
    (0.25, 0.60, 0.95, 1.0),
    (0.95, 0.55, 0.20, 1.0),
    (0.45, 0.80, 0.40, 1.0),
    (0.85, 0.45, 0.80, 1.0),
)
"""Colours of people, by turns."""

STATE_COLOURS: Mapping[TrackState, Colour] = {
    TrackState.STATIC: (1.0, 1.0, 1.0, 0.35),
    TrackState.TRACKED: (0.2, 0.9, 1.0, 0.9),
    TrackState.OCCLUDED: (1.0, 0.75, 0.2, 0.6),
    TrackState.LOST: (1.0, 0.3, 0.2, 0.6),
}
"""Colours of an object's outline by what the tracker knows of it."""

PROPOSED: Colour = (1.0, 0.85, 0.2, 0.95)
MET: Colour = (0.3, 1.0, 0.4, 0.95)
"""Colours of a proposal's outline: before, and once its object stands there."""

OWNER: Colour = (1.0, 1.0, 1.0, 1.0)
"""Colour of the words that say whose a shape is: white, which none of the shapes' colours hides."""

OWNER_ABOVE_M = 0.08
"""Height of those words above a shape, as above a proposal."""

STILL_M, STILL_RAD = 0.0005, math.radians(0.15)
"""Movements of an item up to which it stays as it was sent, metres and radians."""


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """All that a display depends on beside the state.

    Attributes:
        device_from_world: the room's origin in the headset's world.
        models: objects of the scan by id.
        met: ids of proposals whose objects stand as proposed.
        wearer: id of the wearer, who is not drawn.
        eye: (3,) the wearer's head in the headset's world, which labels turn to; None unknown.
        passed: ids of shapes that have passed to somebody else a moment ago.
    """

    device_from_world: Pose
    models: Mapping[str, ObjectModel]
    met: frozenset[str]
    wearer: str
    eye: Floats | None = None
    passed: frozenset[str] = frozenset()


def items_of(state: SceneState, avatars: Iterable[Avatar], *, seen: Seen) -> dict[str, Item]:
    """Return what is to be on the display, by name: of more than fits, lines are left out first.

    Args:
        state: of the session.
        avatars: people, as new as they are known.
        seen: from where, and what is known of the objects.
    """
    found: dict[str, Item] = {}
    people = sorted(avatars, key=lambda each: each.user_id)
    names = {avatar.user_id: avatar.name for avatar in people}
    for number, avatar in enumerate(people):
        if avatar.user_id != seen.wearer:
            colour = PERSON_COLOURS[number % len(PERSON_COLOURS)]
            _put(found, f"person:{avatar.user_id}", parts=_person(avatar, colour, seen=seen))
    for key, proposal in state.proposals.items():
        _put(found, f"proposal:{key}", parts=_proposal(proposal, seen))
    for key, track in state.objects.items():
        _put(found, f"object:{key}", parts=_object(track, seen))
    for key, primitive in state.primitives.items():
        _put(found, f"primitive:{key}", parts=_primitive(primitive, seen))
        words = whose(primitive, names, seen=seen)
        _put(found, f"primitive:{key}", parts={"words": words})
    for key, line in state.annotations.items():
        _put(found, f"line:{key}", parts=_line(line, seen))
    return found


def steadied(before: Mapping[str, Item], now: Mapping[str, Item]) -> dict[str, Item]:
    """Return what is to be seen, with the very items of before where they have hardly changed."""
    found: dict[str, Item] = {}
    for name, item in now.items():
        old = before.get(name)
        found[name] = old if old is not None and _is_same(old, item) else item
    return found


def _put(found: dict[str, Item], prefix: str, *, parts: Mapping[str, Item | None]) -> None:
    for name, item in parts.items():
        if item is not None and len(found) < MAX_ITEMS:
            found[f"{prefix}:{name}"] = item


def _person(avatar: Avatar, colour: Colour, *, seen: Seen) -> dict[str, Item | None]:
    device_from_head = seen.device_from_world @ avatar.world_from_head
    visor = device_from_head @ Pose(np.eye(3), np.array(VISOR_AT_M))
    parts: dict[str, Item | None] = {
        "head": Solid(Shape.SPHERE, device_from_head, HEAD_M, colour),
        "visor": Solid(Shape.CUBE, visor, VISOR_M, VISOR),
    }
    for side, hand in enumerate(avatar.hands):
        for number in _shown(len(hand)):
            place = seen.device_from_world @ hand[number]
            size = TIP_M if number in TIPS else JOINT_M
            pose = Pose(np.eye(3), place)
            parts[f"hand{side}.{number}"] = Solid(Shape.SPHERE, pose, (size, size, size), SKIN)
    if avatar.ray is not None:
        start, end = seen.device_from_world @ avatar.ray
        parts["ray"] = rod(start, end, width_m=RAY_M, colour=colour)
        ball = Pose(np.eye(3), end)
        parts["ray-end"] = Solid(Shape.SPHERE, ball, (RAY_END_M, RAY_END_M, RAY_END_M), colour)
    if avatar.name:
        above = device_from_head.translation + np.array([0.0, 0.0, NAME_ABOVE_M])
        parts["name"] = _label(avatar.name, above, colour=colour, seen=seen)
    return parts


def _shown(count: int) -> Sequence[int]:
    """Return which joints of a hand are drawn: a controller is one."""
    return [number for number in SHOWN_JOINTS if number < count]


def _label(text: str, place: Floats, *, colour: Colour, seen: Seen) -> Label:
    """Return words above something, turned to the wearer in steps."""
    yaw = 0.0
    if seen.eye is not None:
        x, y = (place - seen.eye)[:2]
        # Read from -y: its y axis points away from who reads it.
        yaw = round((math.atan2(y, x) - 0.5 * math.pi) / TURN_RAD) * TURN_RAD
    return Label(text[:MAX_TEXT], Pose.from_yaw(yaw, place), NAME_M, colour)


def _object(track: TrackedObject, seen: Seen) -> Mapping[str, Item | None]:
    model = seen.models.get(track.object_id)
    if model is None:
        return {}
    pose = seen.device_from_world @ track.world_from_object
    return outline(pose, model.box_m, width_m=EDGE_M, colour=STATE_COLOURS[track.state])


def _proposal(proposal: Proposal, seen: Seen) -> Mapping[str, Item | None]:
    model = seen.models.get(proposal.object_id)
    if model is None:
        return {}
    is_met = proposal.proposal_id in seen.met
    colour = MET if is_met else PROPOSED
    pose = seen.device_from_world @ proposal.world_from_object
    parts: dict[str, Item | None] = dict(
        outline(pose, model.box_m, width_m=PROPOSED_EDGE_M, colour=colour)
    )
    above = pose @ np.array([0.0, 0.0, model.box_m[2] + 0.08])
    by = f" ({proposal.user_name})" if proposal.user_name else ""
    words = f"{model.name}: {'it stands here' if is_met else 'here, please'}{by}"
    parts["words"] = _label(words, above, colour=colour, seen=seen)
    return parts


def _primitive(primitive: SharedPrimitive, seen: Seen) -> Mapping[str, Item | None]:
    base = seen.device_from_world @ primitive.world_from_primitive
    colour: Colour = (*primitive.colour, 1.0)
    if primitive.shape == "arrow":
        return arrow(base, primitive.size_m, colour=colour)
    shapes = {"box": Shape.CUBE, "sphere": Shape.SPHERE, "cylinder": Shape.CYLINDER}
    shape = shapes.get(primitive.shape or "")
    if shape is None:
        return {}
    middle = base @ Pose(np.eye(3), np.array([0.0, 0.0, 0.5 * primitive.size_m[2]]))
    return {"body": Solid(shape, middle, primitive.size_m, colour)}


def whose(primitive: SharedPrimitive, names: Mapping[str, str], *, seen: Seen) -> Label | None:
    """Return words over a shape that is the wearer's, or has just become somebody else's."""
    is_own = primitive.user_id == seen.wearer
    if primitive.shape is None or not (is_own or primitive.primitive_id in seen.passed):
        return None
    owner = names.get(primitive.user_id) or "somebody else"
    # The highest corner: a shape in a hand may lie on its side.
    corners = (CORNERS + np.array([0.0, 0.0, 0.5])) * np.array(primitive.size_m)
    base = seen.device_from_world @ primitive.world_from_primitive
    place = base @ np.array([0.0, 0.0, 0.5 * primitive.size_m[2]])
    place[2] = float((base @ corners)[:, 2].max()) + OWNER_ABOVE_M
    return _label("yours" if is_own else f"{owner} has it", place, colour=OWNER, seen=seen)


def _line(line: Annotation, seen: Seen) -> Mapping[str, Item | None]:
    points = seen.device_from_world @ line.points_in_world
    colour: Colour = (*line.colour, 1.0)
    return polyline(points, width_m=LINE_M, colour=colour, tolerance_m=LINE_TOLERANCE_M)


def _is_same(old: Item, new: Item) -> bool:
    if isinstance(old, Solid) and isinstance(new, Solid):
        is_like = old.shape == new.shape and old.colour == new.colour
        is_like = is_like and max(map(_apart, old.size_m, new.size_m)) <= STILL_M
    elif isinstance(old, Label) and isinstance(new, Label):
        is_like = (old.text, old.height_m, old.colour) == (new.text, new.height_m, new.colour)
    else:
        return False
    before, after = old.world_from_item, new.world_from_item
    if not is_like or float(np.abs(before.translation - after.translation).max()) > STILL_M:
        return False
    # Frobenius norm of a difference of rotations: √2 times the angle where it is small.
    away = float(np.linalg.norm(before.rotation - after.rotation))
    return away <= math.sqrt(2.0) * STILL_RAD


def _apart(a: float, b: float) -> float:
    return abs(a - b)
