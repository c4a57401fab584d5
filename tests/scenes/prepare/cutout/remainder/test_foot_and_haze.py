import numpy as np

from scenes.prepare.cutout.remainder.foot_and_haze import beside_foot, hanging_off
from scenes.splats import SplatCloud

BOOK = np.array([0.18, 0.25, 0.03])


def splats(points, opacity=0.9):
    n = len(points)
    turns = np.tile([1.0, 0, 0, 0], (n, 1))
    sh = np.zeros((n, 1, 3))
    return SplatCloud(points, np.full((n, 3), 0.005), turns, np.full(n, opacity), sh)


def test_a_shadow_beside_a_book_is_the_tables_and_its_lower_edge_is_its_own():
    rng = np.random.default_rng(1)
    book = rng.uniform(-BOOK / 2, BOOK / 2, (6000, 3)) + np.array([0.0, 0.0, 0.755])
    shadow = rng.uniform((0.105, -0.12, 0.737), (0.13, 0.12, 0.743), (80, 3))
    cloud = splats(np.concatenate([book, shadow]))
    beside = beside_foot(cloud, np.ones(len(cloud), dtype=bool), 0.74)
    assert beside[len(book) :].all()
    assert not beside[: len(book)].any()


def test_a_mat_stands_on_nothing_and_is_kept():
    mat = splats(np.random.default_rng(2).uniform((0, 0, 0), (0.5, 0.5, 0.004), (300, 3)))
    assert not beside_foot(mat, np.ones(len(mat), dtype=bool), 0.0).any()


def test_haze_hangs_off_only_well_away_from_the_thing():
    rng = np.random.default_rng(3)
    wall = np.column_stack([np.zeros(500), rng.uniform(0, 1, (500, 2))])
    offsets = np.array([0.01, 0.02, 0.04, 0.08])
    haze = splats(np.column_stack([offsets, np.full((4, 2), 0.5)]))
    which = np.array([True, True, True, False])
    np.testing.assert_array_equal(hanging_off(haze, which, wall), [False, False, True, False])
    np.testing.assert_array_equal(hanging_off(haze, which, wall[:0]), which)
