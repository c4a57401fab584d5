"""Tracked hands to angles and back to bones."""

import numpy as np
import pytest

from scenes.bodies.hands import JOINTS, POINTING, RELAXED, REST, finger_angles, fingers


def tracked(angles):
    """(2, 25, 3) joints as a headset gives them, of hands that are held along the world's axes."""
    places, _ = fingers(np.broadcast_to(angles, (2, *angles.shape)))
    found = np.zeros((2, JOINTS, 3))
    found[:, 1:5] = places[:, 0]
    for finger in range(1, 5):
        first = 5 * finger + 1
        found[:, first : first + 4] = places[:, finger]
        found[:, first - 1] = 0.3 * places[:, finger, 0]
    return found


@pytest.mark.parametrize("angles", [REST, RELAXED, POINTING])
def test_angles_of_a_hand_come_back(angles):
    palm, found = finger_angles(tracked(angles))
    assert np.degrees(np.abs(found - angles)).max() < 8.0
    assert np.allclose(palm @ np.swapaxes(palm, -1, -2), np.eye(3))
    assert np.allclose(palm, np.eye(3), atol=0.12)


def test_left_and_right_are_mirrored_and_bones_keep_their_lengths():
    places, turns = fingers(np.broadcast_to(POINTING, (2, 5, 4)))
    assert np.allclose(places[0], places[1] * (1, -1, 1))
    flat, _ = fingers(np.broadcast_to(REST, (2, 5, 4)))
    lengths = [np.linalg.norm(np.diff(each, axis=-2), axis=-1) for each in (places, flat)]
    assert np.allclose(*lengths)
    assert np.allclose(np.linalg.det(turns), 1.0)


def test_a_pointing_hand_points_ahead():
    places, _ = fingers(np.broadcast_to(POINTING, (2, 5, 4)))
    tips = places[1, :, 3]
    assert tips[1, 0] > 0.17 > 0.1 > tips[2:, 0].max()


def test_what_no_finger_does_is_within_its_limits():
    joints = np.random.default_rng(1).normal(size=(200, 2, JOINTS, 3))
    palm, angles = finger_angles(joints)
    assert np.isfinite(palm).all()
    assert np.degrees(angles[..., 0]).max() <= 22.01
    assert np.degrees(angles[..., 1:]).min() >= -30.01
    assert np.degrees(angles[..., 1:]).max() <= 105.01
