"""Small pictures stand beside each other, inside the view."""

from itertools import combinations

from hypothesis import given
from hypothesis import strategies as st

from studio.app.viewport.insets.insets import EDGE_PX, FOOT_PX, MAX_INSETS, placed

WIDE, SQUARE = 9 / 16, 1.0
HEIGHTS = st.lists(st.sampled_from([WIDE, SQUARE]), max_size=MAX_INSETS)


@given(HEIGHTS, st.integers(120, 4000), st.integers(160, 2500))
def test_they_are_inside_and_none_is_over_another(heights, width, height):
    places = placed(heights, width, height)
    assert len(places) == len(heights)
    for left, top, wide, tall in places:
        assert left >= EDGE_PX
        assert top >= EDGE_PX
        assert left + wide <= width - EDGE_PX
        assert top + tall <= height - FOOT_PX
        assert wide >= 1
        assert tall >= 1
    for (l1, t1, w1, h1), (l2, t2, w2, h2) in combinations(places, 2):
        assert l1 + w1 <= l2 or l2 + w2 <= l1 or t1 + h1 <= t2 or t2 + h2 <= t1


def test_two_points_of_view_leave_most_of_the_usual_view_free():
    """The view of a window of 1280 × 800 with its docks as they are at first."""
    width, height = 622, 430
    places = placed([WIDE, WIDE], width, height)
    assert places[0][1] == places[1][1]  # beside each other
    assert all(wide >= 200 for _, _, wide, _ in places)
    assert sum(wide * tall for _, _, wide, tall in places) < 0.2 * width * height
