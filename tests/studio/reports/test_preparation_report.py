"""The curve of a training's report: views take turns, a round of them is one figure."""

import numpy as np

from studio.reports.preparation_report import mean_of_rounds


def test_views_of_different_difficulty_make_a_level_line_once_each_was_shown():
    values = np.tile([20.0, 30.0, 40.0], 4)
    np.testing.assert_allclose(mean_of_rounds(values, 3)[2:], 30.0)


def test_the_first_round_is_the_mean_so_far():
    np.testing.assert_allclose(mean_of_rounds(np.array([20.0, 30.0, 40.0]), 8), [20.0, 25.0, 30.0])


def test_without_views_kept_aside_every_value_stands_for_itself():
    np.testing.assert_allclose(mean_of_rounds(np.array([20.0, 30.0]), 0), [20.0, 30.0])
