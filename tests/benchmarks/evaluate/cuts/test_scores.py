"""Figures of a cut: perfect, with a part missing, with a part of something else, refused."""

import numpy as np
import pytest

from benchmarks.evaluate.cuts.cutting import with_labels
from benchmarks.evaluate.cuts.scores import (
    TrueCut,
    box_error_cm,
    figures,
    foreign_share,
    missing_share,
)
from scenes.splats import SplatCloud

BOX = np.array([0.4, 0.4, 0.4])


@pytest.fixture
def perfect(cubes):
    from benchmarks.evaluate.cuts.truth import truth_of
    from scenes.render.native import NativeRenderer

    truth = truth_of(cubes, renderer=NativeRenderer())
    return TrueCut(
        truth.labels == 0,
        truth.by_mesh == 0,
        cubes.objects[0].triangles,
        truth.seen[0],
        BOX,
    )


def test_the_truth_itself_is_perfect(cubes, perfect):
    found = figures(perfect, with_labels(cubes.package, perfect.labels), room=cubes.package.room)
    assert (found.iou, found.missing, found.foreign, found.left) == (1.0, 0.0, 0.0, 0.0)
    assert np.isnan(found.box_cm)


def test_what_is_missing_is_a_share_of_the_surface_and_stays_in_the_room(cubes, perfect):
    low = cubes.package.room.means[:, 2] < 0.2
    found = figures(
        perfect, with_labels(cubes.package, perfect.labels & ~low), room=cubes.package.room
    )
    # Four of the five faces lose their lower half, but for what is within 2 cm of the rest.
    assert 0.28 < found.missing < 0.40
    assert 0.3 < found.left < 0.5
    assert found.foreign == 0.0


def test_a_piece_of_floor_is_foreign_but_for_what_touches(cubes, perfect):
    means = cubes.package.room.means
    floor = (np.abs(means[:, 0] + 0.6) < 0.5) & (np.abs(means[:, 1]) < 0.5) & (means[:, 2] < 0.01)
    found = figures(
        perfect, with_labels(cubes.package, perfect.labels | floor), room=cubes.package.room
    )
    assert found.foreign > 0.25
    assert found.taken > found.foreign
    assert found.missing == 0.0


def test_a_refused_cut_found_nothing(cubes, perfect):
    found = figures(perfect, None, room=cubes.package.room)
    assert (found.iou, found.missing, found.foreign, found.left) == (0.0, 1.0, 0.0, 1.0)
    assert found.box_cm == 40.0


def test_a_wide_splat_covers_what_it_paints_and_a_faint_one_nothing():
    def one(opacity):
        wide = np.array([[0.1, 0.1, 0.001]])
        return SplatCloud(
            np.zeros((1, 3)), wide, np.eye(4)[:1], np.array([opacity]), np.zeros((1, 1, 3))
        )

    points = np.array([[0.0, 0.0, 0.0], [0.15, 0.0, 0.0], [0.0, 0.0, 0.03], [0.5, 0.0, 0.0]])
    assert missing_share(points, one(0.9)) == 0.5
    assert missing_share(points, one(0.02)) == 1.0
    assert foreign_share(np.array([[[0, 0, 1.0], [1, 0, 1], [0, 1, 1]]]), one(0.9)) == 1.0


def test_a_box_may_have_its_sides_in_either_order():
    true = np.array([0.2, 0.5, 0.3])
    assert box_error_cm(true, (0.5, 0.2, 0.3)) == pytest.approx(0.0)
    assert box_error_cm(true, (0.5, 0.2, 0.34)) == pytest.approx(4.0)
