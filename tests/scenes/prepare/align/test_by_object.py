"""A thing of known size, boxed in a few photos, tells how large the room is."""

import numpy as np
import pytest

from scenes.pose import Pose
from scenes.prepare.align.by_object import align_by_object, box_corners, spanning_points
from scenes.prepare.options import KnownObject
from scenes.splats import SplatCloud
from scenes.state import ObjectModel
from tests.scenes.prepare.align.printed import capture

CRATE = (0.5, 0.3, 0.4)
THERE = Pose.from_yaw(0.7, (2.3, 0.8, 1.1))


@pytest.fixture(scope="module")
def room():
    reconstruction, _, truth = capture(np.random.default_rng(0), codes={}, feature_px=0.2)
    return reconstruction, truth


def boxes_of(points_m, room, *, photos=3, noise_px=0.0):
    """Boxes around a thing that stands `THERE`, in photos that show it whole, far apart."""
    reconstruction, truth = room
    there = truth.inverse() @ (THERE @ points_m)
    rng = np.random.default_rng(3)
    found = {}
    for view in reconstruction.views:
        pixels, valid = view.camera.project(view.world_from_camera.inverse() @ there)
        low, high = pixels.min(axis=0), pixels.max(axis=0)
        inside = (low > 0).all() and (high < (view.camera.width_px, view.camera.height_px)).all()
        if valid.all() and inside:
            edges = np.concatenate([low, high]) + rng.normal(0, noise_px, 4)
            found[view.name] = tuple(float(edge) for edge in edges)
    names = list(found)
    chosen = np.linspace(0, len(names) - 1, photos).round().astype(int)
    return {names[k]: found[names[k]] for k in chosen}


def aligned(room, points_m, boxes_px):
    return align_by_object(room[0], KnownObject(points_m, boxes_px), rng=np.random.default_rng(0))


def test_exact_boxes_give_the_exact_scale(room):
    points = box_corners(CRATE)
    alignment = aligned(room, points, boxes_of(points, room))
    assert alignment.metres_per_unit()[0] == pytest.approx(room[1].scale, rel=3e-3)
    assert alignment.anchors == ()
    at = alignment.world_from_reconstruction @ (room[1].inverse() @ THERE.translation)
    assert at[:2] == pytest.approx([0, 0], abs=0.12)
    assert at[2] == pytest.approx(1.1, abs=0.02)


def test_boxes_drawn_by_hand_are_off_by_no_more_than_is_said(room):
    points = box_corners(CRATE)
    alignment = aligned(room, points, boxes_of(points, room, photos=4, noise_px=2.0))
    scale, sigma = alignment.metres_per_unit()
    assert abs(scale - room[1].scale) < 3 * sigma
    assert sigma < 0.03 * scale


def test_a_thing_that_is_no_box_is_known_by_its_splats(room):
    rng = np.random.default_rng(4)
    ring = rng.normal(size=(400, 2))
    ring *= 0.15 / np.linalg.norm(ring, axis=1, keepdims=True)
    means = np.column_stack([ring, rng.uniform(0, 0.5, 400)]).astype(np.float32)
    cloud = SplatCloud(
        means, np.full((400, 3), 0.004), np.tile([1.0, 0, 0, 0], (400, 1)), np.full(400, 0.9),
        np.zeros((400, 1, 3)),
    )  # fmt: skip
    item = ObjectModel("bin", "Bin", "", cloud, (0.3, 0.3, 0.5), 0.0, Pose.identity())
    points = spanning_points(item)
    assert np.ptp(points, axis=0) == pytest.approx([0.312, 0.312, 0.512], abs=0.01)
    boxes = boxes_of(means.astype(float), room)
    scale = aligned(room, points, boxes).metres_per_unit()[0]
    assert scale == pytest.approx(room[1].scale, rel=0.03)
    # The corners of its box would reach farther across than it does.
    with pytest.raises(ValueError, match="outline misses the boxes"):
        aligned(room, box_corners((0.3, 0.3, 0.5)), boxes)


def test_a_scale_that_is_hardly_known_is_told(room):
    points = box_corners(CRATE)
    good = aligned(room, points, boxes_of(points, room, photos=4))
    poor = aligned(room, points, boxes_of(points, room, photos=2, noise_px=5.0))
    assert poor.metres_per_unit()[1] > 0.03 * poor.metres_per_unit()[0]
    assert "only known to" in poor.warnings[0]
    assert not good.warnings


def test_boxes_around_something_else_are_refused(room):
    boxes = boxes_of(box_corners(CRATE), room)
    with pytest.raises(ValueError, match="outline misses the boxes"):
        aligned(room, box_corners((0.1, 0.1, 1.5)), boxes)


def test_one_photo_or_an_unknown_one_is_refused(room):
    boxes = boxes_of(box_corners(CRATE), room)
    one = dict(list(boxes.items())[:1])
    with pytest.raises(ValueError, match="two photos or more"):
        aligned(room, box_corners(CRATE), one)
    with pytest.raises(ValueError, match=r"unknown: no\.jpg"):
        aligned(room, box_corners(CRATE), {**boxes, "no.jpg": (1, 2, 3, 4)})


def test_a_haze_is_no_known_object():
    cloud = SplatCloud(
        np.zeros((50, 3)), np.full((50, 3), 0.1), np.tile([1.0, 0, 0, 0], (50, 1)),
        np.full(50, 0.1), np.zeros((50, 1, 3)),
    )  # fmt: skip
    item = ObjectModel("h", "h", "", cloud, (1, 1, 1), 0.0, Pose.identity())
    with pytest.raises(ValueError, match="0 solid splats"):
        spanning_points(item)
