"""Whether the camera still stands where it was calibrated, by its marker and by its pictures."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from scenes.pose import Pose, rotation_from_vector
from tests.tracking.camera.test_common_motion import RIG, through_both
from tests.tracking.camera.test_watch import FAR
from tracking.camera.calibration import Calibration
from tracking.camera.rig_state import (
    BLIND_LOOKS,
    RETRY_NS,
    RIG_MOVED_M,
    Blind,
    camera_notices,
    look_through,
    rig_state,
)
from tracking.output import CameraMoment

TURN = np.radians((0.25, 0.3, -0.2))
FRAME_NS = 100_000_000


def frame_of(images, seq=0):
    return SimpleNamespace(images=tuple(images), rig=RIG, t_ns=seq * FRAME_NS)


@pytest.fixture(scope="module")
def still():
    """State of both lenses when the camera was calibrated."""
    frame, ranges_m = frame_of(through_both((0, 0, 0))), (FAR, FAR)
    calibration = Calibration.unrefined(Pose.identity())
    return rig_state(frame, Pose.identity(), calibration, None, ranges_m=ranges_m)


@pytest.fixture(scope="module")
def turned():
    return frame_of(through_both(TURN), 1)


@pytest.fixture(scope="module")
def covered():
    return frame_of(through_both((0, 0, 0), hidden=1.0), 2)


@pytest.mark.parametrize(
    ("moved_m", "turned_deg", "stands"),
    [(0.0, 0.0, True), (0.9 * RIG_MOVED_M, 0.5, True), (0.021, 0.0, False), (0.0, 0.7, False)],
)
def test_a_marker_that_shakes_is_not_one_that_moved(still, moved_m, turned_deg, stands):
    turn = rotation_from_vector(np.array([0.0, np.radians(turned_deg), 0.0]))
    assert still.is_unmoved(Pose(turn, np.array([0.0, moved_m, 0.0]))) == stands


def test_the_first_picture_of_a_bump_says_how_far_it_went(still, turned):
    after = look_through(still, turned)
    assert after.blind is None
    assert after.motion is not None
    np.testing.assert_allclose(after.motion.twist[:3], TURN, atol=2e-4)


def test_a_camera_that_stands_is_only_glanced_at(still):
    frame = frame_of(through_both((0, 0, 0)))
    assert look_through(still, frame) is still


def test_a_covered_camera_is_blind_until_it_sees_again(still, covered):
    state = still
    for looks in range(1, BLIND_LOOKS + 1):
        assert state.blind is None or not state.blind.is_due(covered.t_ns)
        state = look_through(state, covered)
        assert state.blind == Blind(covered.t_ns, looks)
    assert state.blind.is_due(covered.t_ns)
    again = look_through(state, frame_of(through_both((0, 0, 0))))
    assert again.blind is None
    assert again.motion is None


def test_after_an_attempt_the_next_one_waits():
    tried = Blind(0, 9, tried_ns=5)
    assert not tried.is_due(4 + RETRY_NS)
    assert tried.is_due(5 + RETRY_NS)


def test_what_is_said(still):
    lost = replace(still, blind=Blind(FRAME_NS, 3))
    tried = replace(still, blind=Blind(FRAME_NS, 3, tried_ns=3 * FRAME_NS))
    turn = Pose(rotation_from_vector(TURN), np.array([0.03, 0.0, 0.04]))
    moved = replace(still, calibration=still.calibration.carried_along(turn))

    def said(before, after, now_ns=3 * FRAME_NS):
        return [n.moment for n in camera_notices(before, after, now_ns)]

    assert said(None, still) == said(still, still) == said(still, lost) == said(lost, still) == []
    assert said(lost, tried) == [CameraMoment.NOT_FOUND]
    assert said(tried, tried) == []
    assert said(tried, still) == [CameraMoment.FOUND]
    notices = camera_notices(still, moved, 0)
    assert [n.moment for n in notices] == [CameraMoment.BUMPED, CameraMoment.FOUND]
    assert notices[0].shifted_cm == pytest.approx(5.0)
    assert notices[0].turned_deg == pytest.approx(np.degrees(np.linalg.norm(TURN)))
    assert "0.44° and 5.0 cm" in notices[0].described()
    assert camera_notices(tried, moved, 4 * FRAME_NS)[0].since_s == pytest.approx(0.3)


def test_a_carried_pose_is_less_certain(still):
    step = Pose(rotation_from_vector(TURN), np.array([0.0, 0.01, 0.0]))
    once = still.calibration.carried_along(step)
    assert (once.sigma > still.calibration.sigma).all()
    assert once.carried == 1
    np.testing.assert_allclose(once.world_from_rig.matrix(), step.matrix())
