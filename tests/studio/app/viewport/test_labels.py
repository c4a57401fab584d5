"""No label covers another; nearer ones keep their places."""

from itertools import combinations

from hypothesis import given
from hypothesis import strategies as st

from studio.app.viewport.labels import MAX_RISE, Wanted, spread

WIDTH, HEIGHT = 400.0, 300.0
LABELS = st.lists(
    st.builds(
        Wanted,
        x_px=st.floats(-50, WIDTH + 50),
        bottom_px=st.floats(-50, HEIGHT + 50),
        width_px=st.floats(5, 160),
        height_px=st.floats(8, 30),
        depth_m=st.floats(0.1, 20),
    ),
    max_size=14,
)


@given(LABELS)
def test_no_two_visible_labels_overlap_and_none_is_cut_off(wanted):
    placed = spread(wanted, WIDTH, HEIGHT)
    areas = []
    for place in placed:
        label = wanted[place.number]
        right, bottom = place.left_px + label.width_px, place.top_px + label.height_px
        assert place.left_px >= 0
        assert place.top_px >= 0
        assert right <= WIDTH + 1e-9
        assert bottom <= HEIGHT + 1e-9
        areas.append((place.left_px, place.top_px, right, bottom))
    for (l1, t1, r1, b1), (l2, t2, r2, b2) in combinations(areas, 2):
        assert r1 <= l2 or r2 <= l1 or b1 <= t2 or b2 <= t1


@given(LABELS)
def test_who_is_left_out_would_have_to_rise_too_far(wanted):
    shown = {place.number: place for place in spread(wanted, WIDTH, HEIGHT)}
    for number, label in enumerate(wanted):
        alone = spread([label], WIDTH, HEIGHT)
        nearer = [n for n in shown if wanted[n].depth_m <= label.depth_m and n != number]
        if number not in shown and alone:
            assert nearer, "nothing nearer is in its way"
        if number in shown:
            assert alone[0].top_px - shown[number].top_px <= MAX_RISE * label.height_px


def test_the_nearest_has_its_place_and_farther_ones_rise_then_vanish():
    wanted = [Wanted(200 + n, 150, 60, 20, 2.0 + n) for n in range(6)]
    placed = spread(wanted, WIDTH, HEIGHT)
    assert [place.number for place in placed] == [0, 1, 2]
    assert [place.is_raised for place in placed] == [False, True, True]
    assert [place.top_px for place in placed] == [130, 109, 88]
