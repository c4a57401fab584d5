import numpy as np
import pytest

from devices.clock import ManualClock
from tests.pushed_camera import FedPicture, draw_number, numbered_pictures, paced, read_number


@pytest.mark.parametrize("number", [0, 1, 5, 1023, 2**20 - 1])
def test_a_number_is_read_as_it_was_drawn(number):
    picture = np.full((64, 320, 3), 128, np.uint8)
    draw_number(picture, number)
    assert read_number(picture[..., 0]) == number


def test_pictures_are_numbered_and_timed():
    pictures = list(numbered_pictures((320, 160), 25, count=3))
    assert [p.t_ns for p in pictures] == [0, 40_000_000, 80_000_000]
    assert [read_number(p.rgb[..., 1]) for p in pictures] == [0, 1, 2]


def test_pacing_keeps_distances_from_any_origin():
    clock = ManualClock(7_000)
    picture = np.zeros((2, 2, 3), np.uint8)
    given = [FedPicture(500_000 + k * 1000, picture) for k in range(3)]
    assert [clock.now_ns() for _ in paced(given, clock)] == [7_000, 8_000, 9_000]
