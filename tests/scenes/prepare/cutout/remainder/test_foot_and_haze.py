import numpy as np
import pytest

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
    everything = np.ones(len(cloud), dtype=bool)
    seen = rng.uniform(-BOOK / 2, BOOK / 2, (20000, 3)) + np.array([0.0, 0.0, 0.755])
    beside = beside_foot(cloud, everything, 0.74, surface=seen)
    assert beside[len(book) :].all()
    edge = np.flatnonzero(book[:, 2] > 0.745)
    assert beside[edge].mean() < 0.01


@pytest.mark.parametrize("thick_m", [0.018, 0.03])
def test_a_thin_book_keeps_its_sides_where_nothing_of_it_is_high_above_the_table(thick_m):
    rng = np.random.default_rng(4)
    size = np.array([0.18, 0.25, thick_m])
    faces = rng.integers(0, 3, 4000)
    surface = rng.uniform(-size / 2, size / 2, (4000, 3))
    ends = np.where(rng.random(4000) < 0.5, -0.5, 0.5) * size[faces]
    surface[np.arange(4000), faces] = ends
    surface = surface[surface[:, 2] > -0.4 * thick_m] + np.array([0, 0, 0.74 + thick_m / 2])
    # Depth leaves the rim of the cover low: less than the level that splats of a table scatter in.
    surface[:, 2] -= 0.3 * thick_m * (np.abs(surface[:, 0]) > 0.07)
    cloud = splats(surface)
    beside = beside_foot(cloud, np.ones(len(cloud), dtype=bool), 0.74, surface=surface[::2])
    assert beside.mean() < 0.1


def test_a_mat_stands_on_nothing_and_is_kept():
    mat = splats(np.random.default_rng(2).uniform((0, 0, 0), (0.5, 0.5, 0.004), (300, 3)))
    none = np.zeros((0, 3))
    assert not beside_foot(mat, np.ones(len(mat), dtype=bool), 0.0, surface=none).any()


def test_haze_hangs_off_only_well_away_from_the_thing():
    rng = np.random.default_rng(3)
    wall = np.column_stack([np.zeros(500), rng.uniform(0, 1, (500, 2))])
    offsets = np.array([0.01, 0.02, 0.04, 0.08])
    haze = splats(np.column_stack([offsets, np.full((4, 2), 0.5)]))
    which = np.array([True, True, True, False])
    np.testing.assert_array_equal(hanging_off(haze, which, wall), [False, False, True, False])
    np.testing.assert_array_equal(hanging_off(haze, which, wall[:0]), which)
