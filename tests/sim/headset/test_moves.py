import numpy as np
import pytest

from devices.hub.protocol.wire import JOINTS, MAX_BODY_BYTES, decode_body, encode_body
from scenes.frames import WORLD_FROM_GLTF
from sim.headset.moves import HEIGHT_M, INDEX_TIP, Moves


@pytest.mark.parametrize("seed", range(4))
def test_a_body_goes_over_the_wire(seed):
    body = Moves(seed).body(1.3, seq=5, t_us=77)
    data = encode_body(body)
    assert len(data) <= MAX_BODY_BYTES
    again = decode_body(data)
    assert (again.seq, again.t_us) == (5, 77)
    assert np.allclose(again.room_from_head.matrix(), body.room_from_head.matrix(), atol=1e-5)
    is_held = Moves(seed).has_controllers
    assert is_held == (seed == 3)
    assert (again.hands[0] is None) == is_held
    assert (again.controllers[1] is not None) == is_held


def test_the_same_seed_moves_the_same_and_another_one_does_not():
    first, again, other = (Moves(s).body(2.0, seq=1, t_us=0) for s in (1, 1, 2))
    assert np.array_equal(first.hands[1].joints, again.hands[1].joints)
    assert encode_body(first) == encode_body(again) != encode_body(other)


def test_a_person_has_the_proportions_of_one():
    moves = Moves(0, centre=(1.0, -2.0))
    for t_s in np.linspace(0, 20, 41):
        body = moves.body(t_s, seq=0, t_us=0)
        head = WORLD_FROM_GLTF @ body.room_from_head.translation
        assert abs(head[2] - HEIGHT_M) < 0.05
        assert np.linalg.norm(head[:2] - [1.0, -2.0]) < 1.0
        for hand in body.hands:
            assert hand.joints.shape == (JOINTS, 3)
            assert 0.3 < np.linalg.norm(hand.joints[0] - body.room_from_head.translation) < 0.9
            bones = np.linalg.norm(np.diff(hand.joints[5:10], axis=0), axis=1)
            assert np.all((bones > 0.015) & (bones < 0.07))
        # Somebody looks level, and the hands are in front.
        ahead = -body.room_from_head.rotation[:, 2]
        assert abs(ahead[1]) < 0.5
        assert (body.hands[0].joints[0] - body.room_from_head.translation) @ ahead > 0


def test_the_left_hand_is_left_and_its_thumb_is_inside():
    body = Moves(0).body(0.4, seq=0, t_us=0)
    right = body.room_from_head.rotation[:, 0]
    places = [(hand.joints[0] - body.room_from_head.translation) @ right for hand in body.hands]
    assert places[0] < -0.05
    assert places[1] > 0.05
    for hand, inside in zip(body.hands, (1.0, -1.0), strict=True):
        assert inside * float((hand.joints[4] - hand.joints[24]) @ right) > 0.02


def test_a_ray_begins_at_the_right_index_finger_and_comes_and_goes():
    moves = Moves(2)
    bodies = [moves.body(t_s, seq=0, t_us=0) for t_s in np.linspace(0, 20, 41)]
    rays = [body for body in bodies if body.ray is not None]
    assert 0.4 < len(rays) / len(bodies) < 0.8
    for body in rays:
        assert np.allclose(body.ray[0], body.hands[1].joints[INDEX_TIP])
    assert np.allclose(moves.pen(0.5), moves.body(0.5, seq=0, t_us=0).hands[1].joints[INDEX_TIP])
