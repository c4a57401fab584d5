"""Index of a recording after one pass: the room at any instant without reading it again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from devices.messages import Event
from devices.session_info import SessionInfo
from scenes.pose import Pose
from scenes.state import (
    Annotation,
    Avatar,
    LiveSurface,
    Proposal,
    SceneState,
    Shared,
    SharedPrimitive,
    TrackedObject,
    is_there,
)
from studio.app.timeline.recorded.columns import (
    GONE,
    Rows,
    avatar_of_row,
    last_at,
    pose_of_row,
    track_of_row,
)

T = TypeVar("T")
Thing = TypeVar("Thing", bound=LiveSurface | Shared)


@dataclass(frozen=True, slots=True, eq=False)
class Changes(Generic[T]):
    """Values of one id in order of time.

    Attributes:
        t_ns: when each became true.
        values: what each is.
    """

    t_ns: Sequence[int]
    values: Sequence[T]

    def newest(self, t_ns: int) -> T | None:
        """The value at a time; None before the first."""
        number = last_at(self.t_ns, t_ns)
        return None if number < 0 else self.values[number]


@dataclass(frozen=True, slots=True, eq=False)
class Packets:
    """Places of one camera's pictures; the packets themselves stay in the file.

    Attributes:
        topics: that they have in the recording, one a track.
        t_ns: (N,) capture times.
        keyframe: (N,) whether decoding may start there.
        track: (N,) which track they are of.
        whole: (N,) whether every track has a packet of the picture by then.
    """

    topics: tuple[str, ...]
    t_ns: NDArray[np.int64]
    keyframe: NDArray[np.bool_]
    track: NDArray[np.uint8]
    whole: NDArray[np.bool_]

    def shown_at(self, t_ns: int) -> int | None:
        """Number of the packet that completes the picture at a time; None if there is none."""
        last = last_at(self.t_ns, t_ns)
        while last >= 0 and not self.whole[last]:
            last -= 1
        return None if last < 0 else last

    def needed(self, t_ns: int) -> tuple[int, int] | None:
        """Numbers of the packets that the picture at a time takes: first and last, or None.

        The first begins a picture, and every track can start at or after it.
        """
        last = self.shown_at(t_ns)
        if last is None:
            return None
        starts: list[int] = []
        for track in range(len(self.topics)):
            keys = np.flatnonzero(self.keyframe[: last + 1] & (self.track[: last + 1] == track))
            if not len(keys):
                return None
            starts.append(int(keys[-1]))
        first = min(starts)
        while first and not self.whole[first - 1]:
            first -= 1
        return first, last


@dataclass(frozen=True, slots=True, eq=False)
class RecordingIndex:
    """A recording, all but its pictures.

    Attributes:
        path: of the file.
        session: how it was made.
        start_ns: of its first message.
        end_ns: of its last.
        frames_ns: (N,) times of the camera's frames.
        changes_ns: (N,) times of all that changed the room, for the state's version.
        tracks: the shown method's answers by object id, see `columns.track_row`.
        truth: true pose, visible share and whether it had moved (0, 1) by object id.
        faults_ns: times at which the truth names faults, and their names.
        avatars: people by user id, see `columns.avatar_row`.
        roles: of people, by number.
        rig: the camera's pose.
        surfaces: by id.
        annotations: by id.
        primitives: by id.
        proposals: by id.
        names: of people, as they called themselves last, by user id.
        events: in order of time.
        packets: of the camera whose pictures are shown; None without video.
        shortened: why the rest is not shown, in words; empty if all is.
    """

    path: Path
    session: SessionInfo
    start_ns: int
    end_ns: int
    frames_ns: NDArray[np.int64]
    changes_ns: NDArray[np.int64]
    tracks: Mapping[str, Rows]
    truth: Mapping[str, Rows]
    faults_ns: Sequence[tuple[int, tuple[str, ...]]]
    avatars: Mapping[str, Rows]
    roles: Sequence[str]
    rig: Rows
    surfaces: Mapping[str, Changes[LiveSurface]]
    annotations: Mapping[str, Changes[Annotation]]
    primitives: Mapping[str, Changes[SharedPrimitive]]
    proposals: Mapping[str, Changes[Proposal]]
    names: Mapping[str, str]
    events: Sequence[Event]
    packets: Packets | None
    shortened: str = ""

    @property
    def origin_ns(self) -> int:
        """The instant that is called 0 s: a script's own, and of a live session its first one."""
        return self.start_ns if self.session.seed is None else 0

    @property
    def duration_s(self) -> float:
        """From the first message to the last, seconds."""
        return (self.end_ns - self.start_ns) / 1e9

    @property
    def is_empty(self) -> bool:
        """Whether there is nothing to show."""
        return not len(self.frames_ns) and not len(self.changes_ns)

    def state_at(self, t_ns: int) -> SceneState:
        """The room at an instant: as if every message until then had been reduced."""
        count = last_at(self.changes_ns, t_ns) + 1
        return SceneState(
            version=count,
            t_ns=int(self.changes_ns[count - 1]) if count else 0,
            objects=MappingProxyType(self._objects(t_ns)),
            surfaces=_newest(self.surfaces, t_ns),
            avatars=MappingProxyType(self._people(t_ns)),
            annotations=_newest(self.annotations, t_ns),
            primitives=_newest(self.primitives, t_ns),
            proposals=_newest(self.proposals, t_ns),
            world_from_rig=self._rig(t_ns),
        )

    def _objects(self, t_ns: int) -> dict[str, TrackedObject]:
        found: dict[str, TrackedObject] = {}
        for object_id, rows in self.tracks.items():
            number = rows.newest(t_ns)
            if number >= 0:
                found[object_id] = track_of_row(object_id, int(rows.t_ns[number]), rows.row(number))
        return found

    def _people(self, t_ns: int) -> dict[str, Avatar]:
        found: dict[str, Avatar] = {}
        for user_id, rows in self.avatars.items():
            number = rows.newest(t_ns)
            row = rows.row(number) if number >= 0 else ()
            if len(row) > len(GONE):
                avatar = avatar_of_row(user_id, self.roles, rows.row(number))
                found[user_id] = replace(avatar, name=self.names.get(user_id, ""))
        return found

    def _rig(self, t_ns: int) -> Pose | None:
        number = self.rig.newest(t_ns)
        return None if number < 0 else pose_of_row(self.rig.row(number))


def _newest(changes: Mapping[str, Changes[Thing]], t_ns: int) -> Mapping[str, Thing]:
    """Return the newest of each, without those that have been removed."""
    found = {key: series.newest(t_ns) for key, series in changes.items()}
    return MappingProxyType(
        {key: value for key, value in found.items() if value is not None and is_there(value)}
    )
