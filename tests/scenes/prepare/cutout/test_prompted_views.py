import numpy as np
import pytest

from scenes.prepare.cutout.prompted_views import looks_like

WOOD, PAPER, BLUE = (196, 160, 112), (235, 235, 232), (24, 60, 150)


@pytest.fixture
def table():
    """Pixels of a wooden table with a sheet of paper on it."""
    rng = np.random.default_rng(4)
    colours = np.repeat([WOOD, PAPER], [950, 50], axis=0) + rng.normal(0, 4, (1000, 3))
    return np.clip(colours, 0, 255).astype(np.uint8)


def test_the_same_wood_is_the_table_in_light_and_in_shadow(table):
    asked = np.array([WOOD, [0.8 * c for c in WOOD], [1.08 * c for c in WOOD]]).astype(np.uint8)
    assert looks_like(asked, table).all()


def test_a_book_is_not_the_table_however_thin_it_is(table):
    assert not looks_like(np.array([BLUE, PAPER, (12, 12, 12)], dtype=np.uint8), table).any()


def test_with_nothing_to_compare_the_rooms_shape_decides():
    asked = np.array([WOOD], dtype=np.uint8)
    assert looks_like(asked, np.zeros((0, 3), dtype=np.uint8)).all()
    assert not len(looks_like(np.zeros((0, 3), dtype=np.uint8), asked))
