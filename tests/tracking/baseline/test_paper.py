"""The paper's chain step by step, with a detector that is told what to find."""

from types import SimpleNamespace

import numpy as np
import pytest

from scenes.pose import Pose
from scenes.state import TrackState
from tracking.baseline.detect import Detection
from tracking.baseline.estimate import UPDATE_NS
from tracking.baseline.identity import Visibility
from tracking.baseline.paper import PaperTracker, box_corners

FRAME_NS = 100_000_000


class Told:
    """Finds the boxes it is told to, whatever the picture shows."""

    def __init__(self):
        self.shift_px, self.hidden, self.asked = np.zeros(2), False, []

    def detect(self, view, expected):
        self.asked = list(expected)
        if self.hidden:
            return []
        return [self._detection(view, item) for item in expected if item.object_id == "mug-1"]

    def _detection(self, view, item):
        low, high = item.box_px[:2] + self.shift_px, item.box_px[2:] + self.shift_px
        rows, columns = np.mgrid[0 : view.camera.height_px, 0 : view.camera.width_px] + 0.5
        mask = (columns > low[0]) & (columns < high[0]) & (rows > low[1]) & (rows < high[1])
        return Detection(item.object_id, 1.0, np.concatenate([low, high]), mask)


@pytest.fixture
def told():
    return Told()


@pytest.fixture
def tracker(table, told):
    mug = table.models["mug-1"].source
    return PaperTracker(table.scan.room, (mug,), table.renderer, detector=told)


@pytest.fixture(scope="module")
def frames(table):
    """The same picture at any time."""
    frame = table.filmed({})

    def at(seq, *, t_ns=None):
        t_ns = seq * FRAME_NS if t_ns is None else t_ns
        return type(frame)(
            frame.stream_id, seq, t_ns, t_ns, frame.images, frame.rig, frame.world_from_rig
        )

    return at


def test_before_the_first_frame_everything_stands_where_it_was_scanned(tracker, table):
    state = tracker.start()
    scanned = table.poses["mug-1"]
    assert state.background is None
    assert not state.tracks_2d
    np.testing.assert_allclose(
        state.tracks["mug-1"].kalman.pose().matrix(), scanned.matrix(), atol=1e-9
    )
    assert state.tracks["mug-1"].updated_ns is None


def test_what_is_found_where_it_was_scanned_rests_there_and_is_not_estimated(
    tracker, told, frames, table
):
    state, output = tracker.step(tracker.start(), frames(0), 0)
    (mug,) = output.objects
    assert mug.state is TrackState.STATIC
    assert state.tracks["mug-1"].updated_ns is None
    np.testing.assert_allclose(
        mug.world_from_object.matrix(), table.poses["mug-1"].matrix(), atol=1e-9
    )
    assert [item.object_id for item in told.asked] == ["mug-1"]


def test_a_box_that_moves_is_estimated_once_and_then_only_after_a_second(tracker, told, frames):
    state, _ = tracker.step(tracker.start(), frames(0), 0)
    told.shift_px = np.array([10.0, 0.0])
    state, _ = tracker.step(state, frames(1), 0)
    assert state.tracks["mug-1"].updated_ns == FRAME_NS
    estimated = state.tracks["mug-1"].kalman
    # The box takes the size of the pose found; only then does it move on.
    for seq, shift_px in ((2, 0.0), (3, 10.0)):
        told.shift_px = np.array([shift_px, 0.0])
        state, _ = tracker.step(state, frames(seq), 0)
    assert state.tracks["mug-1"].kalman is estimated
    assert state.tracks["mug-1"].updated_ns == FRAME_NS
    state, _ = tracker.step(state, frames(12, t_ns=FRAME_NS + UPDATE_NS), 0)
    assert state.tracks["mug-1"].updated_ns == FRAME_NS + UPDATE_NS


def test_what_is_not_found_is_hidden_and_keeps_its_pose(tracker, told, frames):
    state, before = tracker.step(tracker.start(), frames(0), 0)
    told.hidden = True
    state, output = tracker.step(state, frames(1), 0)
    assert state.tracks_2d["mug-1"].visibility is Visibility.HIDDEN
    assert output.objects[0].state is TrackState.OCCLUDED
    assert output.objects[0].visible_fraction == 0.0
    np.testing.assert_array_equal(
        output.objects[0].world_from_object.matrix(), before.objects[0].world_from_object.matrix()
    )


def test_what_was_never_found_is_lost(tracker, told, frames):
    told.hidden = True
    _, output = tracker.step(tracker.start(), frames(0), 0)
    assert output.objects[0].state is TrackState.LOST


def test_the_background_is_kept_while_the_camera_stands(tracker, frames):
    state, _ = tracker.step(tracker.start(), frames(0), 0)
    again, _ = tracker.step(state, frames(1), 0)
    assert again.background is state.background
    moved = frames(2)
    step = Pose(np.eye(3), np.array([0.01, 0.0, 0.0]))
    elsewhere = type(moved)(
        moved.stream_id, 2, moved.t_ns, moved.t_ns, moved.images, moved.rig,
        moved.world_from_rig @ step,
    )  # fmt: skip
    assert tracker.step(again, elsewhere, 0)[0].background is not state.background


def test_a_frame_without_a_camera_pose_is_refused(tracker, frames):
    frame = frames(7)
    blind = type(frame)(frame.stream_id, 7, 0, 0, frame.images, frame.rig, None)
    with pytest.raises(ValueError, match="frame 7 of 'camera' has no camera pose"):
        tracker.step(tracker.start(), blind, 0)


def test_a_box_s_corners_stand_on_its_support():
    corners = box_corners(SimpleNamespace(box_m=(0.2, 0.4, 0.6)))
    np.testing.assert_allclose(corners.min(axis=0), (-0.1, -0.2, 0.0))
    np.testing.assert_allclose(corners.max(axis=0), (0.1, 0.2, 0.6))
    assert len({tuple(corner) for corner in corners}) == 8
