"""Values of a recording, and how each message is written: one JSON value a message, UTF-8.

Poses are 4×4 row-major matrices `a_from_b` so that a replay gets the very same numbers back.
Video is `foxglove.CompressedVideo`, which common viewers of MCAP files play; the other schemas are
our own. What people show and make is in `devices/recorded/people.py`.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np

from devices.messages import EncodedFrame, Event, VoicePacket
from devices.recorded.people import PEOPLE_DECODERS, RecordedOfPeople, people_fields
from scenes.pose import Pose
from scenes.state import TrackedObject, TrackState


@dataclass(frozen=True, slots=True)
class FrameStamp:
    """All of a `Frame` except its pictures, which are in the video packet of the same seq.

    Attributes:
        stream_id: which camera.
        seq: frame counter.
        t_ns: capture time.
        received_ns: when it reached the session.
        world_from_rig: the camera's pose as the session knew it, or None.
        steps_ms: of a live session, durations of the steps of the tracker's searches in this frame,
            in order, milliseconds: how many steps were done followed from them.
        search_ended: of a live session, whether a search for a lost object ended by this frame that
            was computed beside the frames; None where such searches took a share of each.
        look_ended: the same of a look around where an object was known; None where such looks were
            computed in the frames.
    """

    stream_id: str
    seq: int
    t_ns: int
    received_ns: int
    world_from_rig: Pose | None
    steps_ms: tuple[float, ...] = ()
    search_ended: bool | None = None
    look_ended: bool | None = None


@dataclass(frozen=True, slots=True)
class RecordedTrack:
    """One tracker's answer for one object at one frame; `method` names the tracker."""

    method: str
    track: TrackedObject


@dataclass(frozen=True, slots=True)
class RecordedTruth:
    """Truth of one frame, as the simulator knows it.

    Attributes:
        seq: frame counter.
        t_ns: capture time, as the camera reported it.
        world_from_object: true pose by object id.
        visible_fraction: 0..1 by object id.
        moved: ids of objects that are not where the scan saw them.
        world_from_rig: true pose of the camera.
        faults: how large every fault of this frame is, by its name in the scenario; only those that
            are there.
        captured_ns: true capture time on the session's clock; None where `t_ns` is it.
    """

    seq: int
    t_ns: int
    world_from_object: Mapping[str, Pose]
    visible_fraction: Mapping[str, float]
    moved: frozenset[str]
    world_from_rig: Pose
    faults: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    captured_ns: int | None = None


RecordedValue = (
    EncodedFrame
    | FrameStamp
    | RecordedTrack
    | RecordedTruth
    | RecordedOfPeople
    | VoicePacket
    | Event
)
"""Values that a recording holds."""


@dataclass(frozen=True, slots=True)
class Encoded:
    """A message as the file holds it: topic, schema name, time, counter, bytes."""

    topic: str
    schema: str
    t_ns: int
    seq: int
    data: bytes


VIEWERS_CODECS: Mapping[str, str] = MappingProxyType({"hevc": "h265"})
"""Codec names of `foxglove.CompressedVideo` that differ from FFmpeg's."""


def encode_message(value: RecordedValue) -> Encoded:
    """The file's form of a message.

    Raises:
        ValueError: a number is not finite.
    """
    match value:
        case EncodedFrame():
            head = (f"/{value.stream_id}/video", "foxglove.CompressedVideo", value.t_ns, value.seq)
            fields = _video_fields(value)
        case FrameStamp():
            head = (f"/{value.stream_id}/frame", "gaussiannexus.FrameStamp", value.t_ns, value.seq)
            fields = _stamp_fields(value)
        case RecordedTrack(method, track):
            topic = f"/tracks/{method}"
            head = (topic, "gaussiannexus.TrackedObject", track.t_ns, track.source_seq)
            fields = track_to_json(track)
        case RecordedTruth():
            head = ("/truth", "gaussiannexus.Truth", value.t_ns, value.seq)
            fields = _truth_fields(value)
        case VoicePacket():
            head = ("/voices", "gaussiannexus.Voice", value.t_ns, value.seq)
            fields = value.fields()
        case Event():
            head = ("/events", "gaussiannexus.Event", value.t_ns, 0)
            fields = {"source": value.source, "kind": value.kind, "text": value.text}
        case _:
            topic, schema, fields = people_fields(value)
            head = (topic, schema, value.t_ns, 0)
    try:
        data = json.dumps(fields, allow_nan=False).encode()
    except ValueError:
        raise ValueError(f"recording: {head[0]} at {head[2]} ns: a number is not finite") from None
    return Encoded(*head, data)


def decode_message(encoded: Encoded) -> RecordedValue:
    """Inverse of `encode_message`.

    Raises:
        ValueError, KeyError, TypeError: the bytes are not what the schema says.
    """
    decoders: Mapping[str, Callable[[Encoded, dict[str, Any]], RecordedValue]] = {
        "foxglove.CompressedVideo": _video,
        "gaussiannexus.FrameStamp": _stamp,
        "gaussiannexus.TrackedObject": _track,
        "gaussiannexus.Truth": _truth,
        "gaussiannexus.Voice": lambda e, f: VoicePacket.from_fields(f, t_ns=e.t_ns, seq=e.seq),
        "gaussiannexus.Event": _event,
    }
    if encoded.schema in PEOPLE_DECODERS:
        return PEOPLE_DECODERS[encoded.schema](encoded.t_ns, json.loads(encoded.data))
    decoder = decoders.get(encoded.schema)
    if decoder is None:
        raise ValueError(f"{encoded.topic}: unknown schema {encoded.schema!r}")
    return decoder(encoded, json.loads(encoded.data))


