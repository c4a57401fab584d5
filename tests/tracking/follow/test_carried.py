"""A book on a table whose scan fits a little better in the air."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from scenes.pose import Pose
from tracking.follow.carried import is_lifted, is_likelier
from tracking.solve.gauss_newton import Prior

TABLE_M = 0.74
MEAN = np.array([0.0, 0.0, TABLE_M, 0.0])
STANDING = Prior(MEAN, np.array([0.1, 0.1, 0.003, 0.25]))
CARRIED = Prior(MEAN, np.array([0.1, 0.1, 0.08, 0.25]))


def a_task(still_frames=0):
    return SimpleNamespace(
        support_heights_m=(0.0, TABLE_M), track=SimpleNamespace(still_frames=still_frames)
    )


def a_fit(
    height_m,
    contour_chi2,
    *,
    colour_correlation=0.6,
    variance_inflation=1.0,
    textured=True,
    bare=0.0,
):
    return SimpleNamespace(
        world_from_object=Pose.from_yaw(0.0, (0.0, 0.0, height_m)),
        contour_chi2=contour_chi2,
        variance_inflation=variance_inflation,
        colour_correlation=colour_correlation,
        textured=textured,
        visible_fraction=1.0 - bare,
        covered_fraction=0.0,
        reduced=SimpleNamespace(contour=range(200), surface=range(240)),
    )


def carried_wins(carried, standing, *, still_frames=0):
    """Whether it is told to be carried, in whichever order it is asked."""
    task = a_task(still_frames)
    wins = is_likelier(task, (carried, CARRIED), (standing, STANDING))
    assert is_likelier(task, (standing, STANDING), (carried, CARRIED)) == (not wins)
    return wins


def test_a_much_better_outline_in_the_air_is_a_book_in_a_hand():
    assert carried_wins(a_fit(TABLE_M + 0.1, 60.0), a_fit(TABLE_M, 300.0))


def test_a_little_better_outline_does_not_lift_a_book():
    assert not carried_wins(a_fit(TABLE_M + 0.02, 100.0), a_fit(TABLE_M, 108.0))


def test_an_outline_whose_neighbours_err_alike_says_less():
    lifted, standing = (TABLE_M + 0.02, 100.0), (TABLE_M, 125.0)
    assert carried_wins(a_fit(*lifted), a_fit(*standing))
    assert not carried_wins(a_fit(*lifted), a_fit(*standing, variance_inflation=3.0))


def test_the_pattern_has_a_say_and_only_that_of_textured_objects():
    lifted, standing = a_fit(TABLE_M + 0.02, 100.0, colour_correlation=0.4), (TABLE_M, 140.0)
    assert not carried_wins(lifted, a_fit(*standing, colour_correlation=0.9))
    plain = a_fit(TABLE_M + 0.02, 100.0, colour_correlation=0.4, textured=False)
    assert carried_wins(plain, a_fit(*standing, colour_correlation=0.9, textured=False))


def test_what_keeps_still_is_hardly_in_a_hand():
    lifted, standing = a_fit(TABLE_M + 0.02, 100.0), a_fit(TABLE_M, 140.0)
    assert carried_wins(lifted, standing)
    assert not carried_wins(lifted, standing, still_frames=4)


def test_where_the_empty_room_shows_nothing_stands():
    lifted, standing = a_fit(TABLE_M + 0.1, 100.0, colour_correlation=0.9), (TABLE_M, 95.0)
    assert not carried_wins(lifted, a_fit(*standing, colour_correlation=0.9))
    assert carried_wins(lifted, a_fit(*standing, colour_correlation=0.9, bare=0.85))


@pytest.mark.parametrize(
    ("height_m", "lifted"), [(TABLE_M, False), (TABLE_M + 0.05, True), (0.01, False), (0.1, True)]
)
def test_lifted_is_above_every_support_nearby(height_m, lifted):
    assert is_lifted(a_task(), Pose.from_yaw(math.pi, (0.0, 0.0, height_m))) == lifted


def test_what_is_not_in_the_air_stands():
    assert not carried_wins(a_fit(TABLE_M + 0.01, 10.0), a_fit(TABLE_M, 300.0))
