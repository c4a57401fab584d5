"""Measures of a trial, from its recording: time, corrections, gaze, pointing, latency as it was."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices.recorded.people import (
    RecordedAnnotation,
    RecordedAvatar,
    RecordedPrimitive,
    RecordedProposal,
)
from devices.recording import read_recording
from devices.recording_codec import FrameStamp, RecordedTrack, RecordedValue
from scenes.pose import Pose
from scenes.state import Avatar, ObjectModel, is_there
from studio.study.folder import Ended
from studio.study.goals import judged
from studio.study.plan import Goal
from studio.view.attention import Sphere, attention_of

MOVED_M, MOVED_RAD = 0.05, float(np.radians(10.0))
"""How far an object must have gone, or turned, between two rests to have been moved: what somebody
does by eye, and ten times what the tracker is off at rest."""

RESTS_M, RESTS_RAD, RESTS_S = 0.02, float(np.radians(3.0)), 1.0
"""How little and for how long it moves where it rests; chosen: above the tracker's noise at rest
(0.4 cm, 0.3°), below a slow push (0.1 m/s)."""

MAX_STEP_S = 0.5
"""Longest time that one avatar stands for: of a network that was away nobody knows where one
looked."""

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Measure:
    """A figure of a trial.

    Attributes:
        name: as in the codebook.
        value: of it.
        object_id: of what it is; empty of the whole trial.
    """

    name: str
    value: float
    object_id: str = ""


@dataclass(slots=True)
class Seen:
    """Content of a recording between the begin and the end of a trial.

    Attributes:
        tracks: time in ns, pose and whether it is doubted, by object.
        avatars: the participant's, with their times in ns.
        before: newest pose of each object before the task began.
        camera_ms: from a picture's capture to its arrival.
        items: ids of what the participant put, by kind.
        ended: ids of what they took away again, by kind.
    """

    tracks: dict[str, list[tuple[int, Pose, bool]]] = field(
        default_factory=dict[str, "list[tuple[int, Pose, bool]]"]
    )
    avatars: list[tuple[int, Avatar]] = field(default_factory=list["tuple[int, Avatar]"])
    before: dict[str, Pose] = field(default_factory=dict[str, Pose])
    camera_ms: list[float] = field(default_factory=list[float])
    items: dict[str, set[str]] = field(default_factory=dict[str, "set[str]"])
    ended: dict[str, set[str]] = field(default_factory=dict[str, "set[str]"])

    def take(self, kind: str, key: str, *, there: bool) -> None:
        """Take something that the participant has put, or taken away."""
        (self.items if there else self.ended).setdefault(kind, set()).add(key)


def measured(
    recording: Path, ended: Ended, *, goal: Goal, models: Iterable[ObjectModel]
) -> tuple[Measure, ...]:
    """Return the measures of a trial.

    Args:
        recording: of its session.
        ended: how it went.
        goal: of its task.
        models: of the scene's objects.

    Raises:
        RecordingError: the recording is damaged.
        OSError: it is not there.
    """
    seen = gathered(read_recording(recording), ended)
    radii = {model.object_id: model.sphere() for model in models}
    found = [
        Measure("duration_s", ended.duration_s),
        Measure("completed", float(ended.ended_by in ("reached", "said"))),
    ]
    found += moving_measures(seen, ends_at_rest=ended.ended_by in ("reached", "said"))
    found += putting_measures(seen)
    found += attending_measures(seen, radii)
    found += end_measures(seen, goal)
    found += latency_measures(seen, ended)
    return tuple(found)


def gathered(values: Iterable[RecordedValue], ended: Ended) -> Seen:
    """Return what the recording of a trial's session has of it."""
    seen, methods = Seen(), set[str]()
    for value in values:
        match value:
            case RecordedTrack(method, track):
                methods.add(method)
                if method != min(methods, key=lambda name: (name != "own", name)):
                    continue
                name, pose = track.object_id, track.world_from_object
                if track.t_ns < ended.begun_ns:
                    seen.before[name] = pose
                elif track.t_ns <= ended.ended_ns:
                    seen.tracks.setdefault(name, []).append((track.t_ns, pose, track.is_flagged))
            case RecordedAvatar(t_ns, avatar):
                if avatar.user_id == ended.person and ended.begun_ns <= t_ns <= ended.ended_ns:
                    seen.avatars.append((t_ns, avatar))
            case FrameStamp():
                if ended.begun_ns <= value.t_ns <= ended.ended_ns:
                    seen.camera_ms.append((value.received_ns - value.t_ns) / 1e6)
            case RecordedAnnotation(t_ns, item):
                if _is_within(t_ns, item.user_id, ended=ended):
                    seen.take("lines", item.annotation_id, there=is_there(item))
            case RecordedPrimitive(t_ns, item):
                if _is_within(t_ns, item.user_id, ended=ended):
                    seen.take("shapes", item.primitive_id, there=is_there(item))
            case RecordedProposal(t_ns, item):
                if _is_within(t_ns, item.user_id, ended=ended):
                    seen.take("proposals", item.proposal_id, there=is_there(item))
            case _:
                pass
    return seen


