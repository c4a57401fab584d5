"""Points from depth."""

import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.pose import Pose
from scenes.prepare.train.depth.seen_surfaces import Surface
from scenes.prepare.train.seed import dense_points

CAMERA = Pinhole.from_fov(80, 60, 1.2)
SHAPE = (CAMERA.height_px, CAMERA.width_px)


def wall(x, depth=2.0, is_seen=True):
    return Surface(
        f"at {x}",
        CAMERA,
        Pose.from_quaternion((1, 0, 0, 0), (x, 0.0, 0.0)),
        np.full((*SHAPE, 3), (200, 100, 50), np.uint8),
        np.full(SHAPE, depth, np.float32),
        np.full(SHAPE, is_seen),
        np.zeros(SHAPE, np.bool_),
    )


def test_a_wall_becomes_points_on_it():
    found = dense_points([wall(x) for x in (-0.2, 0.0, 0.2)], 0.2)
    np.testing.assert_allclose(found.points[:, 2], 2.0, atol=1e-6)
    np.testing.assert_array_equal(found.colours, np.tile([200, 100, 50], (len(found.points), 1)))
    # The part that is seen measures 3.1 m by 2.1 m; cells at its rim count as well.
    assert len(found.points) == pytest.approx(3.3 * 2.3 / 0.2**2, rel=0.2)


def test_what_others_see_through_makes_no_points():
    found = dense_points([wall(-0.2), wall(0.0), wall(0.2), wall(0.1, depth=1.0)], 0.2)
    in_the_middle = found.points[(np.abs(found.points[:, :2]) < 0.4).all(axis=1)]
    assert (in_the_middle[:, 2] > 1.5).all()


def test_filled_depth_makes_no_points():
    assert len(dense_points([wall(x, is_seen=False) for x in (-0.2, 0.2)], 0.2).points) == 0
