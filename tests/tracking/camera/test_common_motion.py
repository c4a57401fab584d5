"""A sphere of noise around a rig of two lenses: what all of it shares is the camera's motion."""

import numpy as np
import pytest

from scenes.cameras import Rig
from scenes.frames import FRONT_FROM_BACK_LENS
from scenes.pose import Pose, rotation_angle, rotation_from_vector
from tests.tracking.camera.test_watch import FAR, LENS, RNG, seen
from tracking.camera.common_motion import MOVED_RAD, can_watch, common_motion
from tracking.camera.watch import begin_watch

RIG = Rig((LENS, LENS), (Pose.identity(), FRONT_FROM_BACK_LENS))


def through_both(turn, **how):
    """Pictures of both lenses of a rig that turned by a rotation vector in its axes."""
    turned = rotation_from_vector(np.asarray(turn))
    images = []
    for k, rig_from_lens in enumerate(RIG.rig_from_lens):
        # The sphere is fixed to the rig's first axes: what the lens sees turns with both.
        images.append(seen(as_vector(turned @ rig_from_lens.rotation), seed=k + 10, **how))
    return images


def as_vector(rotation):
    angle = rotation_angle(rotation)
    values, vectors = np.linalg.eig(rotation)
    axis = np.real(vectors[:, np.argmin(np.abs(values - 1))])
    for signed in (axis, -axis):
        if np.allclose(rotation_from_vector(signed * angle), rotation, atol=1e-6):
            return signed * angle
    raise AssertionError("no rotation")


@pytest.fixture(scope="module")
def watches():
    return [
        begin_watch(image, LENS, rig_from_lens, FAR)
        for image, rig_from_lens in zip(through_both((0, 0, 0)), RIG.rig_from_lens, strict=True)
    ]


@pytest.mark.parametrize("turn_deg", [(0.1, 0, 0), (0, -0.5, 0.3), (1.0, 0.6, -0.8), (0, 2.5, 1.0)])
@pytest.mark.parametrize("gain", [1.0, 0.8])
def test_a_turn_is_measured_and_common(watches, turn_deg, gain):
    turn = np.radians(turn_deg)
    motion = common_motion(watches, through_both(turn, gain=gain))
    assert motion is not None
    assert motion.is_common
    assert not motion.is_small
    left = motion.then_from_now.rotation.T @ rotation_from_vector(turn)
    assert np.degrees(rotation_angle(left)) < 0.02


def test_a_camera_that_stands_scatters_far_less_than_what_is_noticed(watches):
    motion = common_motion(watches, through_both((0, 0, 0)))
    assert motion is not None
    assert motion.is_small
    assert motion.flow_rad < 0.2 * MOVED_RAD


def test_what_hides_a_third_of_both_lenses_does_not_move_the_camera(watches):
    motion = common_motion(watches, through_both((0, 0, 0), hidden=0.3))
    assert motion is not None
    assert motion.is_small


def test_something_that_turns_before_one_lens_is_not_the_camera(watches):
    before, after = through_both((0, 0, 0)), through_both(np.radians((0, 1.0, 0)))
    mixed = before[0].copy()
    mixed[:, : LENS.width_px // 3] = after[0][:, : LENS.width_px // 3]
    motion = common_motion(watches, [mixed, before[1]])
    assert motion is not None
    assert motion.is_small


def test_nothing_is_guessed_where_all_is_hidden_or_another_room(watches):
    assert common_motion(watches, through_both((0, 0, 0), hidden=1.0)) is None
    other = [RNG.integers(0, 255, (960, 960, 3), dtype=np.uint8) for _ in range(2)]
    motion = common_motion(watches, other)
    assert motion is None or not motion.is_common


def test_a_blank_room_cannot_be_watched(watches):
    blank = np.full((960, 960, 3), 120, np.uint8)
    plain = [begin_watch(blank, LENS, Pose.identity(), FAR)]
    assert not can_watch(plain)
    assert can_watch(watches)
    assert common_motion(plain, [blank]) is None
