import math
from dataclasses import replace

import cv2
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from scenes.cameras import Fisheye, Rig
from scenes.mesh import TexturedMesh
from scenes.pose import Pose, rotation_from_vector
from scenes.quad import quad_of
from tracking.surfaces.view import native_size_px, surface_view

BACK = Pose(np.diag([-1.0, 1.0, -1.0]), np.array([0.0, 0.0, -0.03]))
LENS = Fisheye.from_fov(720, math.radians(200))
RIG = Rig((LENS, LENS), (Pose.identity(), BACK))
POSTER = np.array([[-0.6, -0.5, 1.5], [0.6, -0.5, 1.5], [0.6, 0.3, 1.5], [-0.6, 0.3, 1.5]])


def board(corners, texture):
    uv = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)
    faces = np.array([[0, 2, 1], [0, 3, 2]], np.int32)
    return TexturedMesh(corners, faces, uv, texture)


def artwork(size):
    """Blots of many sizes: every place looks different, and no edge is sharper than a pixel."""
    rng = np.random.default_rng(7)
    picture = sum(
        cv2.resize(rng.normal(size=(n, n, 3)), size, interpolation=cv2.INTER_CUBIC) / math.sqrt(n)
        for n in (3, 6, 12)
    )
    return np.clip(128 + 100 * np.asarray(picture), 0, 255).astype(np.uint8)


def test_a_poster_in_a_fisheye_picture_comes_out_as_its_artwork(raycast):
    world_from_rig = Pose(rotation_from_vector(np.array([0.1, 0.2, 0.3])), np.array([0.1, 0, 0.2]))
    quad = quad_of(POSTER)
    size = native_size_px(quad, RIG, world_from_rig)
    art = artwork((4 * size[0], 4 * size[1]))
    rgb, _, _ = raycast([(board(POSTER, art), Pose.identity())], LENS, world_from_rig, shade=False)
    black = np.zeros_like(rgb)
    got = surface_view(quad, RIG, world_from_rig, size).picture((rgb, black))
    want = cv2.resize(art, size, interpolation=cv2.INTER_AREA)
    inner = (slice(3, -3), slice(3, -3))
    apart = got[inner].astype(float) - want[inner]
    assert np.abs(apart).mean() < 2.0
    # A quarter of a pixel to any side fits worse: the picture is where it should be.
    for dx, dy in ((0.25, 0), (-0.25, 0), (0, 0.25), (0, -0.25)):
        shifted = cv2.warpAffine(want, np.array([[1, 0, dx], [0, 1, dy]]), size)
        assert np.abs(got[inner].astype(float) - shifted[inner]).mean() > np.abs(apart).mean()


def test_tables_between_projected_places_are_right_to_a_twentieth_of_a_pixel():
    quad = quad_of(POSTER + np.array([0.9, 0.2, -0.9]))
    size = native_size_px(quad, RIG, Pose.identity())
    table = surface_view(quad, RIG, Pose.identity(), size).tables[0]
    y, x = np.mgrid[0 : size[1], 0 : size[0]] + 0.5
    points, _ = quad.points(np.stack([x.ravel() / size[0], y.ravel() / size[1]], axis=1))
    pixels, _ = RIG.lenses[table.lens].project(RIG.rig_from_lens[table.lens].inverse() @ points)
    assert np.abs(table.map_xy.reshape(-1, 2) + 0.5 - pixels).max() < 0.05
    away = np.linalg.norm(points - RIG.rig_from_lens[table.lens].translation, axis=1)
    np.testing.assert_allclose(table.range_m.ravel(), away, atol=2e-3)


def test_the_lens_that_sees_a_surface_best_is_taken():
    ahead = surface_view(quad_of(POSTER), RIG, Pose.identity(), (60, 40))
    behind = quad_of(POSTER * [-1, 1, -1])
    assert [table.lens for table in ahead.tables] == [0]
    assert [t.lens for t in surface_view(behind, RIG, Pose.identity(), (60, 40)).tables] == [1]
    # From behind nobody sees anything.
    unseen = surface_view(quad_of(POSTER[[1, 0, 3, 2]]), RIG, Pose.identity(), (60, 40))
    assert unseen.tables == ()
    assert not unseen.seen.any()
    assert unseen.picture((np.zeros((720, 720, 3), np.uint8),) * 2).shape == (40, 60, 3)


def test_a_surface_across_the_seam_is_put_together_from_both_lenses(raycast):
    # A long board beside the camera, half ahead and half behind.
    corners = np.array([[1.0, -0.4, 0.9], [1, -0.4, -1.1], [1, 0.4, -1.1], [1, 0.4, 0.9]])
    quad, art = quad_of(corners), artwork((800, 320))
    size = (200, 80)
    narrow = replace(LENS, max_angle=math.radians(92))
    rig = Rig((narrow, narrow), RIG.rig_from_lens)
    images = tuple(
        raycast([(board(corners, art), Pose.identity())], narrow, pose, shade=False)[0]
        for pose in rig.rig_from_lens
    )
    view = surface_view(quad, rig, Pose.identity(), size)
    assert len(view.tables) == 2
    assert view.seen.all()
    want = cv2.resize(art, size, interpolation=cv2.INTER_AREA)
    apart = np.abs(view.picture(images)[2:-2, 2:-2].astype(float) - want[2:-2, 2:-2])
    assert apart.mean() < 2.5
    assert np.median(apart, axis=(0, 2)).max() < 8.0  # no column is off: there is no seam


@given(nearer=st.floats(1.0, 3.0))
def test_native_size_grows_as_the_camera_comes_nearer(nearer):
    quad = quad_of(POSTER)
    width, height = native_size_px(quad, RIG, Pose.identity())
    close = Pose(np.eye(3), np.array([0, 0, 1.5 - 1.5 / nearer]))
    wider, higher = native_size_px(quad, RIG, close)
    assert wider >= width
    assert higher >= height
    assert native_size_px(quad_of(POSTER[[1, 0, 3, 2]]), RIG, close) == (480, 320)
