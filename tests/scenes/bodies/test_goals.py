"""Goals of avatars: sides, kinds of hands, pointing."""

import numpy as np

from scenes.bodies.goals import GRIP_M, goals_of, pointing_wrists
from scenes.bodies.hands import POINTING
from scenes.frames import look_at
from scenes.state import Avatar

HEAD = look_at(np.array([0.0, 0.0, 1.6]), np.array([2.0, 0.0, 1.6]))
AHEAD = np.array([[0.4, 0.0, 1.3], [2.0, 0.0, 1.0]])


def test_heads_look_along_their_own_x():
    goals = goals_of([Avatar("a", "local", HEAD)])
    assert np.allclose(goals.heads[0], np.eye(3))
    assert np.isnan(goals.wrists).all()


def test_one_hand_is_of_the_side_that_it_is_on():
    for y, side in ((0.3, 0), (-0.3, 1)):
        goals = goals_of([Avatar("a", "local", HEAD, (np.array([[0.4, y, 1.2]]),))])
        assert np.isfinite(goals.wrists[0, side]).all()
        assert np.isnan(goals.wrists[0, 1 - side]).all()
        assert goals.grips_m[0, side] == GRIP_M


def test_two_hands_are_left_and_right_and_the_nearer_one_points():
    hands = (np.array([[0.4, 0.3, 1.2]]), np.array([[0.4, -0.05, 1.3]]))
    goals = goals_of([Avatar("a", "local", HEAD, hands, AHEAD)])
    assert np.allclose(goals.fingers[0, 1], POINTING)
    assert np.isnan(goals.fingers[0, 0]).all()
    assert np.isnan(goals.aims).all()


def test_who_has_a_ray_and_no_hands_points():
    goals = goals_of([Avatar("a", "remote", HEAD, (), AHEAD), Avatar("b", "remote", HEAD)])
    assert np.allclose(goals.aims[0], AHEAD[1])
    assert np.isnan(goals.aims[1]).all()
    shoulder = np.array([[-0.1, -0.2, 1.4]])
    wrist = pointing_wrists(goals.aims[:1], shoulder)
    assert np.allclose(np.cross(wrist - shoulder, AHEAD[1] - shoulder), 0.0, atol=1e-9)
