import pytest

from studio.app.scenario.floor.view import middle_of, with_part_at

SCREEN = ((0.5, 2.4, 1.5), (1.7, 2.4, 1.5), (1.7, 2.4, 0.9), (0.5, 2.4, 0.9))


def test_the_middle_of_an_edge_is_above_its_corners():
    assert middle_of(SCREEN, "left") == (0.5, 2.4)
    assert middle_of(SCREEN, "right") == (1.7, 2.4)
    assert middle_of(SCREEN, "whole") == pytest.approx((1.1, 2.4))


def test_a_dragged_edge_leaves_the_other_and_all_heights():
    moved = with_part_at(SCREEN, "right", 1.5, 2.0)
    assert moved == [(0.5, 2.4, 1.5), (1.5, 2.0, 1.5), (1.5, 2.0, 0.9), (0.5, 2.4, 0.9)]


def test_a_dragged_whole_keeps_its_shape():
    moved = with_part_at(SCREEN, "whole", 1.2, 2.2)
    for before, after in zip(SCREEN, moved, strict=True):
        assert after == pytest.approx((before[0] + 0.1, before[1] - 0.2, before[2]))
