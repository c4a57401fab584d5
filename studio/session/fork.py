"""A recorded simulation that goes on from an instant, and the proof that it is the same until then.

The simulation runs again from its start with the recorded seed, scenario and scene. Every frame
and every track before the instant is held to the recorded one, to the bit: so the physics, the
people, the encoder and the trackers' memories are those of the original.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import TypeVar

from devices.messages import EncodedFrame, Event
from devices.recorded.people import (
    RecordedAnnotation,
    RecordedAvatar,
    RecordedAvatarGone,
    RecordedSurface,
)
from devices.recording import RecordingError, read_recording, read_session
from devices.recording_codec import FrameStamp, RecordedTrack, track_to_json
from devices.session_info import ForkOrigin, ScenarioChange, SessionInfo
from scenes.state import Annotation, Avatar, AvatarGone, LiveSurface, Placed, TrackedObject
from sim.faults.fault import Fault
from sim.scenarios.scenario import Scenario, load_scenario, parse_scenario
from sim.scenarios.switch import Switch
from sim.tables import ScenarioError
from studio.session.pipeline import (
    PEOPLE,
    SessionInput,
    SessionMessage,
    placed_in,
    time_ns_of,
)
from studio.session.records.provenance import library_versions
from studio.session.trackers.settings import is_settings
from tracking.output import TrackOutput

T = TypeVar("T")
NamedTrack = tuple[str, TrackedObject]
"""A track and the name of its method."""


@dataclass(frozen=True, slots=True)
class Fork:
    """A recording that goes on from an instant.

    Attributes:
        recording: the recording that it comes from.
        info: how that was made.
        origin: what the new recording says of it.
        scenario: the scenario that the session begins with.
        changes: those it follows later, in order of time, as they are recorded.
        then: the same as the simulator takes them.
        is_changed: whether another scenario is followed from the instant on; if not, all of the
            session must be as recorded.
    """

    recording: Path
    info: SessionInfo
    origin: ForkOrigin
    scenario: Scenario
    changes: tuple[ScenarioChange, ...]
    then: tuple[Switch, ...]
    is_changed: bool

    @property
    def t_ns(self) -> int:
        """The instant: the first frame at or after it is the first that can differ."""
        return self.origin.t_ns

    def check_scene(self, scene_hash: str) -> None:
        """Refuse another version of the scene.

        Raises:
            ValueError: it isn't the recorded one.
        """
        if scene_hash != self.info.scene_hash:
            raise ValueError(
                f"{self.recording}: recorded with another version of scene {self.info.scene!r} "
                f"({self.info.scene_hash[:12]}, here {scene_hash[:12]}); the fork cannot be exact: "
                "rehearse again and fork that recording"
            )

    def proven(self, messages: Iterator[SessionMessage]) -> Iterator[SessionMessage]:
        """The simulator's messages, each held to the recorded one until the session is its own.

        Until then they carry the recorded tracks, for `check_tracks`, and what users did: surfaces
        that they made live, and people who were connected, with their lines.

        Raises:
            ValueError: a frame is not as recorded.
            RecordingError: the recording is damaged.
        """
        recorded = _recorded_frames(self.recording)
        for message in messages:
            if not self.is_changed or message.frame.t_ns < self.t_ns:
                known = next(recorded, None)
                if known is None and message.frame.t_ns >= self.t_ns:
                    yield message  # the recording was cut short: from its end on all is new
                    break
                yield self._held(message, known)
            else:
                yield message
                break
        yield from messages

    def check_tracks(self, message: SessionMessage, outputs: Mapping[str, TrackOutput]) -> None:
        """Hold a frame's tracks to the recorded ones, if it carries any.

        Raises:
            ValueError: one of them is not the same to the bit.
        """
        if not message.recorded:
            return
        found = [(name, track) for name, answer in outputs.items() for track in answer.objects]
        for was, now in zip(_in_order(message.recorded), _in_order(found), strict=False):
            if _plain(was) != _plain(now):
                raise self._different(message, f"the track of {was[1].object_id} ({was[0]})")
        if len(found) != len(message.recorded):
            raise self._different(message, f"the number of tracks ({len(message.recorded)} then)")

    def _held(self, message: SessionMessage, recorded: _RecordedFrame | None) -> SessionMessage:
        """The message with what the recording adds to it."""
        frame, packet = message.frame, message.input.packet
        if recorded is not None and recorded.packet is None:
            raise ValueError(
                f"{self.recording}: frame {recorded.stamp.seq} has no picture in the recording, "
                "which ran out of room; the fork cannot be proven: rehearse a shorter scenario"
            )
        if (
            recorded is None
            or recorded.packet is None
            or packet is None
            or (recorded.packet.seq, recorded.packet.data) != (packet.seq, packet.data)
            or recorded.stamp.received_ns != frame.received_ns
        ):
            raise self._different(message, "its picture")
        live = _with_users(message.input, recorded)
        return replace(message, input=live, recorded=recorded.tracks)

    def _different(self, message: SessionMessage, what: str) -> ValueError:
        here, there = library_versions(), self.info.versions
        others = [
            f"{name} {there.get(name, 'missing')} then, {here.get(name, 'missing')} now"
            for name in sorted({*here, *there})
            if here.get(name) != there.get(name)
        ]
        why = f"versions differ ({', '.join(others)})" if others else "versions are the same"
        return ValueError(
            f"{self.recording}: frame {message.frame.seq} ({message.frame.t_ns / 1e9:g} s) differs "
            f"from the recorded one in {what}; {why}; the fork cannot be exact: rehearse again "
            "with this program on this machine and fork that recording"
        )


def open_fork(
    recording: Path,
    *,
    at_s: float,
    scenario: str | None = None,
    more_faults: Sequence[type[Fault]] = (),
) -> Fork:
    """Read what a fork needs of a recording.

    Args:
        recording: of an exact rehearsal, or of a fork of one.
        at_s: the instant, in seconds of the session.
        scenario: name or path of the scenario to go on with; None goes on unchanged.
        more_faults: kinds that scenarios may have beside the built-in ones.

    Raises:
        ValueError: the recording cannot be forked, or not there, or the scenario is bad.
        OSError: a file cannot be read.
    """
    info = _forkable(recording)
    read = partial(_recorded_scenario, recording, more_faults)
    first = read(info.scenario, info.scenario_name)
    t_ns = _instant(recording, info, at_s, read)
    # A scenario given here replaces what came later in the recording.
    changes = tuple(c for c in info.changes if scenario is None or c.t_ns < t_ns)
    then = [Switch(c.t_ns, read(c.scenario, c.scenario_name)) for c in changes]
    if scenario is not None:
        new = load_scenario(scenario, more_faults=more_faults)
        text = Path(new.source).read_text(encoding="utf-8-sig")
        changes = (*changes, ScenarioChange(t_ns, text, new.name))
        then.append(Switch(t_ns, new))
    with recording.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    origin = ForkOrigin(recording.name, digest, t_ns)
    return Fork(recording, info, origin, first, changes, tuple(then), scenario is not None)


def _forkable(recording: Path) -> SessionInfo:
    try:
        info = read_session(recording)
    except RecordingError as error:
        raise RecordingError(
            f"{error}; only a whole recording of a rehearsal can be forked"
        ) from None
    if info.seed is None or not info.scenario:
        raise ValueError(
            f"{recording}: has no seed or scenario: it is of a real camera, whose world cannot go "
            "on differently; fork the recording of a rehearsal"
        )
    if info.mode != "exact":
        raise ValueError(
            f"{recording}: recorded in real time ({info.mode}): which frames the tracker missed "
            "depended on the machine; rehearse with --exact and fork that recording"
        )
    return info


def _recorded_scenario(
    recording: Path, more_faults: Sequence[type[Fault]], text: str, name: str
) -> Scenario:
    try:
        return parse_scenario(text, source=f"{name}.toml", more_faults=more_faults)
    except ScenarioError as error:
        raise ScenarioError(
            f"{recording}: this version of the program cannot read its scenario: {error}; "
            "rehearse again with this program and fork that recording"
        ) from None


def _instant(
    recording: Path, info: SessionInfo, at_s: float, read: Callable[[str, str], Scenario]
) -> int:
    last_text, last_name = info.scenario, info.scenario_name
    if info.changes:
        last_text, last_name = info.changes[-1].scenario, info.changes[-1].scenario_name
    last = read(last_text, last_name)
    last_frame_s = (last.frame_count - 1) / last.camera.fps
    if not 0.0 <= at_s <= last_frame_s:
        raise ValueError(
            f"{recording}: --at {at_s:g}, wanted seconds from 0 to {last_frame_s:g}, its last frame"
        )
    return round(at_s * 1e9)


@dataclass(frozen=True, slots=True)
class _RecordedFrame:
    """A recording's messages of one frame; no packet where the recording ran out of room."""

    stamp: FrameStamp
    packet: EncodedFrame | None
    tracks: tuple[NamedTrack, ...]
    surfaces: tuple[LiveSurface, ...]
    events: tuple[Event, ...]
    avatars: tuple[Avatar, ...]
    lines: tuple[Annotation, ...]
    gone: tuple[AvatarGone, ...]
    placed: tuple[Placed, ...]


