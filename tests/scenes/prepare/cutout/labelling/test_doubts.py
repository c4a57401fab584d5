"""Boxes that hold nothing, half of an object, or two; and an object that one photo shows."""

import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.prepare.cutout.labelling.doubts import (
    Boxed,
    Labelled,
    doubts,
    require_meeting,
    require_object,
    something_else,
)
from scenes.prepare.cutout.labelling.surface_cells import SurfaceCells, links_between

CAMERA = Pinhole(200, 200, 200.0, 200.0, 100.0, 100.0)
FROM_ABOVE = look_at(np.array([0.0, -0.01, 2.0]), np.zeros(3))
SIDE_M = 0.01


def boxed(name="a.jpg", low=(-0.1, -0.1), high=(0.1, 0.1)):
    """A box around a rectangle of the floor, seen from two metres above."""
    corners = np.array([[*low, 0.0], [*high, 0.0]])
    pixels, _ = CAMERA.project(FROM_ABOVE.inverse() @ corners)
    box = (*pixels.min(axis=0), *pixels.max(axis=0))
    return Boxed(name, CAMERA, FROM_ABOVE, box, 0.02)


def sheet(seen_by=9):
    """Cells of a square metre of floor."""
    x, y = np.meshgrid(np.arange(-0.5, 0.5, SIDE_M), np.arange(-0.5, 0.5, SIDE_M))
    places = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    normals = np.tile([0.0, 0.0, 1.0], (len(places), 1))
    grey = np.full((len(places), 3), 0.5)
    return SurfaceCells(places, normals, grey, np.full(len(places), seen_by), SIDE_M)


def within(cells, low, high):
    return ((cells.places[:, :2] > low) & (cells.places[:, :2] < high)).all(axis=1)


def labelled(cells, labels, *, box, held=None, flat=0.0, openness=0.0):
    held = labels if held is None else held
    share = np.full(len(cells), flat)
    inside = box.holds(cells.places)
    sure = np.zeros_like(inside)
    return Labelled(labels, held, share, inside, sure, openness, links_between(cells))


def test_an_object_that_fills_its_box_gives_no_doubt():
    cells, box = sheet(), boxed()
    found = labelled(cells, within(cells, (-0.09, -0.09), (0.09, 0.09)), box=box)
    require_object(cells, found, boxed=[box])
    assert doubts(cells, found, boxed=[box], other=something_else(cells, found)) == ()


def test_scraps_in_a_box_are_no_object():
    cells, box = sheet(), boxed()
    found = labelled(cells, within(cells, (0.0, 0.0), (0.03, 0.03)), box=box)
    with pytest.raises(ValueError, match=r"there is no object in the box in a\.jpg"):
        require_object(cells, found, boxed=[box])


def test_a_piece_of_a_table_is_no_object_and_the_edge_it_leaves_by_is_named():
    cells, box = sheet(), boxed()
    labels = within(cells, (-0.05, -0.05), (0.2, 0.05)) & box.holds(cells.places)
    found = labelled(cells, labels, box=box, flat=0.9, openness=0.3)
    with pytest.raises(ValueError, match=r"lies flat and goes on beyond the right edge of the box"):
        require_object(cells, found, boxed=[box])


def test_half_of_an_object_is_told_with_the_edge_that_cuts_it():
    cells, box = sheet(), boxed()
    labels = within(cells, (-0.2, -0.05), (0.08, 0.05)) & box.holds(cells.places)
    found = labelled(cells, labels, box=box, openness=0.3)
    require_object(cells, found, boxed=[box])
    (note,) = doubts(cells, found, boxed=[box], other=None)
    assert note.startswith("it goes on beyond the left edge of the box in a.jpg")


def test_an_empty_part_of_the_box_is_told():
    cells, box = sheet(), boxed()
    found = labelled(cells, within(cells, (-0.09, 0.0), (0.09, 0.09)), box=box)
    (note,) = doubts(cells, found, boxed=[box], other=None)
    assert "the lower 5" in note
    assert "a part may be missing" in note


def test_another_object_in_the_box_is_told_with_its_place():
    cells, box = sheet(), boxed()
    own = within(cells, (-0.09, -0.09), (0.035, 0.09))
    second = within(cells, (0.055, -0.09), (0.095, 0.09))
    found = labelled(cells, own, box=box, held=own | second)
    other = something_else(cells, found)
    (note,) = doubts(cells, found, boxed=[box], other=other)
    assert note.startswith("something else is in the box in a.jpg, around 107, ")
    scrap = within(cells, (0.08, 0.08), (0.095, 0.095))
    assert something_else(cells, labelled(cells, own, box=box, held=own | scrap)) is None


@pytest.mark.parametrize(
    ("photos", "words"), [(1, "only one photo shows it"), (2, "only 2 photos")]
)
def test_few_photos_are_told(photos, words):
    cells, box = sheet(photos), boxed()
    found = labelled(cells, within(cells, (-0.09, -0.09), (0.09, 0.09)), box=box)
    (note,) = doubts(cells, found, boxed=[box], other=None)
    assert note.startswith(words)


def test_boxes_around_different_places_are_told_with_how_far_apart_they_are():
    first, second = boxed("a.jpg"), boxed("b.jpg", (0.3, -0.1), (0.5, 0.1))
    points = [np.array([[0.0, 0.0, 0.0]]), np.array([[0.4, 0.0, 0.0]])]
    with pytest.raises(ValueError, match=r"a\.jpg and b\.jpg .* 0\.40 m apart.* if it was moved"):
        require_meeting(points, [first, second])
    with pytest.raises(ValueError, match=r"nothing is drawn inside the box in b\.jpg"):
        require_meeting([points[0], np.zeros((0, 3))], [first, second])
    near = np.array([[0.01, 0.0, 0.0]])
    assert len(require_meeting([points[0], near], [first, first])) == 2
