"""One pass over a recording into its index, with bounded memory."""

from __future__ import annotations

import json
import threading
from array import array
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from devices.camera.unit_sets import Place, UnitSets
from devices.messages import Event
from devices.recorded.people import (
    RecordedAnnotation,
    RecordedAvatar,
    RecordedAvatarGone,
    RecordedPrimitive,
    RecordedProposal,
    RecordedSurface,
)
from devices.recording import RecordingError, RecordingReader
from devices.recording_codec import (
    Encoded,
    FrameStamp,
    RecordedTrack,
    RecordedTruth,
    RecordedValue,
    stream_of,
)
from scenes.state import Annotation, LiveSurface, Proposal, SharedPrimitive, is_there
from studio.app.timeline.recorded.columns import (
    GONE,
    Rows,
    RowsBuilder,
    avatar_row,
    pose_row,
    track_row,
)
from studio.app.timeline.recorded.index import Changes, Packets, RecordingIndex

T = TypeVar("T")

MAX_NUMBERS = 64 * 1024**2
"""Numbers that are kept of a recording, chosen: 512 MB, an hour of five objects and two people with
hands at 30 frames a second. What comes later is not shown."""

MAX_EVENTS = 100_000
"""Events that are kept: a lost frame is one."""

NUMBERS_OF_A_THING = 100
"""Numbers that take as much memory as a primitive or a proposal: rotation, place, size, texts."""

VIDEO = "foxglove.CompressedVideo"

REPORT_EVERY = 500
"""Messages between two reports of progress: about a hundredth of a second."""


def read_index(
    path: Path,
    *,
    progress: Callable[[float], None] = lambda _share: None,
    cancelled: threading.Event | None = None,
    most_numbers: int = MAX_NUMBERS,
) -> RecordingIndex | None:
    """Read a recording once.

    Args:
        path: an MCAP recording.
        progress: is given the share that is done, 0..1.
        cancelled: set it from another thread to stop.
        most_numbers: limit of what is kept, see `MAX_NUMBERS`.

    Returns:
        The index, or None if it was cancelled.

    Raises:
        RecordingError: the file is damaged, cut off, or no recording of ours.
        OSError: it cannot be opened.
    """
    with RecordingReader(path) as reader:
        span = reader.span_ns or (0, 0)
        building = _Building(reader.session.methods[:1])
        for number, encoded in enumerate(reader.messages()):
            if number % REPORT_EVERY == 0:
                if cancelled is not None and cancelled.is_set():
                    return None
                progress((encoded.t_ns - span[0]) / max(span[1] - span[0], 1))
            if building.numbers > most_numbers:
                building.shortened = (
                    f"{path}: too long to be shown whole: what comes after "
                    f"{encoded.t_ns / 1e9:.0f} s is left out (limit "
                    f"{most_numbers * 8 / 1e6:.0f} MB)"
                )
                span = span[0], encoded.t_ns
                break
            try:
                building.take(encoded, reader.decoded)
            except (KeyError, TypeError, ValueError) as error:
                if isinstance(error, RecordingError):
                    raise
                raise RecordingError(f"{path}: damaged recording: {error}") from None
        progress(1.0)
        return building.built(reader, span)


