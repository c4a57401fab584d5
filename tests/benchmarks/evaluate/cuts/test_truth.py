"""The truth of a capture: each splat's owner, and the surface that photos saw."""

from dataclasses import replace

import numpy as np

from benchmarks.evaluate.cuts.truth import KEPT, surface_points, truth_of
from scenes.render.native import NativeRenderer
from scenes.splats import SplatCloud, concatenate


def test_every_splat_has_its_owner_and_the_side_that_no_photo_shows_is_left_out(cubes):
    truth = truth_of(cubes, renderer=NativeRenderer())
    means = cubes.package.room.means
    assert set(np.unique(truth.labels)) == {-1, 0, 1}
    assert (means[truth.labels == 0, 0] < -0.35).all()
    assert (means[truth.labels == 1, 0] > 0.35).all()
    assert (means[truth.labels >= 0, 2] > -0.01).all()
    # Photos are taken from all around and above: all five faces are seen.
    assert (truth.seen_share > 0.99).all()


def test_a_splat_that_is_near_to_nothing_is_whose_pixels_it_paints(cubes, tmp_path):
    # A blot of the red cube's colour before its face, and one high above the floor.
    blots = np.array([[-0.6, -0.27, 0.2], [0.0, 1.0, 1.0]])
    room = cubes.package.room
    extra = SplatCloud(
        blots,
        np.full((2, 3), 0.02),
        np.eye(4)[:1].repeat(2, axis=0),
        np.full(2, 0.9),
        np.zeros((2, 1, 3)),
    )
    package = replace(cubes.package, room=concatenate([room, extra]))
    truth = truth_of(replace(cubes, folder=tmp_path, package=package), renderer=NativeRenderer())
    assert truth.by_mesh[-2:].tolist() == [-2, -2]
    assert truth.labels[-2:].tolist() == [0, -1]


def test_it_is_kept_beside_the_capture(cubes):
    first = truth_of(cubes, renderer=NativeRenderer())
    assert (cubes.folder / KEPT).is_file()
    again = truth_of(cubes, renderer=NativeRenderer())
    np.testing.assert_array_equal(first.labels, again.labels)
    for a, b in zip(first.seen, again.seen, strict=True):
        np.testing.assert_array_equal(a, b)


def test_points_are_spread_by_area():
    large = np.array([[0, 0, 0], [2, 0, 0], [0, 2, 0]], float)
    small = large * 0.5 + (5, 0, 0)
    points = surface_points(np.stack([large, small]), np.random.default_rng(0))
    assert (points[:, 0] < 3).mean() == np.clip((points[:, 0] < 3).mean(), 0.79, 0.81)