def _video_fields(frame: EncodedFrame) -> dict[str, Any]:
    fields: dict[str, Any] = {
        "timestamp": {"sec": frame.t_ns // 10**9, "nsec": frame.t_ns % 10**9},
        "frame_id": frame.stream_id,
        "data": base64.b64encode(frame.data).decode("ascii"),
        "format": VIEWERS_CODECS.get(frame.codec, frame.codec),
        "keyframe": frame.keyframe,
    }
    if frame.begins:
        fields["begins"] = True
    return fields


def _stamp_fields(stamp: FrameStamp) -> dict[str, Any]:
    fields: dict[str, Any] = {
        "received_ns": stamp.received_ns,
        "world_from_rig": _optional_pose_to_json(stamp.world_from_rig),
    }
    if stamp.steps_ms:
        fields["steps_ms"] = list(stamp.steps_ms)
    if stamp.search_ended is not None:
        fields["search_ended"] = stamp.search_ended
    if stamp.look_ended is not None:
        fields["look_ended"] = stamp.look_ended
    return fields


def _truth_fields(truth: RecordedTruth) -> dict[str, Any]:
    fields: dict[str, Any] = {
        "objects": {k: _pose_to_json(p) for k, p in truth.world_from_object.items()},
        "visible_fraction": dict(truth.visible_fraction),
        "moved": sorted(truth.moved),
        "world_from_rig": _pose_to_json(truth.world_from_rig),
    }
    # Left out where there is nothing to say: most frames of most recordings.
    if truth.faults:
        fields["faults"] = dict(truth.faults)
    if truth.captured_ns is not None:
        fields["captured_ns"] = truth.captured_ns
    return fields


def track_to_json(track: TrackedObject) -> dict[str, Any]:
    """Plain values of a tracked object, without its time."""
    return {
        "object_id": track.object_id,
        "world_from_object": _pose_to_json(track.world_from_object),
        "covariance": np.asarray(track.covariance, dtype=np.float64).tolist(),
        "visible_fraction": float(track.visible_fraction),
        "state": str(track.state),
        "confidence": float(track.confidence),
        "source_seq": int(track.source_seq),
    }


def _pose_to_json(pose: Pose) -> list[list[float]]:
    return pose.matrix().tolist()


def _optional_pose_to_json(pose: Pose | None) -> list[list[float]] | None:
    return None if pose is None else _pose_to_json(pose)


def stream_of(topic: str) -> str:
    """The stream of a topic: "camera-360" of "/camera-360/video"."""
    return topic.strip("/").rsplit("/", 1)[0]


def _video(encoded: Encoded, fields: dict[str, Any]) -> EncodedFrame:
    data = base64.b64decode(fields["data"], validate=True)
    form = str(fields["format"])
    return EncodedFrame(
        fields["frame_id"],
        encoded.seq,
        encoded.t_ns,
        data,
        bool(fields["keyframe"]),
        codec=next((ours for ours, theirs in VIEWERS_CODECS.items() if theirs == form), form),
        begins=bool(fields.get("begins", False)),
    )


def _stamp(encoded: Encoded, fields: dict[str, Any]) -> FrameStamp:
    pose = fields["world_from_rig"]
    return FrameStamp(
        stream_of(encoded.topic),
        encoded.seq,
        encoded.t_ns,
        int(fields["received_ns"]),
        None if pose is None else Pose.from_matrix(pose),
        tuple(float(value) for value in fields.get("steps_ms", ())),
        _optional_bool(fields, "search_ended"),
        _optional_bool(fields, "look_ended"),
    )


def _optional_bool(fields: dict[str, Any], name: str) -> bool | None:
    value = fields.get(name)
    return None if value is None else bool(value)


def _track(encoded: Encoded, fields: dict[str, Any]) -> RecordedTrack:
    track = TrackedObject(
        object_id=fields["object_id"],
        t_ns=encoded.t_ns,
        world_from_object=Pose.from_matrix(fields["world_from_object"]),
        covariance=np.array(fields["covariance"], dtype=np.float64),
        visible_fraction=fields["visible_fraction"],
        state=TrackState(fields["state"]),
        confidence=fields["confidence"],
        source_seq=fields["source_seq"],
    )
    return RecordedTrack(encoded.topic.rsplit("/", 1)[1], track)


def _truth(encoded: Encoded, fields: dict[str, Any]) -> RecordedTruth:
    return RecordedTruth(
        encoded.seq,
        encoded.t_ns,
        {k: Pose.from_matrix(m) for k, m in fields["objects"].items()},
        {k: float(v) for k, v in fields["visible_fraction"].items()},
        frozenset(fields["moved"]),
        Pose.from_matrix(fields["world_from_rig"]),
        {str(k): float(v) for k, v in fields.get("faults", {}).items()},
        None if fields.get("captured_ns") is None else int(fields["captured_ns"]),
    )


def _event(encoded: Encoded, fields: dict[str, Any]) -> Event:
    return Event(encoded.t_ns, fields["source"], fields["kind"], fields["text"])
