"""The box around an object in cells."""

import numpy as np
import pytest

from scenes.coverage.sides import BOTTOM, NORMALS, TOP, box_cells

BOX_M = (0.4, 0.6, 0.9)


def test_cells_lie_on_their_side_and_make_up_its_area():
    cells = box_cells(BOX_M)
    outer = {0: 0.2, 1: -0.2, 2: 0.3, 3: -0.3, TOP: 0.9, BOTTOM: 0.0}
    for side, at in outer.items():
        axis = int(np.argmax(np.abs(NORMALS[side])))
        np.testing.assert_allclose(cells.points[side][:, axis], at)
        others = [a for a in range(3) if a != axis]
        assert 64 * cells.areas_m2[side] == pytest.approx(np.prod(np.array(BOX_M)[others]))
        assert len(np.unique(cells.points[side].round(9), axis=0)) == 64
    low, high = cells.points.min(axis=(0, 1)), cells.points.max(axis=(0, 1))
    np.testing.assert_allclose([low, high], [[-0.2, -0.3, 0], [0.2, 0.3, 0.9]], atol=1e-12)


def test_an_eye_in_front_of_a_side_faces_it_and_not_the_other():
    facing = box_cells(BOX_M).facing(np.array([3.0, 0.0, 0.45]))
    assert (facing[0] > 0.95).all()
    assert (facing[1] < 0).all()
    assert (facing[2:] < 0.35).all()
