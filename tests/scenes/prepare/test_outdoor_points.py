import cv2
import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.mesh import TexturedMesh
from scenes.pose import Pose
from scenes.prepare.outdoor_points import with_outdoor_points
from scenes.prepare.reconstruction import Reconstruction, View

CAMERA = Pinhole.from_fov(288, 216, 1.2)


def wall(rng, speckled, corners):
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.float32)
    faces = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)
    return TexturedMesh(np.array(corners, dtype=np.float64), faces, uv, speckled(rng))


@pytest.fixture(scope="module")
def street(raycast, speckled, tmp_path_factory):
    """A speckled wall at y = 4 and floor at z = 0 under a blue sky, from the way towards it."""
    rng = np.random.default_rng(3)
    meshes = [
        (wall(rng, speckled, [(-4, 4, 0), (4, 4, 0), (4, 4, 2.2), (-4, 4, 2.2)]), Pose.identity()),
        (wall(rng, speckled, [(-4, -2, 0), (4, -2, 0), (4, 4, 0), (-4, 4, 0)]), Pose.identity()),
    ]
    folder = tmp_path_factory.mktemp("street")
    views = []
    for k in range(6):
        pose = look_at(
            np.array([0.1 * k - 0.3, 0.35 * k - 1.8, 1.5]), np.array([0.1 * k, 4.0, 1.3])
        )
        picture, depth, _ = raycast(meshes, CAMERA, pose, shade=False)
        picture[~(np.isfinite(depth) & (depth > 0))] = (90, 140, 220)
        path = folder / f"{k}.png"
        cv2.imwrite(str(path), picture[..., ::-1])
        views.append(View(path.name, path, CAMERA, pose))
    sparse = np.column_stack([rng.uniform(-2, 2, 40), np.full(40, 4.0), rng.uniform(0, 2, 40)])
    ground = np.column_stack([rng.uniform(-1, 1, 40), rng.uniform(1.5, 4, 40), np.zeros(40)])
    chimneys = np.column_stack([rng.uniform(-9, 9, 5), np.full(5, 30.0), rng.uniform(3, 6, 5)])
    points = np.concatenate([sparse, ground, chimneys])
    return Reconstruction(
        tuple(views),
        points,
        np.full((85, 3), 128, dtype=np.uint8),
        np.full(85, 0.3, dtype=np.float32),
    )


@pytest.fixture(scope="module")
def dense(street):
    return with_outdoor_points(street, 5000, held_out_every=0, rng=np.random.default_rng(0))


def test_new_points_lie_on_what_the_photos_show(street, dense):
    new = dense.points[len(street.points) :]
    near = new[np.linalg.norm(new, axis=1) < 8.0]
    off = np.minimum(np.abs(near[:, 1] - 4.0), np.abs(near[:, 2]))
    assert len(near) > 1000
    away = np.linalg.norm(near - street.views[-1].world_from_camera.translation, axis=1)
    assert np.quantile(off / away, 0.9) < 0.06


def test_the_sky_is_far_away_and_blue(street, dense):
    new = slice(len(street.points), None)
    far = np.linalg.norm(dense.points[new], axis=1) > 45.0
    assert far.sum() > 20
    assert (dense.points[new][far, 2] > 0).all()
    colours = dense.colours[new][far].astype(int)
    assert np.median(colours[:, 2] - colours[:, 0]) > 100


def test_sparse_points_come_first_and_the_limit_holds(street, dense):
    assert len(dense.points) <= 5000
    assert np.array_equal(dense.points[: len(street.points)], street.points)
    assert np.array_equal(dense.errors_px[: len(street.points)], street.errors_px)
    assert dense.views == street.views


def test_the_same_seed_gives_the_same_points(street, dense):
    again = with_outdoor_points(street, 5000, held_out_every=0, rng=np.random.default_rng(0))
    assert np.array_equal(again.points, dense.points)


def test_photos_without_points_are_left_as_they_are(street):
    bare = Reconstruction(
        street.views,
        np.zeros((0, 3)),
        np.zeros((0, 3), dtype=np.uint8),
        np.zeros(0, dtype=np.float32),
    )
    assert with_outdoor_points(bare, 5000, held_out_every=0, rng=np.random.default_rng(0)) is bare


def test_photos_from_the_side_are_left_to_stereo(street):
    """And the sky is the same from everywhere."""
    aside = tuple(
        View(v.name, v.image, v.camera, look_at(np.array([x, -1, 1.5]), np.array([x, 4, 1.4])))
        for v, x in zip(street.views, np.linspace(-1, 1, 6), strict=True)
    )
    room = Reconstruction(aside, street.points, street.colours, street.errors_px)
    found = with_outdoor_points(room, 5000, held_out_every=0, rng=np.random.default_rng(0))
    new = found.points[len(street.points) :]
    assert len(new)
    assert (np.linalg.norm(new, axis=1) > 45.0).all()


def test_views_kept_aside_have_no_say(street, tmp_path):
    spoilt = tmp_path / "noise.png"
    noise = np.random.default_rng(0).integers(0, 256, (216, 288, 3), dtype=np.uint8)
    cv2.imwrite(str(spoilt), noise)
    views = tuple(
        View(v.name, spoilt, v.camera, v.world_from_camera) if k % 3 == 2 else v
        for k, v in enumerate(street.views)
    )
    changed = Reconstruction(views, street.points, street.colours, street.errors_px)
    a, b = (
        with_outdoor_points(r, 5000, held_out_every=3, rng=np.random.default_rng(0))
        for r in (street, changed)
    )
    assert np.array_equal(a.points, b.points)


def test_the_blue_wall_of_a_room_is_no_sky(street):
    near = np.linalg.norm(street.points, axis=1) < 10
    room = Reconstruction(
        street.views, street.points[near], street.colours[near], street.errors_px[near]
    )
    found = with_outdoor_points(room, 5000, held_out_every=0, rng=np.random.default_rng(0))
    assert np.linalg.norm(found.points, axis=1).max() < 15
