"""Whose a splat is: the meshes tell, but not where two of them touch."""

import numpy as np

from benchmarks.evaluate.true_labels import between_two, parts_of, true_labels
from scenes.samples import sample_room
from scenes.splats import SplatCloud


def test_what_lies_under_a_book_is_as_near_to_the_book_as_to_the_desk():
    room = sample_room("desk")
    number, book = next((k, o) for k, o in enumerate(room.objects) if o.object_id == "book-1")
    height = book.box_m[2]
    points = book.world_from_object @ np.array(
        [[0.0, 0.0, height], [0.0, 0.0, -0.003], [0.02, 0.03, 0.0], [0.0, 0.0, height + 0.2]]
    )
    n = len(points)
    cloud = SplatCloud(
        points, np.full((n, 3), 0.01), np.eye(4)[:1].repeat(n, 0), np.ones(n), np.zeros((n, 1, 3))
    )
    np.testing.assert_array_equal(between_two(cloud, parts_of(room)), [False, True, True, False])
    labels = true_labels(cloud, room)
    assert (labels[0], labels[3]) == (number, -2)
