"""A recording as what a viewer shows of it: poses, states, people, lines and events over time."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from devices.messages import Event
from devices.recorded.people import (
    RecordedAnnotation,
    RecordedAvatar,
    RecordedAvatarGone,
    RecordedSurface,
)
from devices.recording import read_recording
from devices.recording_codec import RecordedTrack, RecordedTruth
from scenes.bodies.goals import Goals, goals_of
from scenes.pose import quaternion_from_rotation
from scenes.state import Annotation, Avatar, LiveSurface, TrackedObject
from studio.handover.keys import POSE_STEPS, Keys, pose_values
from studio.session.pipeline import CancelledError

LOST_FRAME = "dropped"
"""Kind of the events that say that a frame was lost: too many to show one by one."""

MAX_EVENTS = 500
"""Shown at most, chosen: a list that a person can still look through."""

RAY_STEPS = (0.005,) * 6
"""Metres by which a ray's ends must move to be another ray, chosen: half a centimetre."""

HAND_STEPS = (0.002,) * 3 + (0.001,)
"""Metres by which a hand must move, and change between wrist and palm: 2 mm, a hand tracker's
noise."""

PALM_STEPS = (0.01,) * 4
"""By which a palm's quaternion must differ, chosen: a turn by a degree."""

FINGER_STEPS = (0.04,) * 20
"""Radians by which a finger's joint must bend, chosen: two degrees, a millimetre of its tip."""

LINE_EVERY_MS = 200
"""A line that is being drawn is shown growing in steps of this, chosen."""

SURFACE_COLOUR = (0.94, 0.78, 0.2)
"""Of the outline of a surface that showed live video."""


@dataclass(slots=True)
class ObjectMoments:
    """One object: where it was, and from when on it was in which state."""

    poses: Keys = field(default_factory=lambda: Keys(POSE_STEPS))
    states: list[tuple[int, str]] = field(default_factory=list[tuple[int, str]])


@dataclass(slots=True)
class HandMoments:
    """One hand as bodies are solved for it (`scenes/bodies/goals.py`); None where nobody knows.

    Attributes:
        places: wrist or palm in world metres, and how far beyond the wrist that is.
        palms: quaternions w, x, y, z of palms' axes.
        fingers: angles of five fingers, four each, radians.
    """

    places: Keys = field(default_factory=lambda: Keys(HAND_STEPS))
    palms: Keys = field(default_factory=lambda: Keys(PALM_STEPS))
    fingers: Keys = field(default_factory=lambda: Keys(FINGER_STEPS))

    def add(self, t_ms: int, goals: Goals, *, side: int) -> None:
        """One person's hand at one time."""
        place = [*goals.wrists[0, side].tolist(), float(goals.grips_m[0, side])]
        self.places.add(t_ms, _known(place))
        palm = goals.palms[0, side]
        turn = None if np.isnan(palm).any() else quaternion_from_rotation(palm)
        kept = self.palms.values
        if turn is not None and kept and kept[-1] is not None and turn @ np.array(kept[-1]) < 0.0:
            turn = -turn
        self.palms.add(t_ms, None if turn is None else turn.tolist())
        self.fingers.add(t_ms, _known(goals.fingers[0, side].ravel().tolist()))

    def end(self, t_ms: int) -> None:
        """The person has left."""
        for keys in (self.places, self.palms, self.fingers):
            keys.add(t_ms, None)


def _known(values: list[float]) -> list[float] | None:
    return values if all(value == value for value in values) else None


@dataclass(slots=True)
class PersonMoments:
    """One person: "local" or "remote", where head and hands were, where they pointed."""

    role: str
    heads: Keys = field(default_factory=lambda: Keys(POSE_STEPS))
    rays: Keys = field(default_factory=lambda: Keys(RAY_STEPS))
    hands: tuple[HandMoments, HandMoments] = field(
        default_factory=lambda: (HandMoments(), HandMoments())
    )


@dataclass(slots=True)
class LineMoments:
    """One line: whose, its colour, and its points from when on; each (N, 3) metres in the world."""

    user_id: str
    colour: tuple[float, float, float]
    versions: list[tuple[int, np.ndarray]] = field(
        default_factory=list[tuple[int, np.ndarray]],
    )


