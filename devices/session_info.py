"""How a recorded session was made: what it says of itself, as one JSON text."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from devices.camera.lenses.layout import Arrangement, LensLayout
from scenes.cameras import Fisheye, Rig, camera_from_json, camera_to_json
from scenes.pose import Pose

FORMAT_VERSION = 1
"""Of the JSON text, a plain number. Fields that older programs don't know leave it as it is."""


@dataclass(frozen=True, slots=True)
class ScenarioChange:
    """From `t_ns` on, the session followed another scenario.

    Attributes:
        t_ns: the first frame at or after it is the first that could differ.
        scenario: text of that scenario's file.
        scenario_name: its name.
    """

    t_ns: int
    scenario: str
    scenario_name: str


@dataclass(frozen=True, slots=True)
class ForkOrigin:
    """Recording that a session goes on from.

    Attributes:
        recording: file name of the recording, without its folder.
        sha256: of the file's content, hexadecimal.
        t_ns: from there on the session is its own.
    """

    recording: str
    sha256: str
    t_ns: int


@dataclass(frozen=True, slots=True)
class LiveStream:
    """How a live camera's packets become the pictures that were tracked.

    Attributes:
        layout: how the stream's picture holds the lenses.
        lens_size_px: side of the lens pictures that are made of it.
        tracks: picture tracks; track k > 0 is recorded as stream `ID/k`.
    """

    layout: LensLayout
    lens_size_px: int
    tracks: int = 1


@dataclass(frozen=True, slots=True)
class SessionInfo:
    """How the session was made: enough to play it again.

    Attributes:
        scene: name or path of the scene package.
        scene_hash: digest of the package, to notice another one of the same name.
        seed: of everything random, or None for real devices.
        scenario: text of the scenario file it began with, or empty.
        scenario_name: its name, or empty.
        mode: "exact", "paced" or "live".
        methods: trackers that ran, the first is the one shown.
        versions: program and library versions by name.
        rig: the camera's lenses.
        fps: nominal frames per second.
        changes: scenarios that were followed later, in order of time.
        fork: the recording that it goes on from, or None.
        reality: in words, what stood for the real room where only a scan of it exists, and what
            that leaves out; empty where the room is known or real.
        stream: of a live camera; None where the simulator's own pictures are recorded.
    """

    scene: str
    scene_hash: str
    seed: int | None
    scenario: str
    scenario_name: str
    mode: str
    methods: tuple[str, ...]
    versions: Mapping[str, str]
    rig: Rig
    fps: float
    changes: tuple[ScenarioChange, ...] = ()
    fork: ForkOrigin | None = None
    reality: str = ""
    stream: LiveStream | None = None


def session_to_json(session: SessionInfo) -> str:
    """The session's description as one JSON text."""
    rig = session.rig
    return json.dumps(
        {
            "format_version": FORMAT_VERSION,
            "scene": session.scene,
            "scene_hash": session.scene_hash,
            "seed": session.seed,
            "scenario": session.scenario,
            "scenario_name": session.scenario_name,
            "mode": session.mode,
            "methods": list(session.methods),
            "versions": dict(session.versions),
            "fps": session.fps,
            "lenses": [camera_to_json(lens) for lens in rig.lenses],
            "rig_from_lens": [pose.matrix().tolist() for pose in rig.rig_from_lens],
            "changes": [asdict(change) for change in session.changes],
            "fork": None if session.fork is None else asdict(session.fork),
            "reality": session.reality,
            "stream": None if session.stream is None else _stream_to_json(session.stream),
        }
    )


def session_from_json(text: str) -> SessionInfo:
    """Inverse of `session_to_json`.

    Raises:
        ValueError, KeyError, TypeError: a field is missing or wrong, or the version is newer.
    """
    fields = json.loads(text)
    version = fields["format_version"]
    if version != FORMAT_VERSION:
        raise ValueError(f"recording format version {version}, this program reads {FORMAT_VERSION}")
    lenses = tuple(camera_from_json(lens) for lens in fields["lenses"])
    fisheyes = tuple(lens for lens in lenses if isinstance(lens, Fisheye))
    if len(fisheyes) != len(lenses):
        raise ValueError("rig: every lens must be a fisheye")
    return SessionInfo(
        scene=fields["scene"],
        scene_hash=fields["scene_hash"],
        seed=fields["seed"],
        scenario=fields["scenario"],
        scenario_name=fields["scenario_name"],
        mode=fields["mode"],
        methods=tuple(fields["methods"]),
        versions=dict(fields["versions"]),
        rig=Rig(fisheyes, tuple(Pose.from_matrix(m) for m in fields["rig_from_lens"])),
        fps=float(fields["fps"]),
        changes=tuple(_change(change) for change in fields.get("changes", ())),
        fork=_fork(fields.get("fork")),
        reality=str(fields.get("reality", "")),
        stream=_stream(fields.get("stream")),
    )


def _stream_to_json(stream: LiveStream) -> dict[str, Any]:
    return {
        "arrangement": str(stream.layout.arrangement),
        "turns": list(stream.layout.turns),
        "lens_size_px": stream.lens_size_px,
        "tracks": stream.tracks,
    }


def _stream(fields: Mapping[str, Any] | None) -> LiveStream | None:
    if fields is None:
        return None
    turns = tuple(int(turn) for turn in fields["turns"])
    layout = LensLayout(Arrangement(fields["arrangement"]), turns)
    return LiveStream(layout, int(fields["lens_size_px"]), int(fields["tracks"]))


def _change(fields: Mapping[str, Any]) -> ScenarioChange:
    return ScenarioChange(int(fields["t_ns"]), fields["scenario"], fields["scenario_name"])


def _fork(fields: Mapping[str, Any] | None) -> ForkOrigin | None:
    if fields is None:
        return None
    return ForkOrigin(fields["recording"], fields["sha256"], int(fields["t_ns"]))
