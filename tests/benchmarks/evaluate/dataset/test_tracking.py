"""`benchmarks.evaluate.dataset.tracking`: frames and truths meet, however the package is turned."""

from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.evaluate.dataset.layout import read_dataset
from benchmarks.evaluate.dataset.tracking import CHAINED_FRAMES, CameraError, track_dataset
from scenes.pose import Pose
from scenes.state import TrackState
from tracking.output import TrackOutput

TRUE_FROM_PACKAGE = Pose.from_yaw(0.7, np.array([3.0, -2.0, 0.0]))
CUT_OFFSET = Pose.from_yaw(1.1, np.array([0.1, 0.1, 0.0]))
"""A cut-out's frame in the true object's frame: arbitrary."""


class AlwaysThere:
    """A method that reports one place in the true world, and remembers what it was shown."""

    def __init__(self, world_from_object):
        self.pose = TRUE_FROM_PACKAGE.inverse() @ world_from_object @ CUT_OFFSET
        self.frames = []

    def start(self):
        return 0

    def step(self, state, frame, now_ns):
        self.frames.append((state, frame))
        track = SimpleNamespace(
            object_id="box",
            world_from_object=self.pose,
            confidence=0.9,
            state=TrackState.STATIC,
        )
        return state + 1, TrackOutput((track,), {}, frame.world_from_rig)


def run(folder, method, error=None):
    dataset = read_dataset(folder)
    start = dataset.objects["box"].world_from_object
    cut = SimpleNamespace(
        object_id="box", world_from_object=TRUE_FROM_PACKAGE.inverse() @ start @ CUT_OFFSET
    )
    prepared = SimpleNamespace(
        package=SimpleNamespace(objects=(cut,)), true_from_package=TRUE_FROM_PACKAGE
    )
    return track_dataset(
        dataset,
        prepared,
        method,
        camera_error=error or CameraError(0.0, 0.0),
        seed=0,
        stopwatch_ns=lambda: 0,
        begin=lambda _: None,
    )


def test_errors_are_those_of_the_true_frame(folder):
    start = read_dataset(folder).objects["box"].world_from_object
    tracked = run(folder, AlwaysThere(start))
    at_start, moved = (a for a in tracked.answers if a.session == "room")
    assert at_start.error.world_cm == pytest.approx(0.0, abs=1e-9)
    assert not at_start.is_moved
    assert moved.is_moved
    assert moved.error.world_cm == pytest.approx(100.0)
    assert moved.moved_cm == pytest.approx(0.0, abs=1e-9)


def test_yaw_errors_respect_the_symmetry(folder):
    start = read_dataset(folder).objects["box"].world_from_object
    quarter = start @ Pose.from_yaw(np.pi / 2 + 0.01, np.zeros(3))
    answer = run(folder, AlwaysThere(quarter)).answers[0]
    assert answer.error.yaw_deg == pytest.approx(np.degrees(0.01))


def test_every_still_is_a_session_of_its_own_and_then_part_of_one(folder):
    method = AlwaysThere(Pose.identity())
    run(folder, method)
    assert [state for state, _ in method.frames] == [0, 0, *range(2 * CHAINED_FRAMES)]


def test_the_camera_pose_is_off_by_what_was_asked(folder):
    left = run(folder, AlwaysThere(Pose.identity()), CameraError(0.5, 1.0)).cameras[0]
    assert left.degrees == pytest.approx(0.5)
    assert left.millimetres == pytest.approx(10.0)


def test_every_session_begins_with_an_error_in_a_direction_of_its_own_and_keeps_it(folder):
    method = AlwaysThere(Pose.identity())
    tracked = run(folder, method, CameraError(0.5, 1.0))
    known = [frame.world_from_rig.translation for _, frame in method.frames]
    first, second, *chained = known
    assert np.linalg.norm(first - second) > 1e-3
    assert min(np.linalg.norm(chained[0] - still) for still in (first, second)) > 1e-3
    np.testing.assert_array_equal(chained, [chained[0]] * len(chained))
    assert len(tracked.cameras) == 3


def test_a_picture_of_another_size_is_named(folder):
    path = folder / "fisheye/room/truth.json"
    path.write_text(path.read_text().replace('"width": 64', '"width": 60'))
    with pytest.raises(ValueError, match=r"start_0\.png.*64 × 64.*60 × 64"):
        run(folder, AlwaysThere(Pose.identity()))