@dataclass(slots=True)
class Moments:
    """Everything that changes in a recording. Times are milliseconds of the session.

    Attributes:
        objects: by object id.
        people: by user id.
        lines: by annotation id or surface id.
        events: what happened, in words.
        moved: ids of the objects that truly moved, where the truth was recorded.
        end_ms: time of the last message.
        frames: tracked frames.
    """

    objects: dict[str, ObjectMoments] = field(default_factory=dict[str, ObjectMoments])
    people: dict[str, PersonMoments] = field(default_factory=dict[str, PersonMoments])
    lines: dict[str, LineMoments] = field(default_factory=dict[str, LineMoments])
    events: list[tuple[int, str]] = field(default_factory=list[tuple[int, str]])
    moved: set[str] = field(default_factory=set[str])
    end_ms: int = 0
    frames: int = 0

    def add_track(self, track: TrackedObject) -> None:
        """One object at one frame."""
        t_ms = track.t_ns // 1_000_000
        moments = self.objects.setdefault(track.object_id, ObjectMoments())
        kept = moments.poses.values
        moments.poses.add(t_ms, pose_values(track.world_from_object, kept[-1] if kept else None))
        if not moments.states or moments.states[-1][1] != track.state:
            moments.states.append((t_ms, str(track.state)))

    def add_person(self, t_ns: int, avatar: Avatar) -> None:
        """One person at one time."""
        t_ms = t_ns // 1_000_000
        moments = self.people.setdefault(avatar.user_id, PersonMoments(avatar.role))
        kept = moments.heads.values
        moments.heads.add(t_ms, pose_values(avatar.world_from_head, kept[-1] if kept else None))
        moments.rays.add(t_ms, None if avatar.ray is None else avatar.ray.ravel().tolist())
        goals = goals_of([avatar])
        for side, hand in enumerate(moments.hands):
            hand.add(t_ms, goals, side=side)

    def end_person(self, t_ns: int, user_id: str) -> None:
        """Somebody has left, or shows no body any more."""
        moments = self.people.get(user_id)
        if moments is None:
            return
        t_ms = t_ns // 1_000_000
        for keys in (moments.heads, moments.rays):
            keys.add(t_ms, None)
        for hand in moments.hands:
            hand.end(t_ms)

    def add_event(self, event: Event) -> None:
        """Take an event, but no lost frame, and none beyond those that can be looked through."""
        if event.kind != LOST_FRAME and len(self.events) < MAX_EVENTS:
            self.events.append((event.t_ns // 1_000_000, event.text))

    def add_line(self, t_ns: int, line: Annotation) -> None:
        """A line as it was by then."""
        self._add_points(
            line.annotation_id, line.user_id, line.colour, t_ns, np.asarray(line.points_in_world)
        )

    def add_surface(self, t_ns: int, surface: LiveSurface) -> None:
        """The outline of a surface that showed live video."""
        corners = np.asarray(surface.seen_in_world)
        closed = np.concatenate([corners, corners[:1]])
        self._add_points(surface.surface_id, "", SURFACE_COLOUR, t_ns, closed)

    def _add_points(
        self,
        line_id: str,
        user_id: str,
        colour: tuple[float, float, float],
        t_ns: int,
        points: np.ndarray,
    ) -> None:
        t_ms = t_ns // 1_000_000
        versions = self.lines.setdefault(line_id, LineMoments(user_id, colour)).versions
        if versions and t_ms - versions[-1][0] < LINE_EVERY_MS:
            versions[-1] = (versions[-1][0], points)
        else:
            versions.append((t_ms, points))


def read_moments(
    recording: Path,
    method: str,
    *,
    cancelled: threading.Event,
    reached: Callable[[int], None] = lambda _t_ms: None,
) -> Moments:
    """Read a recording once, from its start to its end.

    Args:
        recording: an MCAP file.
        method: the tracker whose poses are shown.
        cancelled: set it from another thread to stop.
        reached: sees the time of every message.

    Raises:
        CancelledError: it was cancelled.
        RecordingError: the file is damaged.
        OSError: it cannot be read.
    """
    moments = Moments()
    last_seq = -1
    for value in read_recording(recording):
        if cancelled.is_set():
            raise CancelledError
        if isinstance(value, RecordedTrack):
            t_ns = value.track.t_ns
            if value.method == method:
                moments.add_track(value.track)
                moments.frames += value.track.source_seq != last_seq
                last_seq = value.track.source_seq
        elif isinstance(value, RecordedAvatar):
            t_ns = value.t_ns
            moments.add_person(t_ns, value.avatar)
        elif isinstance(value, RecordedAvatarGone):
            t_ns = value.t_ns
            moments.end_person(t_ns, value.gone.user_id)
        elif isinstance(value, RecordedAnnotation):
            t_ns = value.t_ns
            moments.add_line(t_ns, value.annotation)
        elif isinstance(value, RecordedSurface):
            t_ns = value.t_ns
            moments.add_surface(t_ns, value.surface)
        else:
            t_ns = value.t_ns
            if isinstance(value, RecordedTruth):
                moments.moved |= value.moved
            if isinstance(value, Event):
                moments.add_event(value)
        moments.end_ms = max(moments.end_ms, t_ns // 1_000_000)
        reached(moments.end_ms)
    return moments
