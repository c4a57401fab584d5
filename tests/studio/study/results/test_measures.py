"""Measures from what a recording holds, on values that are known."""

import numpy as np
import pytest

from devices.recorded.people import RecordedAnnotation, RecordedAvatar
from devices.recording_codec import FrameStamp, RecordedTrack
from scenes.frames import look_at
from scenes.pose import Pose
from scenes.state import Annotation, Avatar, TrackedObject, TrackState
from studio.study.folder import Ended
from studio.study.plan import Goal, GoalKind, Target
from studio.study.results.measures import (
    attending_measures,
    end_measures,
    gathered,
    latency_measures,
    moves,
    moving_measures,
    putting_measures,
)

SECOND = 10**9
ENDED = Ended("ABC1-1", "ABC1", 1, "live", "layout", "p1", 10 * SECOND, 20 * SECOND, "reached",
              {"whole": (40.0, 60.0)}, 5.0)  # fmt: skip


def rows(*stops, hz=10):
    """Poses of an object that rests a while at each x, and jumps on."""
    found = []
    for x, seconds in stops:
        for _ in range(round(seconds * hz)):
            t_ns = 10 * SECOND + len(found) * SECOND // hz
            found.append((t_ns, Pose.from_yaw(0.0, (x, 0.0, 0.0)), False))
    return found


def test_moves_are_rests_elsewhere():
    assert moves(rows((0.0, 3))) == 0
    assert moves(rows((0.0, 2), (0.5, 2))) == 1
    assert moves(rows((0.0, 2), (0.5, 0.5), (1.0, 2))) == 1  # passing is no rest
    assert moves(rows((0.0, 2), (0.5, 2), (0.56, 2))) == 2
    assert moves(rows((0.0, 2), (0.04, 2))) == 0  # less than a move
    assert moves(rows((0.0, 2), (0.5, 0.5))) == 0
    assert moves(rows((0.0, 2), (0.5, 0.5)), ends_at_rest=True) == 1
    doubted = [(t, pose, True) for t, pose, _ in rows((0.5, 3))]
    assert moves([*rows((0.0, 2)), *doubted]) == 0


def recorded():
    """Ten seconds: a chair is moved twice, the participant looks at it and points half the time."""
    track = [(t, pose, flag) for t, pose, flag in rows((0.0, 3), (1.0, 3), (1.2, 4))]
    for t_ns, pose, _ in track:
        yield RecordedTrack(
            "own",
            TrackedObject("chair", t_ns, pose, np.eye(4), 1.0, TrackState.TRACKED, 1.0, 0),
        )
        eye, middle = np.array([0.5, -3.0, 1.6]), pose @ np.array([0.0, 0.0, 0.4])
        ray = np.stack([eye, middle]) if t_ns < 15 * SECOND else None
        yield RecordedAvatar(t_ns, Avatar("p1", "remote", look_at(eye, middle), ray=ray))
        yield RecordedAvatar(t_ns, Avatar("p2", "local", Pose.identity()))
        yield FrameStamp("camera", 0, t_ns, t_ns + 30_000_000, None)
    line = Annotation("p1/a", "p1", np.zeros((2, 3)), (1.0, 0.0, 0.0))
    yield RecordedAnnotation(12 * SECOND, line)
    yield RecordedAnnotation(13 * SECOND, Annotation("p1/a", "p1", np.zeros((0, 3)), (0, 0, 0)))
    yield RecordedAnnotation(12 * SECOND, Annotation("p2/a", "p2", np.zeros((2, 3)), (0, 0, 0)))
    yield RecordedAnnotation(5 * SECOND, Annotation("p1/b", "p1", np.zeros((2, 3)), (0, 0, 0)))


def test_a_recording_is_measured():
    seen = gathered(recorded(), ENDED)
    found = {m.name: m.value for m in moving_measures(seen, ends_at_rest=True) if not m.object_id}
    assert found == {"moves": 2.0, "corrections": 1.0}
    put = {m.name: m.value for m in putting_measures(seen)}
    assert put == {"lines": 1.0, "shapes": 0.0, "proposals": 0.0, "taken_back": 1.0}
    spheres = {"chair": (np.array([0.0, 0.0, 0.4]), 0.5), "far": (np.zeros(3), 0.1)}
    attended = {(m.name, m.object_id): m.value for m in attending_measures(seen, spheres)}
    assert attended["pointing_share", ""] == pytest.approx(0.5, abs=0.02)
    assert attended["pointings", ""] == 1.0
    assert attended["gaze_on_objects_share", ""] > 0.99
    assert attended["object_pointing_share", "chair"] == pytest.approx(0.5, abs=0.02)
    assert attended["object_gaze_share", "far"] == 0.0
    assert attended["head_path_m", ""] == 0.0
    late = {m.name: m.value for m in latency_measures(seen, ENDED)}
    assert late["camera_ms_p50"] == pytest.approx(30.0)
    assert (late["shown_ms_p95"], late["ping_ms"]) == (60.0, 5.0)


def test_the_end_is_held_against_the_goal():
    seen = gathered(recorded(), ENDED)
    goal = Goal(GoalKind.LAYOUT, (Target("chair", (1.23, 0.0), 0.1),))
    found = {m.name: m.value for m in end_measures(seen, goal)}
    assert found["off_cm"] == pytest.approx(3.0)
    assert found["off_deg"] == pytest.approx(np.degrees(0.1))
    assert found["there"] == 1.0
    assert end_measures(seen, Goal()) == []
