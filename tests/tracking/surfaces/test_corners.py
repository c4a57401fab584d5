import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenes.cameras import Fisheye, Rig
from scenes.pose import Pose
from scenes.render.renderer import Rendering
from scenes.splats import SplatCloud
from tracking.surfaces.corners import corners_from_clicks, plane_through

LENS = Fisheye.from_fov(300, np.pi)
RIG = Rig((LENS,), (Pose(np.eye(3), np.array([0.0, 0.1, 0.0])),))
WORLD_FROM_RIG = Pose.from_yaw(0.4, (0.5, 0.2, 1.0))
IN_LENS = np.array([[-0.5, -0.3, 1.0], [0.5, -0.3, 1.2], [0.5, 0.3, 1.2], [-0.5, 0.3, 1.0]])
NO_SPLATS = SplatCloud(
    means=np.zeros((0, 3), np.float32),
    scales=np.zeros((0, 3), np.float32),
    rotations=np.zeros((0, 4), np.float32),
    opacities=np.zeros(0, np.float32),
    sh=np.zeros((0, 1, 3), np.float32),
)


class Wall:
    """Draws the plane of `IN_LENS`, with scan noise and something else in front of a part of it."""

    def __init__(self, noise=0.0, others=0.0, alpha=1.0):
        self.noise, self.others, self.alpha = noise, others, alpha

    def render(self, objects, camera, world_from_camera, options=None):
        del objects, world_from_camera, options
        x, y = np.meshgrid(np.arange(camera.width_px) + 0.5, np.arange(camera.height_px) + 0.5)
        rays = camera.unproject(np.stack([x.ravel(), y.ravel()], axis=1))
        normal = np.cross(IN_LENS[1] - IN_LENS[0], IN_LENS[3] - IN_LENS[0])
        depth = (normal @ IN_LENS[0]) / (rays @ normal)
        rng = np.random.default_rng(3)
        depth = depth * (1 + self.noise * rng.normal(size=len(depth)))
        depth = np.where(rng.random(len(depth)) < self.others, 0.5 * depth, depth)
        shape = (camera.height_px, camera.width_px)
        alpha = np.full(shape, self.alpha, np.float32)
        rgb = np.zeros((*shape, 3), np.float32)
        return Rendering(rgb=rgb, depth=depth.reshape(shape).astype(np.float32), alpha=alpha)


def clicks():
    return LENS.project(IN_LENS)[0]


@pytest.mark.parametrize(
    ("wall", "limit_m"), [(Wall(), 1e-5), (Wall(noise=0.01), 3e-3), (Wall(0.005, others=0.3), 5e-3)]
)
def test_clicks_become_the_corners_of_what_is_drawn_there(wall, limit_m):
    corners = corners_from_clicks(clicks(), 0, RIG, WORLD_FROM_RIG, NO_SPLATS, wall)
    want = WORLD_FROM_RIG @ (RIG.rig_from_lens[0] @ IN_LENS)
    assert np.linalg.norm(corners - want, axis=1).max() < limit_m


def test_clicks_the_other_way_round_are_turned_about():
    args = (0, RIG, WORLD_FROM_RIG, NO_SPLATS, Wall())
    turned = corners_from_clicks(clicks()[[0, 3, 2, 1]], *args)
    np.testing.assert_allclose(turned, corners_from_clicks(clicks(), *args))


@pytest.mark.parametrize(
    ("clicked", "wall", "message"),
    [
        (clicks()[:3], Wall(), "four"),
        (clicks()[[0, 2, 1, 3]], Wall(), "no convex quad"),
        (clicks() * 0 + [[1, 1], [299, 1], [299, 299], [1, 299]], Wall(), "from the lens's centre"),
        (clicks(), Wall(alpha=0.2), "the scan shows something on 0 of"),
    ],
)
def test_what_is_no_surface_is_refused(clicked, wall, message):
    with pytest.raises(ValueError, match=message):
        corners_from_clicks(clicked, 0, RIG, WORLD_FROM_RIG, NO_SPLATS, wall)


@given(
    plane=st.tuples(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.floats(0.2, 2.0)),
    others=st.floats(0, 0.35),
)
def test_a_plane_is_found_although_a_third_of_the_points_are_elsewhere(plane, others):
    rng = np.random.default_rng(11)
    rays = np.concatenate([rng.uniform(-0.4, 0.4, (400, 2)), np.ones((400, 1))], axis=1)
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    range_m = 1.0 / (rays @ np.array(plane))
    elsewhere = rng.random(400) < others
    range_m = np.where(elsewhere, range_m * rng.uniform(0.4, 0.8, 400), range_m)
    found = plane_through(rays, range_m)
    np.testing.assert_allclose(rays @ found, rays @ np.array(plane), rtol=2e-3)
