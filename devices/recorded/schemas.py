"""JSON Schemas of a recording's messages, by which viewers of MCAP files read them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

SCHEMAS: Mapping[str, Mapping[str, str]] = {
    "foxglove.CompressedVideo": {
        "timestamp": "object",
        "frame_id": "string",
        "data": "string",
        "format": "string",
        "keyframe": "boolean",
        "begins": "boolean",
    },
    "gaussiannexus.FrameStamp": {
        "received_ns": "integer",
        "world_from_rig": "array",
        "steps_ms": "array",
        "search_ended": "boolean",
        "look_ended": "boolean",
    },
    "gaussiannexus.TrackedObject": {
        "object_id": "string",
        "world_from_object": "array",
        "covariance": "array",
        "visible_fraction": "number",
        "state": "string",
        "confidence": "number",
        "source_seq": "integer",
    },
    "gaussiannexus.Truth": {
        "objects": "object",
        "visible_fraction": "object",
        "moved": "array",
        "world_from_rig": "array",
        "faults": "object",
        "captured_ns": "integer",
    },
    "gaussiannexus.Avatar": {
        "user_id": "string",
        "role": "string",
        "world_from_head": "array",
        "hands": "array",
        "ray": "array",
        "name": "string",
    },
    "gaussiannexus.AvatarGone": {"user_id": "string"},
    "gaussiannexus.LiveSurface": {
        "surface_id": "string",
        "corners_in_world": "array",
        "size_px": "array",
        "stream_id": "string",
        "carried_to": "array",
    },
    "gaussiannexus.Primitive": {
        "primitive_id": "string",
        "user_id": "string",
        "shape": "string",
        "size_m": "array",
        "colour": "array",
        "world_from_primitive": "array",
    },
    "gaussiannexus.Proposal": {
        "proposal_id": "string",
        "user_id": "string",
        "user_name": "string",
        "object_id": "string",
        "world_from_object": "array",
    },
    "gaussiannexus.Annotation": {
        "annotation_id": "string",
        "user_id": "string",
        "points_in_world": "array",
        "colour": "array",
        "object_id": "string",
        "world_from_object": "array",
    },
    "gaussiannexus.Voice": {
        "user_id": "string",
        "heard_ns": "integer",
        "time": "integer",
        "opus": "string",
    },
    "gaussiannexus.Event": {"source": "string", "kind": "string", "text": "string"},
}
"""Fields of every schema and their JSON types."""


def json_schema(name: str) -> bytes:
    """The JSON Schema document of one of `SCHEMAS`; arrays and objects may be null."""
    properties: dict[str, Any] = {
        field: {"type": kind} if kind not in ("array", "object") else {"type": [kind, "null"]}
        for field, kind in SCHEMAS[name].items()
    }
    if name == "foxglove.CompressedVideo":
        properties["data"]["contentEncoding"] = "base64"
        properties["timestamp"] = {
            "type": "object",
            "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}},
        }
    return json.dumps({"title": name, "type": "object", "properties": properties}).encode()