def moving_measures(seen: Seen, *, ends_at_rest: bool) -> list[Measure]:
    """Return how often objects were moved, and moved again.

    Args:
        seen: of the trial.
        ends_at_rest: whether everything rests where it is at the end: the task was done by then.
    """
    found: list[Measure] = []
    moves_of: dict[str, int] = {}
    for name, rows in seen.tracks.items():
        moves_of[name] = moves(
            rows, world_from_first=seen.before.get(name), ends_at_rest=ends_at_rest
        )
        found.append(Measure("object_moves", float(moves_of[name]), name))
        sure = np.mean([not is_flagged for _, _, is_flagged in rows])
        found.append(Measure("object_sure_share", float(sure), name))
    moved = [count for count in moves_of.values() if count]
    found.append(Measure("moves", float(sum(moved))))
    found.append(Measure("corrections", float(sum(moved) - len(moved))))
    return found


def moves(
    rows: Iterable[tuple[int, Pose, bool]],
    *,
    world_from_first: Pose | None = None,
    ends_at_rest: bool = False,
) -> int:
    """Return how often an object came to rest elsewhere than it had rested before.

    Args:
        rows: time in ns, pose, and whether it is doubted; doubted poses are no rest.
        world_from_first: where it rested before; None for where it is first.
        ends_at_rest: whether it rests where it is last.
    """
    rested, count = world_from_first, 0
    since_ns, at = 0, None
    for t_ns, pose, is_flagged in rows:
        if rested is None:
            rested = pose
        if is_flagged:
            at = None
            continue
        if at is None or _is_apart(at, pose, m=RESTS_M, rad=RESTS_RAD):
            at, since_ns = pose, t_ns
        is_at_rest = t_ns - since_ns >= RESTS_S * 1e9
        if is_at_rest and _is_apart(rested, at, m=MOVED_M, rad=MOVED_RAD):
            rested, count = at, count + 1
    if ends_at_rest and at is not None and rested is not None:
        count += _is_apart(rested, at, m=MOVED_M, rad=MOVED_RAD)
    return count


def putting_measures(seen: Seen) -> list[Measure]:
    """Return how much the participant drew, put and proposed, and took away again."""
    kinds = ("lines", "shapes", "proposals")
    found = [Measure(kind, float(len(seen.items.get(kind, ())))) for kind in kinds]
    found.append(Measure("taken_back", float(sum(len(ids) for ids in seen.ended.values()))))
    return found