class _Building:
    """The part of an index that has been read so far.

    Args:
        shown: name of the method whose tracks are the room's; empty takes the first that comes.
    """

    def __init__(self, shown: tuple[str, ...]) -> None:
        self.numbers = 0
        self.shortened = ""
        self._shown = shown
        self._frames_ns, self._changes_ns = array("q"), array("q")
        self._tracks: defaultdict[str, RowsBuilder] = defaultdict(RowsBuilder)
        self._truth: defaultdict[str, RowsBuilder] = defaultdict(RowsBuilder)
        self._avatars: defaultdict[str, RowsBuilder] = defaultdict(RowsBuilder)
        self._rig = RowsBuilder()
        self._roles: list[str] = []
        self._faults: list[tuple[int, tuple[str, ...]]] = []
        self._surfaces: defaultdict[str, list[tuple[int, LiveSurface]]] = defaultdict(list)
        self._annotations: defaultdict[str, list[tuple[int, Annotation]]] = defaultdict(list)
        self._primitives: defaultdict[str, list[tuple[int, SharedPrimitive]]] = defaultdict(list)
        self._proposals: defaultdict[str, list[tuple[int, Proposal]]] = defaultdict(list)
        self._names: dict[str, str] = {}
        self._there: set[str] = set()
        """People, surfaces, lines and bodies that have not been removed."""
        self._events: list[Event] = []
        self._video_topics: list[str] = []
        self._packets_ns, self._keyframes, self._packet_tracks = array("q"), array("b"), array("B")

    def take(self, encoded: Encoded, decoded: Callable[[Encoded], RecordedValue]) -> None:
        """Take the next message."""
        if encoded.schema == VIDEO:
            self._take_packet(encoded)
            return
        value = decoded(encoded)
        if isinstance(value, RecordedTrack):
            self._take_track(value)
        elif isinstance(value, RecordedTruth):
            self._take_truth(value)
        elif isinstance(value, RecordedAvatar):
            if value.avatar.role not in self._roles:
                self._roles.append(value.avatar.role)
            row = avatar_row(value.avatar, self._roles.index(value.avatar.role))
            self.numbers += self._avatars[value.avatar.user_id].add(value.t_ns, row)
            if value.avatar.name:
                self._names[value.avatar.user_id] = value.avatar.name
            self._note_change(value.t_ns, f"avatar {value.avatar.user_id}")
        elif isinstance(value, RecordedAvatarGone):
            self._avatars[value.gone.user_id].add(value.t_ns, GONE)
            self._note_change(value.t_ns, f"avatar {value.gone.user_id}", stays=False)
        elif isinstance(value, FrameStamp):
            self._frames_ns.append(value.t_ns)
            if value.world_from_rig is not None:
                self.numbers += self._rig.add(value.t_ns, pose_row(value.world_from_rig))
        elif isinstance(value, Event):
            if len(self._events) < MAX_EVENTS:
                self._events.append(value)
        else:
            self._take_thing(value)

    def _take_thing(self, value: RecordedValue) -> None:
        """Take what people put into the room."""
        if isinstance(value, RecordedSurface):
            surface = value.surface
            self._surfaces[surface.surface_id].append((value.t_ns, surface))
            self._note_change(value.t_ns, f"surface {surface.surface_id}", stays=is_there(surface))
            self.numbers += surface.corners_in_world.size + surface.seen_in_world.size
        elif isinstance(value, RecordedAnnotation):
            line = value.annotation
            self._annotations[line.annotation_id].append((value.t_ns, line))
            self._note_change(value.t_ns, f"line {line.annotation_id}", stays=is_there(line))
            self.numbers += line.points_in_world.size
        elif isinstance(value, RecordedPrimitive):
            body = value.primitive
            self._primitives[body.primitive_id].append((value.t_ns, body))
            self._note_change(value.t_ns, f"primitive {body.primitive_id}", stays=is_there(body))
            self.numbers += NUMBERS_OF_A_THING
        elif isinstance(value, RecordedProposal):
            proposal = value.proposal
            self._proposals[proposal.proposal_id].append((value.t_ns, proposal))
            self._note_change(
                value.t_ns, f"proposal {proposal.proposal_id}", stays=is_there(proposal)
            )
            self.numbers += NUMBERS_OF_A_THING

    def _note_change(self, t_ns: int, name: str, *, stays: bool = True) -> None:
        """Count a change of the room; the end of what is not there is none."""
        if stays:
            self._there.add(name)
        elif name not in self._there:
            return
        else:
            self._there.remove(name)
        self._changes_ns.append(t_ns)

    def _take_packet(self, encoded: Encoded) -> None:
        """Only where it is: base64 of pictures that nobody asked for is not decoded."""
        topics = self._video_topics
        if encoded.topic not in topics:
            if topics and not stream_of(encoded.topic).startswith(f"{stream_of(topics[0])}/"):
                return
            topics.append(encoded.topic)
        self._packets_ns.append(encoded.t_ns)
        self._keyframes.append(bool(json.loads(encoded.data)["keyframe"]))
        self._packet_tracks.append(topics.index(encoded.topic))

    def _take_track(self, value: RecordedTrack) -> None:
        if not self._shown:
            self._shown = (value.method,)
        if value.method == self._shown[0]:
            track = value.track
            self.numbers += self._tracks[track.object_id].add(track.t_ns, track_row(track))
            self._changes_ns.append(track.t_ns)

    def _take_truth(self, value: RecordedTruth) -> None:
        for object_id, pose in value.world_from_object.items():
            visible = value.visible_fraction.get(object_id, 1.0)
            row = [*pose_row(pose), visible, float(object_id in value.moved)]
            self.numbers += self._truth[object_id].add(value.t_ns, row)
        names = tuple(value.faults)
        if names or self._faults:
            self._faults.append((value.t_ns, names))

    def built(self, reader: RecordingReader, span_ns: tuple[int, int]) -> RecordingIndex:
        """The index of what was taken."""
        packets = Packets(
            tuple(self._video_topics),
            np.frombuffer(self._packets_ns, dtype=np.int64),
            np.frombuffer(self._keyframes, dtype=np.int8).astype(bool),
            np.frombuffer(self._packet_tracks, dtype=np.uint8),
            _wholes(self._packet_tracks, len(self._video_topics)),
        )
        return RecordingIndex(
            path=reader.path,
            session=reader.session,
            start_ns=span_ns[0],
            end_ns=span_ns[1],
            frames_ns=_times(self._frames_ns),
            changes_ns=_times(self._changes_ns),
            tracks=_all_built(self._tracks),
            truth=_all_built(self._truth),
            faults_ns=self._faults,
            avatars=_all_built(self._avatars),
            roles=self._roles,
            rig=self._rig.built(),
            surfaces=_as_changes(self._surfaces),
            annotations=_as_changes(self._annotations),
            primitives=_as_changes(self._primitives),
            proposals=_as_changes(self._proposals),
            names=self._names,
            events=self._events,
            packets=packets if self._video_topics else None,
            shortened=self.shortened,
        )


def _wholes(tracks: Iterable[int], count: int) -> NDArray[np.bool_]:
    sets = UnitSets(count)
    return np.array([sets.place(track) is Place.LAST for track in tracks], dtype=bool)


def _times(values: array[int]) -> NDArray[np.int64]:
    """In order: what is recorded of one frame has one time, whatever comes between."""
    return np.frombuffer(values, dtype=np.int64)


def _all_built(builders: Mapping[str, RowsBuilder]) -> Mapping[str, Rows]:
    return {key: builder.built() for key, builder in builders.items()}


def _as_changes(found: Mapping[str, list[tuple[int, T]]]) -> Mapping[str, Changes[T]]:
    return {
        key: Changes([t for t, _ in pairs], [value for _, value in pairs])
        for key, pairs in found.items()
    }
