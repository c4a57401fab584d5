import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenes.cut import Cut, divide, restore

FIELDS = ("means", "scales", "rotations", "opacities", "sh")


def check_same(a, b):
    for field in FIELDS:
        np.testing.assert_array_equal(getattr(a, field), getattr(b, field))


@given(seed=st.integers(0, 2**32 - 1), cuts=st.integers(1, 4))
def test_cuts_are_a_partition_and_undo_restores_every_bit(random_cloud, seed, cuts):
    rng = np.random.default_rng(seed)
    rooms, done = [random_cloud(60, 1, 3)], []
    for number in range(cuts):
        room = rooms[-1]
        labels = rng.random(len(room)) < 0.2
        floaters = ~labels & (rng.random(len(room)) < 0.1)
        if not (labels | floaters).any():
            return
        fill = random_cloud(int(rng.integers(0, 5)), 1, 7)
        left, cut = divide(room, labels, object_id=f"o{number}", floaters=floaters, fill=fill)
        assert len(left) + len(cut.taken) - cut.filled == len(room)
        check_same(cut.taken.select(cut.is_object), room.select(labels))
        check_same(cut.taken.select(~cut.is_object), room.select(floaters))
        rooms.append(left)
        done.append(cut)
    for number in reversed(range(cuts)):
        check_same(restore(rooms[number + 1], done[number]), rooms[number])


def test_nothing_and_both_are_refused(random_cloud):
    room = random_cloud(5, 1, 1)
    none, every = np.zeros(5, dtype=bool), np.ones(5, dtype=bool)
    with pytest.raises(ValueError, match="nothing to cut"):
        divide(room, none, object_id="a", floaters=none)
    with pytest.raises(ValueError, match="5 splats are both"):
        divide(room, every, object_id="a", floaters=every)
    with pytest.raises(ValueError, match="labels: bool \\(4,\\), wanted bool \\(5,\\)"):
        divide(room, none[:4], object_id="a", floaters=none)


def test_a_cut_that_is_not_the_last_is_refused(random_cloud):
    room = random_cloud(6, 1, 1)
    cut = Cut("late", np.array([8]), room.select([0]), np.array([True]), 0)
    with pytest.raises(ValueError, match="undo later cuts first"):
        restore(room, cut)


@pytest.mark.parametrize("places", [[2, 1], [1, 1]])
def test_places_ascend(random_cloud, places):
    with pytest.raises(ValueError, match="not ascending"):
        Cut("x", np.array(places), random_cloud(2, 1, 1), np.ones(2, dtype=bool), 0)
