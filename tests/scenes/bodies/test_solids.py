"""Boxes that points are pushed out of."""

import numpy as np

from scenes.bodies.solids import GAP_M, Solids
from scenes.bodies.vectors import yaw_rotation

BOX = Solids(
    np.array([[1.0, 0.0, 0.5]]), yaw_rotation(np.array([0.6])), np.array([[0.4, 0.3, 0.5]])
)
NONE = Solids(np.zeros((0, 3)), np.zeros((0, 3, 3)), np.zeros((0, 3)))


def test_depths_are_to_the_nearest_face():
    points = np.array([[1.0, 0.0, 0.95], [1.0, 0.0, 0.5], [3.0, 0.0, 0.5]])
    assert np.allclose(BOX.depths(points), [0.05, 0.3, 0.0])
    assert NONE.depths(points).tolist() == [0.0, 0.0, 0.0]


def test_a_group_leaves_as_a_whole_through_the_nearest_face():
    group = np.array([[[1.0, 0.0, 0.93], [1.0, 0.05, 0.97]], [[5.0, 0.0, 0.0], [5.0, 1.0, 0.0]]])
    shift = BOX.pushes(group)
    assert np.allclose(shift, [[0.0, 0.0, 0.07 + GAP_M], [0.0, 0.0, 0.0]])
    assert BOX.depths(group + shift[:, None]).max() == 0.0


def test_they_can_be_measured_in_another_unit():
    assert np.allclose(BOX.shrunk(0.5).halves, 2 * BOX.halves)
