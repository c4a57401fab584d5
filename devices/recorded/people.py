"""Values of a recording that people show and make, and how each is written as JSON."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from scenes.pose import Pose
from scenes.state import (
    PRIMITIVE_SHAPES,
    Annotation,
    Avatar,
    AvatarGone,
    LiveSurface,
    Proposal,
    Shared,
    SharedPrimitive,
)


@dataclass(frozen=True, slots=True)
class RecordedAvatar:
    """A person at `t_ns`."""

    t_ns: int
    avatar: Avatar


@dataclass(frozen=True, slots=True)
class RecordedAvatarGone:
    """An avatar that ended by `t_ns`."""

    t_ns: int
    gone: AvatarGone


@dataclass(frozen=True, slots=True)
class RecordedSurface:
    """A surface that became live, changed, or was removed (no corners), at `t_ns`."""

    t_ns: int
    surface: LiveSurface


@dataclass(frozen=True, slots=True)
class RecordedAnnotation:
    """A line as it was drawn by `t_ns`; a newer one replaces it, one without points ends it."""

    t_ns: int
    annotation: Annotation


@dataclass(frozen=True, slots=True)
class RecordedPrimitive:
    """A shared primitive as it was by `t_ns`; a newer one replaces it, no shape ends it."""

    t_ns: int
    primitive: SharedPrimitive


@dataclass(frozen=True, slots=True)
class RecordedProposal:
    """A proposal as it was by `t_ns`; a newer one replaces it, no object ends it."""

    t_ns: int
    proposal: Proposal


RecordedThing = RecordedAnnotation | RecordedPrimitive | RecordedProposal
"""Things that people put into the room, but for live surfaces."""

RecordedOfPeople = RecordedAvatar | RecordedAvatarGone | RecordedSurface | RecordedThing
"""Values of a recording that people show and make."""


def recorded_thing(t_ns: int, thing: Shared) -> RecordedThing:
    """Return a thing that people put into the room as it is recorded."""
    match thing:
        case Annotation():
            return RecordedAnnotation(t_ns, thing)
        case SharedPrimitive():
            return RecordedPrimitive(t_ns, thing)
        case Proposal():
            return RecordedProposal(t_ns, thing)


def people_fields(value: RecordedOfPeople) -> tuple[str, str, dict[str, Any]]:
    """Return topic, schema name and fields of a value."""
    match value:
        case RecordedAvatar(_, avatar):
            return "/avatars", "gaussiannexus.Avatar", _avatar_fields(avatar)
        case RecordedAvatarGone(_, gone):
            return "/avatars/gone", "gaussiannexus.AvatarGone", {"user_id": gone.user_id}
        case RecordedSurface(_, surface):
            return "/surfaces", "gaussiannexus.LiveSurface", _surface_fields(surface)
        case RecordedAnnotation(_, line):
            return "/annotations", "gaussiannexus.Annotation", _annotation_fields(line)
        case RecordedPrimitive(_, primitive):
            return "/primitives", "gaussiannexus.Primitive", _primitive_fields(primitive)
        case RecordedProposal(_, proposal):
            return "/proposals", "gaussiannexus.Proposal", _proposal_fields(proposal)


def _avatar_fields(avatar: Avatar) -> dict[str, Any]:
    fields = {
        "user_id": avatar.user_id,
        "role": avatar.role,
        "world_from_head": _matrix(avatar.world_from_head),
        "hands": [hand.tolist() for hand in avatar.hands],
        "ray": None if avatar.ray is None else avatar.ray.tolist(),
    }
    if avatar.name:
        fields["name"] = avatar.name
    if avatar.gaze is not None:
        fields["gaze"] = avatar.gaze.tolist()
    return fields


def _surface_fields(surface: LiveSurface) -> dict[str, Any]:
    fields: dict[str, Any] = {
        "surface_id": surface.surface_id,
        "corners_in_world": np.asarray(surface.corners_in_world, dtype=np.float64).tolist(),
        "size_px": list(surface.size_px),
        "stream_id": surface.stream_id,
    }
    if surface.carried_to is not None:
        fields["carried_to"] = np.asarray(surface.carried_to, dtype=np.float64).tolist()
    return fields


def _annotation_fields(line: Annotation) -> dict[str, Any]:
    fields: dict[str, Any] = {
        "annotation_id": line.annotation_id,
        "user_id": line.user_id,
        "points_in_world": np.asarray(line.points_in_world, dtype=np.float64).tolist(),
        "colour": list(line.colour),
    }
    if line.world_from_object is not None:
        fields |= {
            "object_id": line.object_id,
            "world_from_object": _matrix(line.world_from_object),
        }
    return fields


def _primitive_fields(primitive: SharedPrimitive) -> dict[str, Any]:
    return {
        "primitive_id": primitive.primitive_id,
        "user_id": primitive.user_id,
        "shape": primitive.shape or "",
        "size_m": list(primitive.size_m),
        "colour": list(primitive.colour),
        "world_from_primitive": _matrix(primitive.world_from_primitive),
    }


def _proposal_fields(proposal: Proposal) -> dict[str, Any]:
    return {
        "proposal_id": proposal.proposal_id,
        "user_id": proposal.user_id,
        "user_name": proposal.user_name,
        "object_id": proposal.object_id,
        "world_from_object": _matrix(proposal.world_from_object),
    }


def _matrix(pose: Pose) -> list[list[float]]:
    return pose.matrix().tolist()


def _avatar(t_ns: int, fields: dict[str, Any]) -> RecordedAvatar:
    ray, gaze = fields["ray"], fields.get("gaze")
    avatar = Avatar(
        fields["user_id"],
        fields["role"],
        Pose.from_matrix(fields["world_from_head"]),
        # A hand without joints keeps the place of the other one.
        tuple(np.array(hand, dtype=np.float64).reshape(-1, 3) for hand in fields["hands"]),
        None if ray is None else np.array(ray, dtype=np.float64),
        str(fields.get("name", "")),
        None if gaze is None else np.array(gaze, dtype=np.float64).reshape(2, 3),
    )
    return RecordedAvatar(t_ns, avatar)


def _avatar_gone(t_ns: int, fields: dict[str, Any]) -> RecordedAvatarGone:
    return RecordedAvatarGone(t_ns, AvatarGone(str(fields["user_id"])))


def _surface(t_ns: int, fields: dict[str, Any]) -> RecordedSurface:
    width, height = (int(side) for side in fields["size_px"])
    corners = np.array(fields["corners_in_world"], dtype=np.float64).reshape(-1, 3)
    carried = fields.get("carried_to")
    surface = LiveSurface(
        fields["surface_id"],
        corners,
        (width, height),
        fields["stream_id"],
        None if carried is None else np.array(carried, dtype=np.float64).reshape(4, 3),
    )
    return RecordedSurface(t_ns, surface)


def _annotation(t_ns: int, fields: dict[str, Any]) -> RecordedAnnotation:
    red, green, blue = (float(value) for value in fields["colour"])
    points = np.array(fields["points_in_world"], dtype=np.float64).reshape(-1, 3)
    on = fields.get("world_from_object")
    line = Annotation(
        fields["annotation_id"],
        fields["user_id"],
        points,
        (red, green, blue),
        "" if on is None else str(fields["object_id"]),
        None if on is None else Pose.from_matrix(on),
    )
    return RecordedAnnotation(t_ns, line)


def _primitive(t_ns: int, fields: dict[str, Any]) -> RecordedPrimitive:
    shape = fields["shape"] or None
    if shape is not None and shape not in PRIMITIVE_SHAPES:
        raise ValueError(f"primitive: unknown shape {shape!r}")
    x, y, z = (float(side) for side in fields["size_m"])
    red, green, blue = (float(value) for value in fields["colour"])
    primitive = SharedPrimitive(
        fields["primitive_id"],
        fields["user_id"],
        shape,
        (x, y, z),
        (red, green, blue),
        Pose.from_matrix(fields["world_from_primitive"]),
    )
    return RecordedPrimitive(t_ns, primitive)


def _proposal(t_ns: int, fields: dict[str, Any]) -> RecordedProposal:
    proposal = Proposal(
        fields["proposal_id"],
        fields["user_id"],
        fields["user_name"],
        fields["object_id"],
        Pose.from_matrix(fields["world_from_object"]),
    )
    return RecordedProposal(t_ns, proposal)


PEOPLE_DECODERS: Mapping[str, Callable[[int, dict[str, Any]], RecordedOfPeople]] = MappingProxyType(
    {
        "gaussiannexus.Avatar": _avatar,
        "gaussiannexus.AvatarGone": _avatar_gone,
        "gaussiannexus.LiveSurface": _surface,
        "gaussiannexus.Annotation": _annotation,
        "gaussiannexus.Primitive": _primitive,
        "gaussiannexus.Proposal": _proposal,
    }
)
"""Functions by schema name: session time and fields to a value. They raise ValueError, KeyError or
TypeError where the fields are not what the schema says."""
