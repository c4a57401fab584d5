"""Marks of a careful person: in which photos, and where."""

import numpy as np

from benchmarks.evaluate.cuts.marking import KEPT, WAYS, marks_of, prompted


def test_every_object_is_marked_in_three_photos_from_different_sides(cubes):
    marks = marks_of(cubes)
    assert set(marks) == {"red", "blue"}
    for own in marks.values():
        assert len({mark.photo for mark in own}) == 3
        for mark in own:
            left, top, right, bottom = mark.box_px
            x, y = mark.click_px
            assert left + 6 < x < right - 6
            assert top + 6 < y < bottom - 6


def test_the_click_is_on_the_object(cubes):
    for name, rgb in (("red", (1, 0, 0)), ("blue", (0, 0, 1))):
        (view,) = prompted(cubes, marks_of(cubes)[name], way="click")
        x, y = np.floor(view.prompt.inside_px[0]).astype(int)
        assert int(np.argmax(view.picture[y, x])) == int(np.argmax(rgb))
        assert view.prompt.box_px is None


def test_ways_mark_as_many_photos_as_they_say(cubes):
    own = marks_of(cubes)["red"]
    counts = {way: len(prompted(cubes, own, way=way)) for way in WAYS}
    assert counts == {"click": 1, "one_box": 1, "two_boxes": 2, "three_boxes": 3}


def test_marks_are_kept_beside_the_capture(cubes):
    first = marks_of(cubes)
    assert (cubes.folder / KEPT).is_file()
    assert marks_of(cubes) == first
