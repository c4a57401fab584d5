import math

import numpy as np

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.state import Annotation
from studio.view.overlay import draw_line

CAMERA = Pinhole.from_fov(100, 100, math.radians(90))
FROM_ABOVE = look_at(np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.001, 0.0]))


def test_a_line_is_drawn_where_it_is_and_in_its_own_colour():
    picture = np.zeros((100, 100, 3), np.uint8)
    line = Annotation("a-1", "a", np.array([[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]]), (0.0, 1.0, 0.2))
    draw_line(picture, CAMERA, FROM_ABOVE, line)
    rows, columns = np.nonzero(picture.any(axis=2))
    assert 48 <= rows.min() <= rows.max() <= 52
    assert columns.min() <= 27
    assert columns.max() >= 73
    assert tuple(picture[50, 50]) == (0, 255, 51) or tuple(picture[49, 50]) == (0, 255, 51)


def test_the_first_point_of_a_line_draws_nothing():
    picture = np.zeros((100, 100, 3), np.uint8)
    draw_line(picture, CAMERA, FROM_ABOVE, Annotation("a-1", "a", np.zeros((1, 3)), (1, 1, 1)))
    assert not picture.any()
