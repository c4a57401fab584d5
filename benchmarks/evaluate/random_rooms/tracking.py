"""A tracking method on the pictures of a random room: what it reported of every object."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from benchmarks.evaluate.answers import Answer
from benchmarks.evaluate.random_rooms.filming import Picture, RoomFilm
from benchmarks.evaluate.random_rooms.staging import COLD, SEQUENCE, Staged
from benchmarks.random_rooms.room import RandomRoom
from devices.messages import Frame
from scenes.package import ScenePackage
from scenes.pose import Pose
from scenes.state import TrackedObject
from sim.rehearsal import off_by
from studio.evaluate.metrics import pose_error
from tracking.output import TrackingMethod

Shown = Callable[[Frame, Mapping[str, tuple[NDArray[np.bool_], ...]]], None]
"""Hands a detector without errors the frame and each object's mask per lens before it is asked."""

FARTHEST_CM = 500.0
"""Errors beyond this count the same where twins are matched: a room's size."""


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """An answer with what is known of the object and the room.

    Attributes:
        seed: of the room.
        family: of the object.
        finish: of the object.
        answer: what was reported.
    """

    seed: int
    family: str
    finish: str
    answer: Answer


@dataclass(frozen=True, slots=True, eq=False)
class TrackedRoom:
    """Everything a method reported of a room.

    Attributes:
        judged: per session, picture and object.
        moving: objects that move in the sequence.
        step_ms: duration of each step after a session's first.
        first_ms: duration of each session's first step.
    """

    judged: tuple[Judged, ...]
    moving: tuple[str, ...]
    step_ms: tuple[float, ...]
    first_ms: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class CameraError:
    """How far the camera's known pose is off, about a random axis and in a random direction."""

    degrees: float = 0.5
    centimetres: float = 1.0


class RoomTrial:
    """One method in one room.

    Args:
        room: the room.
        scan: what the method knows of it.
        method: the tracker.
        camera_error: of the camera pose that it is given.
        stopwatch_ns: nanoseconds from any origin.
        shown: for methods with a perfect detector; None for all others.
    """

    def __init__(
        self,
        room: RandomRoom,
        scan: ScenePackage,
        method: TrackingMethod[Any],
        *,
        camera_error: CameraError,
        stopwatch_ns: Callable[[], int],
        shown: Shown | None = None,
    ) -> None:
        self._room = room
        self._method = method
        self._stopwatch_ns = stopwatch_ns
        self._shown = shown
        self._known = off_by(
            room.live.world_from_rig,
            np.random.default_rng([room.seed, 360]),
            camera_error.degrees,
            camera_error.centimetres,
        )
        self._start = {item.object_id: item.world_from_object for item in room.scanned.objects}
        # A scan is a little too large or small; where an object stood in it ties the two worlds.
        self._true_from_scan = {
            item.object_id: item.world_from_object.inverse() @ self._start[item.object_id]
            for item in scan.objects
        }
        self._step_ms: list[float] = []
        self._first_ms: list[float] = []

    def run(self, film: RoomFilm, staged: Staged) -> TrackedRoom:
        """All stills, each a session of its own, then the sequence."""
        judged: list[Judged] = []
        for number in range(len(staged.stills)):
            judged += self.still(film, number)
        for of_picture in self.session(SEQUENCE, film.sequence()):
            judged += of_picture
        return TrackedRoom(
            tuple(judged), staged.moving, tuple(self._step_ms), tuple(self._first_ms)
        )

    def still(self, film: RoomFilm, number: int) -> list[Judged]:
        """One still, as a session of its own."""
        picture = film.still(number)
        _, tracks = self._step(self._method.start(), picture, 0)
        return self._judged(COLD, picture, tracks)

    def session(self, name: str, pictures: Iterable[Picture]) -> Iterator[list[Judged]]:
        """Pictures of one session, each judged."""
        state = self._method.start()
        for seq, picture in enumerate(pictures):
            state, tracks = self._step(state, picture, seq)
            yield self._judged(name, picture, tracks)

    def _step(
        self, state: Any, picture: Picture, seq: int
    ) -> tuple[Any, Mapping[str, TrackedObject]]:
        t_ns = picture.moment.t_ns
        frame = replace(picture.frame, world_from_rig=self._known)
        if self._shown is not None:
            self._shown(frame, picture.masks)
        began = self._stopwatch_ns()
        state, output = self._method.step(state, frame, t_ns)
        durations = self._first_ms if seq == 0 else self._step_ms
        durations.append((self._stopwatch_ns() - began) / 1e6)
        return state, {track.object_id: track for track in output.objects}

    def _judged(
        self, session: str, picture: Picture, tracks: Mapping[str, TrackedObject]
    ) -> list[Judged]:
        reported = {
            name: track.world_from_object @ self._true_from_scan[name]
            for name, track in tracks.items()
        }
        judged: list[Judged] = []
        for twins in self._kinds():
            track_of = who_is_who(twins, reported, picture.moment.objects)
            for name in twins:
                item = self._room.movables[name]
                answer = self._answer(session, picture, name, track_of.get(name), tracks, reported)
                judged.append(Judged(self._room.seed, item.family, item.finish, answer))
        return judged

    def _answer(
        self,
        session: str,
        picture: Picture,
        name: str,
        track_name: str | None,
        tracks: Mapping[str, TrackedObject],
        reported: Mapping[str, Pose],
    ) -> Answer:
        truth, start = picture.moment.objects[name], self._start[name]
        is_moved = not np.allclose(truth.matrix(), start.matrix(), atol=1e-4)
        seen, still = picture.visible[name], picture.moment.name
        if track_name is None:
            return Answer(session, still, name, None, 0.0, 0.0, None, is_moved, seen)
        track, pose = tracks[track_name], reported[track_name]
        error = pose_error(pose, truth, symmetry=self._room.movables[name].symmetry)
        moved_cm = 100.0 * float(np.linalg.norm(pose.translation - start.translation))
        return Answer(
            session, still, name, error, moved_cm, track.confidence, track.state, is_moved, seen
        )

    def _kinds(self) -> list[tuple[str, ...]]:
        """Objects that nobody can tell apart, together."""
        groups: dict[str, list[str]] = {}
        for name in self._room.movables:
            groups.setdefault(self._room.kind(name), []).append(name)
        return [tuple(names) for names in groups.values()]


def who_is_who(
    twins: Sequence[str], reported: Mapping[str, Pose], true: Mapping[str, Pose]
) -> dict[str, str]:
    """Return the true object of each track: twins may have changed their names.

    Args:
        twins: ids of one kind.
        reported: `world_from_object` by track.
        true: `world_from_object` by object.

    Returns:
        Track by object; without those that were not reported.
    """
    tracks = [name for name in twins if name in reported]
    if not tracks:
        return {}
    apart = np.array(
        [
            [
                min(
                    100.0 * np.linalg.norm(reported[t].translation - true[o].translation),
                    FARTHEST_CM,
                )
                for t in tracks
            ]
            for o in twins
        ]
    )
    # Where it makes no difference, each track keeps its name.
    apart -= np.array([[1e-6 * (t == o) for t in tracks] for o in twins])
    rows, columns = linear_sum_assignment(apart)
    return {twins[int(i)]: tracks[int(j)] for i, j in zip(rows, columns, strict=True)}
