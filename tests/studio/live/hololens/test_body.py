"""A wearer as people in a session see them."""

import numpy as np
import pytest

from devices.hub.inbox import avatar_of as avatar_from_hub
from devices.hub.protocol.wire import decode_body, encode_body
from devices.hub.roles import Person, Role
from scenes.pose import Pose
from studio.live.hololens.body import avatar_of, body_of, pointing_ray

WORLD_FROM_DEVICE = Pose.from_yaw(0.5, (1.0, 2.0, 0.1))


def test_an_avatar_is_the_wearer_in_the_room(sample_of):
    one = sample_of()
    avatar = avatar_of(one, WORLD_FROM_DEVICE, user_id="hololens", name="Ana")
    assert (avatar.user_id, avatar.role, avatar.name) == ("hololens", "local", "Ana")
    assert np.allclose(avatar.world_from_head.translation, WORLD_FROM_DEVICE @ [0, 0, 1.6])
    assert len(avatar.hands) == 1
    assert avatar.hands[0].shape == (25, 3)
    assert np.allclose(avatar.gaze[1] - avatar.gaze[0], WORLD_FROM_DEVICE.rotation @ [0, 1, 0])


def test_a_stretched_index_beside_a_curled_hand_points(sample_of):
    ray = pointing_ray(sample_of(points=True))
    assert np.allclose((ray[1] - ray[0]) / 2.5, [0, 1, 0])
    assert pointing_ray(sample_of(points=False)) is None


def test_a_hub_shows_the_same_person(sample_of):
    one = sample_of()
    data = encode_body(body_of(one, WORLD_FROM_DEVICE))
    there = avatar_from_hub(decode_body(data), Person("hololens", 9, "Ana", Role.LOCAL))
    here = avatar_of(one, WORLD_FROM_DEVICE, user_id="hololens", name="Ana")
    assert np.allclose(there.world_from_head.matrix(), here.world_from_head.matrix(), atol=1e-5)
    assert np.allclose(there.hands[0], here.hands[0], atol=1e-3)
    assert np.allclose(there.ray, here.ray, atol=1e-4)


def test_a_headset_that_is_lost_shows_nobody(sample_of):
    one = sample_of(is_lost=True)
    assert avatar_of(one, WORLD_FROM_DEVICE, user_id="a", name="") is None
    assert body_of(one, WORLD_FROM_DEVICE) is None


@pytest.mark.parametrize("points", [True, False])
def test_a_body_has_a_ray_while_it_points(sample_of, points):
    assert (body_of(sample_of(points=points), WORLD_FROM_DEVICE).ray is not None) is points
