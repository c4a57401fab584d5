"""Units of several tracks are put together by their order, also after some were lost."""

from hypothesis import given
from hypothesis import strategies as st

from devices.camera.unit_sets import Place, UnitSets


def places(tracks, order):
    sets = UnitSets(tracks)
    return [sets.place(track) for track in order]


def test_every_unit_of_a_single_track_is_a_picture():
    assert places(1, [0, 0, 0]) == [Place.LAST] * 3


def test_tracks_may_come_in_any_order():
    assert places(3, [0, 1, 2, 2, 0, 1]) == [Place.FIRST, Place.BETWEEN, Place.LAST] * 2


def test_what_begins_anew_ends_with_all_tracks():
    sets = UnitSets(2)
    sets.place(1)
    sets.begin()
    assert [sets.place(0), sets.place(1)] == [Place.FIRST, Place.LAST]


@given(st.integers(2, 3), st.sets(st.tuples(st.integers(0, 11), st.integers(1, 2))))
def test_lost_units_of_later_tracks_cost_their_own_pictures_only(tracks, lost):
    units = [(n, k) for n in range(12) for k in range(tracks) if (n, k) not in lost]
    sets, current, whole = UnitSets(tracks), [], []
    for number, track in units:
        place = sets.place(track)
        current = [number] if place is Place.FIRST else [*current, number]
        if place is Place.LAST:
            whole.append(current)
    kept = [n for n in range(12) if all((n, k) not in lost for k in range(tracks))]
    assert whole == [[number] * tracks for number in kept]
