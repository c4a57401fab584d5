import numpy as np
import pytest

from scenes.prepare.cutout.remainder.residual_splats import residual_splats
from scenes.splats import SH_C0, SplatCloud

TABLE_M = 0.74
WOOD, BLACK, BLUE = (0.6, 0.45, 0.3), (0.02, 0.02, 0.05), (0.1, 0.2, 0.6)


def splats(low, high, count, colour, *, size=0.01, seed=0):
    return splats_at(np.random.default_rng(seed).uniform(low, high, (count, 3)), colour, size)


def splats_at(points, colour, size):
    count = len(points)
    turns = np.tile([1.0, 0, 0, 0], (count, 1))
    sh = np.tile((np.array(colour) - 0.5) / SH_C0, (count, 1, 1))
    return SplatCloud(points, np.full((count, 3), size), turns, np.full(count, 0.9), sh)


def joined(*clouds):
    whole = [
        np.concatenate([getattr(cloud, name) for cloud in clouds])
        for name in ("means", "scales", "rotations", "opacities", "sh")
    ]
    kind = np.repeat(np.arange(len(clouds)), [len(cloud) for cloud in clouds])
    return SplatCloud(*whole), kind


BOOK, EDGE, TABLE, SHADOW_FAR, KEYS = range(5)


@pytest.fixture
def table():
    """A book on a wooden table: its lower edge, a dark spot farther off, and small black keys."""
    return joined(
        splats((-0.09, -0.12, TABLE_M), (0.09, 0.12, TABLE_M + 0.03), 400, BLUE),
        splats((0.07, -0.1, TABLE_M - 0.01), (0.11, 0.1, TABLE_M), 40, BLACK),
        splats((-0.4, -0.4, TABLE_M - 0.02), (0.4, 0.4, TABLE_M), 900, WOOD, size=0.02),
        splats((0.2, -0.1, TABLE_M - 0.01), (0.24, 0.1, TABLE_M), 10, BLACK),
        splats((-0.35, 0.3, TABLE_M), (0.0, 0.38, TABLE_M + 0.01), 300, BLACK, size=0.003),
    )


def test_a_books_lower_edge_goes_with_it_and_the_table_under_it_stays(table):
    cloud, kind = table
    left = residual_splats(cloud, kind == BOOK, TABLE_M)
    np.testing.assert_array_equal(left, kind == EDGE)


def test_a_colour_that_the_support_has_is_no_trace(table):
    cloud, kind = table
    dark = splats((-0.4, -0.4, TABLE_M - 0.02), (0.4, 0.4, TABLE_M), 900, BLACK, size=0.02, seed=1)
    striped, kinds = joined(cloud.select(kind != SHADOW_FAR), dark)
    labels = np.zeros(len(striped), dtype=bool)
    labels[: (kind == BOOK).sum()] = True
    assert kinds.max() == 1
    assert not residual_splats(striped, labels, TABLE_M).any()


def test_what_a_box_encloses_was_seen_by_nobody():
    turn = np.linspace(0, 2 * np.pi, 400)
    circle = np.stack([0.2 * np.cos(turn), 0.2 * np.sin(turn), np.full(400, 0.02)], axis=1)
    rim = splats_at(circle, BLUE, 0.01)
    inside = splats((-0.03, -0.03, -0.01), (0.03, 0.03, 0.0), 20, BLACK)
    floor = splats((-0.5, -0.5, -0.02), (0.5, 0.5, 0.0), 1500, WOOD, size=0.02)
    cloud, kind = joined(rim, inside, floor)
    np.testing.assert_array_equal(residual_splats(cloud, kind == 0, 0.0), kind == 1)


def test_nothing_is_told_where_nothing_is_around(table):
    cloud, kind = table
    alone = cloud.select((kind == BOOK) | (kind == EDGE))
    labels = kind[(kind == BOOK) | (kind == EDGE)] == BOOK
    assert not residual_splats(alone, labels, TABLE_M).any()
    assert not residual_splats(cloud, kind == BOOK, TABLE_M - 0.5).any()
