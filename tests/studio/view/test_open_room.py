"""From outside, walls and ceiling between the eye and the room go; lamps, rails and floors stay."""

from __future__ import annotations

import numpy as np
import pytest

from scenes.opening import open_scene
from scenes.splats import SplatCloud
from studio.view.open_room import room_sides

LOW, HIGH = np.array([-2.0, -1.5]), np.array([2.0, 1.5])


def cloud(points):
    count = len(points)
    return SplatCloud(
        means=np.asarray(points, np.float32),
        scales=np.full((count, 3), 0.05, np.float32),
        rotations=np.tile(np.array([1, 0, 0, 0], np.float32), (count, 1)),
        opacities=np.full(count, 0.9, np.float32),
        sh=np.zeros((count, 1, 3), np.float32),
    )


def grid(*axes):
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)


def room(*, ceiling=True):
    x, y, z = (np.linspace(a, b, 25) for a, b in ((-2, 2), (-1.5, 1.5), (0, 2.5)))
    parts = [grid(x, y, [0.0]), grid([2.0], y, z), grid(x, [1.5], z), grid([-2.0], y, z)]
    if ceiling:
        parts.append(grid(x, y, [2.5]))
    # A lamp where no wall is, and something in the middle.
    parts += [grid([0.0], [-1.5], np.linspace(0, 2.5, 25)), np.array([[0.0, 0.0, 1.0]])]
    return cloud(np.concatenate(parts))


def test_closed_sides_are_those_with_walls():
    sides = room_sides(room(), np.stack([LOW, HIGH]))
    assert sides.closed == {(0, False), (0, True), (1, True), (2, True)}
    assert (2, True) not in room_sides(room(ceiling=False), np.stack([LOW, HIGH])).closed


@pytest.mark.parametrize(
    ("eye", "hidden"),
    [
        ((0.0, 0.0, 1.6), set()),
        ((5.0, 0.0, 1.6), {(0, True)}),
        ((-4.0, 4.0, 4.0), {(0, False), (1, True), (2, True)}),
        ((0.0, -4.0, 1.0), set()),
    ],
)
def test_what_hides_the_room_depends_on_the_eye(eye, hidden):
    sides = room_sides(room(), np.stack([LOW, HIGH]))
    assert sides.hiding(np.array(eye)) == hidden


def test_only_hiding_sides_are_left_out():
    whole = room()
    sides = room_sides(whole, np.stack([LOW, HIGH]))
    opened = sides.without(whole, frozenset({(0, True), (2, True)}))
    above_floor = opened.means[opened.means[:, 2] > 0.05]
    assert above_floor[:, 0].max() < 1.91
    assert opened.means[:, 2].max() < 2.41
    assert opened.means[:, 0].max() == 2.0
    assert opened.means[:, 0].min() == -2.0
    assert ((opened.means == [0.0, 0.0, 1.0]).all(axis=1)).any()
    assert len(sides.without(whole, frozenset())) == len(whole)


def test_the_study_room_opens_to_every_side():
    scene = open_scene("lab")
    sides = room_sides(scene.room, scene.footprint_m)
    assert {(0, False), (0, True), (1, False), (1, True)} <= sides.closed