def _recorded_frames(recording: Path) -> Iterator[_RecordedFrame]:
    """Frame by frame, without decoding a picture."""
    for _t_ns, group in groupby(read_recording(recording), key=time_ns_of):
        values = list(group)
        stamp = _first(values, FrameStamp)
        if stamp is not None:
            yield _RecordedFrame(
                stamp,
                _first(values, EncodedFrame),
                tuple((v.method, v.track) for v in values if isinstance(v, RecordedTrack)),
                tuple(v.surface for v in values if isinstance(v, RecordedSurface)),
                tuple(v for v in values if isinstance(v, Event) and _is_by_users(v)),
                tuple(v.avatar for v in values if isinstance(v, RecordedAvatar)),
                tuple(v.annotation for v in values if isinstance(v, RecordedAnnotation)),
                tuple(v.gone for v in values if isinstance(v, RecordedAvatarGone)),
                placed_in(values),
            )


def _is_by_users(event: Event) -> bool:
    """Whether no simulator says an event again."""
    return is_settings(event) or event.source == PEOPLE


def _with_users(live: SessionInput, recorded: _RecordedFrame) -> SessionInput:
    """Return the simulator's input with what users added to it."""
    surfaces = {item.surface_id for item in live.surfaces}
    people = {item.user_id for item in live.avatars}
    lines = {item.annotation_id for item in live.annotations}
    return replace(
        live,
        surfaces=(
            *live.surfaces,
            *(item for item in recorded.surfaces if item.surface_id not in surfaces),
        ),
        events=live.events + recorded.events,
        avatars=(
            *live.avatars,
            *(item for item in recorded.avatars if item.user_id not in people),
        ),
        annotations=(
            *live.annotations,
            *(item for item in recorded.lines if item.annotation_id not in lines),
        ),
        gone=live.gone + recorded.gone,
        placed=live.placed + recorded.placed,
    )


def _first(values: Sequence[object], kind: type[T]) -> T | None:
    return next((value for value in values if isinstance(value, kind)), None)


def _in_order(tracks: Sequence[NamedTrack]) -> list[NamedTrack]:
    return sorted(tracks, key=lambda item: (item[0], item[1].object_id))


def _plain(item: NamedTrack) -> tuple[str, object]:
    return item[0], track_to_json(item[1])
