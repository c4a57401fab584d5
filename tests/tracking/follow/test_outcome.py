"""Tracks while the camera's place is not known, and once it is another."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from scenes.pose import Pose
from scenes.state import TrackState
from tracking.follow.outcome import hold, see_anew
from tracking.follow.track import new_track

POSE = Pose.from_yaw(0.3, (1.0, 2.0, 0.0))
RESTING = new_track(SimpleNamespace(source=SimpleNamespace(world_from_object=POSE)))


def test_what_rests_keeps_its_place_and_its_certainty():
    after = hold(RESTING, 500)
    assert after.world_from_object is POSE
    assert after.state is TrackState.STATIC
    np.testing.assert_array_equal(after.covariance, RESTING.covariance)


def test_what_moved_is_held_as_hidden_and_ever_less_certain():
    moving = replace(RESTING, state=TrackState.TRACKED)
    once = hold(moving, 500)
    assert (once.state, once.missed_frames, once.motion.t_ns) == (TrackState.OCCLUDED, 1, 500)
    assert once.world_from_object is POSE
    assert (np.diag(once.covariance) > np.diag(moving.covariance)).all()
    assert not once.motion.velocity.any()


def test_seen_from_elsewhere_patches_are_no_longer_compared():
    rest = SimpleNamespace()
    assert see_anew(replace(RESTING, rest=rest)).rest is None
    assert see_anew(RESTING).world_from_object is POSE
