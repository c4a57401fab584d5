"""Whether the camera still stands where it was calibrated, by its marker and by its pictures."""

from types import SimpleNamespace

import numpy as np
import pytest

from scenes.cameras import Rig
from scenes.frames import FRONT_FROM_BACK_LENS
from scenes.pose import Pose, rotation_angle, rotation_from_vector
from tests.tracking.camera.test_watch import LENS, seen
from tracking.camera.rig_state import BUMPED_LOOKS, RIG_MOVED_M, RigState, looked_through
from tracking.camera.watch import watched

TURN = np.radians((0.25, 0.3, -0.2))
RIG = Rig((LENS, LENS), (Pose.identity(), FRONT_FROM_BACK_LENS))


@pytest.fixture(scope="module")
def still():
    """What both lenses saw when the camera was calibrated, here the same."""
    watch = watched(seen((0, 0, 0)), LENS)
    return RigState(Pose.identity(), None, None, (watch, watch))


@pytest.fixture(scope="module")
def frames():
    """Pictures from where it stood, and turned."""

    def frame(turn, seed):
        return SimpleNamespace(images=(seen(turn, seed=seed),) * 2, rig=RIG)

    return frame((0, 0, 0), 1), frame(TURN, 2)


@pytest.mark.parametrize(
    ("moved_m", "turned_deg", "stands"),
    [(0.0, 0.0, True), (0.9 * RIG_MOVED_M, 0.5, True), (0.021, 0.0, False), (0.0, 0.7, False)],
)
def test_a_marker_that_shakes_is_not_one_that_moved(still, moved_m, turned_deg, stands):
    turn = rotation_from_vector(np.array([0.0, np.radians(turned_deg), 0.0]))
    assert still.is_unmoved(Pose(turn, np.array([0.0, moved_m, 0.0]))) == stands


def test_only_a_second_look_in_a_row_says_that_it_was_bumped(still, frames):
    same, turned = frames
    once, _ = looked_through(still, turned, 0)
    assert (once.turned_looks, once.is_bumped) == (1, False)
    twice, _ = looked_through(once, turned, 1)
    assert (twice.turned_looks, twice.is_bumped) == (BUMPED_LOOKS, True)
    assert looked_through(once, same, 1)[0].turned_looks == 0


@pytest.mark.parametrize("lens", [0, 1])
def test_how_far_the_rig_turned_is_told_in_its_own_axes(still, frames, lens):
    _, rig_from_turned = looked_through(still, frames[1], lens)
    rig_from_lens = RIG.rig_from_lens[lens].rotation
    wanted = rig_from_lens @ rotation_from_vector(TURN) @ rig_from_lens.T
    left = wanted.T @ rig_from_turned.rotation
    assert np.degrees(rotation_angle(left)) < 0.02
    np.testing.assert_allclose(rig_from_turned.translation, 0.0, atol=1e-12)


def test_without_its_turn_nothing_is_looked_at(still, frames):
    known, rig_from_turned = looked_through(still, frames[1], None)
    assert known is still
    np.testing.assert_array_equal(rig_from_turned.matrix(), np.eye(4))
