"""Bodies of wearers, and what a headset says of them."""

from __future__ import annotations

import numpy as np
import pytest

from devices.hololens.axes import head_and_hands
from devices.hololens.values import Joint
from devices.hololens.wire.spatial_input import encode_input, read_input
from scenes.pose import Pose
from sim.hololens.axes import input_of, nothing_seen
from sim.hololens.wearer import Stroller


@pytest.mark.parametrize("seed", range(4))
def test_wearers_have_two_hands_of_26_joints(seed):
    body = Stroller(seed).at(3.0)
    for hand in (body.left, body.right):
        assert hand is not None
        assert hand.positions_m.shape == (26, 3)
        wrist, tip = hand.positions_m[Joint.WRIST], hand.positions_m[Joint.MIDDLE_TIP]
        assert 0.1 < np.linalg.norm(tip - wrist) < 0.25
        products = hand.rotations @ hand.rotations.transpose(0, 2, 1)
        assert np.allclose(products, np.eye(3), atol=1e-9)
        assert np.allclose(np.linalg.det(hand.rotations), 1)
        along = hand.positions_m[Joint.INDEX_TIP] - hand.positions_m[Joint.INDEX_DISTAL]
        along /= np.linalg.norm(along)
        assert np.allclose(-hand.rotations[Joint.INDEX_DISTAL][:, 2], along)


def test_what_a_headset_says_comes_back():
    body = Stroller(2).at(1.0)
    world_from_room = Pose.from_yaw(2.5, (1, -2, -1.6))
    data = encode_input(input_of(body, world_from_room, before=nothing_seen()))
    found = head_and_hands(read_input(data), seq=0, t_ns=0, arrived_ns=0)
    assert found.world_from_head is not None
    assert found.left is not None
    assert found.gaze is not None
    assert body.left is not None
    assert body.gaze is not None
    head = world_from_room @ body.world_from_head
    assert np.allclose(found.world_from_head.matrix(), head.matrix(), atol=1e-6)
    assert np.allclose(found.left.positions_m, world_from_room @ body.left.positions_m, atol=1e-6)
    turned = world_from_room.rotation @ body.left.rotations
    assert np.allclose(found.left.rotations, turned, atol=1e-6)
    looked = world_from_room.rotation @ body.gaze.direction
    assert np.allclose(found.gaze.direction, looked, atol=1e-6)


def test_what_is_not_seen_stays_as_it_was_and_is_not_valid():
    seen = input_of(Stroller(0).at(0.0), Pose.identity(), before=nothing_seen())
    lost = input_of(None, Pose.identity(), before=seen)
    assert int(lost.valid) == 0
    assert np.array_equal(lost.head, seen.head)
    assert np.array_equal(lost.left, seen.left)
