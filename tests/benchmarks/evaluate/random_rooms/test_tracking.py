"""Twins that changed their names are held against whichever they stand at."""

from benchmarks.evaluate.random_rooms.tracking import who_is_who
from scenes.pose import Pose


def at(x):
    return Pose.from_yaw(0.0, (x, 0.0, 0.0))


def test_twins_that_swapped_names_are_matched_by_where_they_stand():
    true = {"mug-1": at(0.0), "mug-2": at(1.0)}
    reported = {"mug-1": at(1.01), "mug-2": at(0.02)}
    assert who_is_who(("mug-1", "mug-2"), reported, true) == {"mug-1": "mug-2", "mug-2": "mug-1"}


def test_where_it_makes_no_difference_names_stay():
    true = {"mug-1": at(0.0), "mug-2": at(1.0)}
    reported = {"mug-1": at(0.5), "mug-2": at(0.5)}
    assert who_is_who(("mug-1", "mug-2"), reported, true) == {"mug-1": "mug-1", "mug-2": "mug-2"}


def test_what_was_not_reported_has_no_track():
    true = {"mug-1": at(0.0), "mug-2": at(1.0)}
    assert who_is_who(("mug-1", "mug-2"), {"mug-2": at(1.0)}, true) == {"mug-2": "mug-2"}
    assert who_is_who(("mug-1",), {}, true) == {}