def attending_measures(seen: Seen, spheres: Mapping[str, Sphere]) -> list[Measure]:
    """Return how the participant walked and turned, and what they looked and pointed at.

    Args:
        seen: of the trial.
        spheres: centre in the object's frame and radius of each object.
    """
    if len(seen.avatars) < 2:
        return []
    looked, pointed = dict.fromkeys(spheres, 0.0), dict.fromkeys(spheres, 0.0)
    path_m = turn_rad = ray_s = whole_s = 0.0
    begun, was_pointing = 0, False
    poses = _Following(seen)
    for (t_ns, avatar), (next_ns, after) in zip(seen.avatars, seen.avatars[1:], strict=False):
        dt_s = min((next_ns - t_ns) / 1e9, MAX_STEP_S)
        head, then = avatar.world_from_head, after.world_from_head
        path_m += float(np.linalg.norm(then.translation - head.translation))
        turn_rad += _angle(head.rotation[:, 2], then.rotation[:, 2])
        whole_s += dt_s
        there = {
            name: (pose @ spheres[name][0], spheres[name][1])
            for name, pose in poses.at(t_ns).items()
            if name in spheres
        }
        attention = attention_of(avatar, there)
        if attention.looks_at:
            looked[attention.looks_at] += dt_s
        if attention.points_at:
            pointed[attention.points_at] += dt_s
        is_pointing = avatar.ray is not None
        ray_s += dt_s * is_pointing
        begun += is_pointing and not was_pointing
        was_pointing = is_pointing
    whole_s = max(whole_s, 1e-9)
    found = [
        Measure("head_path_m", path_m),
        Measure("head_turn_deg", float(np.degrees(turn_rad))),
        Measure("pointings", float(begun)),
        Measure("pointing_share", ray_s / whole_s),
        Measure("gaze_on_objects_share", sum(looked.values()) / whole_s),
        Measure("pointing_at_objects_share", sum(pointed.values()) / whole_s),
    ]
    for name in spheres:
        found.append(Measure("object_gaze_share", looked[name] / whole_s, name))
        found.append(Measure("object_pointing_share", pointed[name] / whole_s, name))
    return found


def end_measures(seen: Seen, goal: Goal) -> list[Measure]:
    """Return how far objects were off their goal at the end; none where there is no such goal."""
    last = seen.before | {name: rows[-1][1] for name, rows in seen.tracks.items()}
    reached = judged(goal, last)
    if reached is None:
        return []
    found = [
        Measure("off_cm", 100.0 * float(np.mean(list(reached.off_m.values())))),
        Measure("off_deg", float(np.degrees(np.mean(list(reached.off_rad.values()))))),
        Measure("there", float(reached.there)),
    ]
    for name, off_m in reached.off_m.items():
        found.append(Measure("object_off_cm", 100.0 * off_m, name))
        found.append(Measure("object_off_deg", float(np.degrees(reached.off_rad[name])), name))
    return found


def latency_measures(seen: Seen, ended: Ended) -> list[Measure]:
    """Return how late everything was, as it was."""
    found: list[Measure] = []
    if seen.camera_ms:
        for share in (50, 95):
            found.append(
                Measure(f"camera_ms_p{share}", float(np.percentile(seen.camera_ms, share)))
            )
    if "whole" in ended.stages_ms:
        p50, p95 = ended.stages_ms["whole"]
        found += [Measure("shown_ms_p50", p50), Measure("shown_ms_p95", p95)]
    if ended.ping_ms is not None:
        found.append(Measure("ping_ms", ended.ping_ms))
    return found


class _Following:
    """Poses of objects at times that only grow."""

    def __init__(self, seen: Seen) -> None:
        self._rows = {name: iter(rows) for name, rows in seen.tracks.items()}
        self._next = {name: next(rows, None) for name, rows in self._rows.items()}
        self._poses = dict(seen.before)

    def at(self, t_ns: int) -> Mapping[str, Pose]:
        """Return the newest pose of each object by a time."""
        for name, rows in self._rows.items():
            while (row := self._next[name]) is not None and row[0] <= t_ns:
                self._poses[name], self._next[name] = row[1], next(rows, None)
        return self._poses


def _is_within(t_ns: int, user_id: str, *, ended: Ended) -> bool:
    return user_id == ended.person and ended.begun_ns <= t_ns <= ended.ended_ns


def _is_apart(one: Pose, other: Pose, *, m: float, rad: float) -> bool:
    if float(np.linalg.norm(one.translation - other.translation)) > m:
        return True
    cosine = 0.5 * (float(np.trace(one.rotation.T @ other.rotation)) - 1.0)
    return float(np.arccos(np.clip(cosine, -1.0, 1.0))) > rad


def _angle(one: Array, other: Array) -> float:
    return float(np.arccos(np.clip(one @ other, -1.0, 1.0)))
