"""Boxes, lines and arrows of shapes that a headset can draw."""

import numpy as np

from scenes.pose import Pose
from studio.live.hololens.showing.edges import (
    EDGES,
    arrow,
    outline,
    polyline,
    rod,
    rotation_to,
    simplified,
)

WHITE = (1.0, 1.0, 1.0, 1.0)


def ends(solid):
    along = solid.world_from_item.rotation[:, 2] * 0.5 * solid.size_m[2]
    return solid.world_from_item.translation - along, solid.world_from_item.translation + along


def test_a_rod_reaches_from_one_point_to_the_other():
    start, end = np.array([0.1, 0.2, 0.3]), np.array([1.0, -0.4, 0.9])
    made = rod(start, end, width_m=0.01, colour=WHITE)
    assert np.allclose(ends(made), (start, end))
    assert rod(start, start, width_m=0.01, colour=WHITE) is None


def test_z_is_turned_anywhere():
    for direction in np.vstack([np.eye(3), -np.eye(3), [[0.6, 0.0, 0.8]]]):
        turn = rotation_to(direction)
        assert np.allclose(turn @ [0, 0, 1], direction)
        assert np.allclose(turn @ turn.T, np.eye(3))


def test_an_outline_has_twelve_edges_around_the_box():
    made = outline(Pose.identity(), (0.4, 0.6, 0.8), width_m=0.004, colour=WHITE)
    assert len(made) == len(EDGES) == 12
    corners = np.array([end for solid in made.values() for end in ends(solid)])
    assert np.allclose(corners.min(0), [-0.2, -0.3, 0.0])
    assert np.allclose(corners.max(0), [0.2, 0.3, 0.8])


def test_a_straight_line_of_many_points_is_one_rod_and_a_bent_one_more():
    straight = np.linspace([0, 0, 0], [1, 0, 0], 50)
    assert len(polyline(straight, width_m=0.01, colour=WHITE, tolerance_m=0.003)) == 1
    angle = np.linspace(0, np.pi, 100)
    bent = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    kept = simplified(bent, 0.003)
    assert 8 < len(kept) < 40
    assert kept[0] == 0
    assert kept[-1] == 99


def test_a_line_that_grows_keeps_its_parts():
    angle = np.linspace(0, np.pi, 100)
    bent = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    before, after = simplified(bent[:60], 0.003), simplified(bent, 0.003)
    assert after[: len(before) - 1] == before[:-1]
    assert simplified(bent[:0], 0.003) == []


def test_an_arrow_points_along_x():
    made = arrow(Pose.identity(), (0.5, 0.2, 0.1), colour=WHITE)
    tips = [ends(made[name])[1] for name in ("shaft", "left", "right")]
    assert np.allclose(tips, [[0.25, 0.0, 0.05]] * 3)
