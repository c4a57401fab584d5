import cv2
import numpy as np
import pytest

from scenes.cameras import Pinhole, pixel_centres
from scenes.frames import look_at
from scenes.mesh import TexturedMesh
from scenes.pose import Pose
from scenes.prepare.plane_sweep import looks_of, partners_of, swept, ways_of
from scenes.prepare.reconstruction import Reconstruction, View

CAMERA = Pinhole.from_fov(240, 180, 1.2)
STEP_M = 0.8


def quad(texture, corners):
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.float32)
    faces = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)
    return TexturedMesh(np.array(corners, dtype=np.float64), faces, uv, texture)


@pytest.fixture(scope="module")
def passage(raycast, speckled, tmp_path_factory):
    """A way between walls at x = ±2, walked along; each photo's true z."""
    rng = np.random.default_rng(5)
    sides = [[(x, 0, 0), (x, 14, 0), (x, 14, 3), (x, 0, 3)] for x in (-2.0, 2.0)]
    ground = [(-2, 0, 0), (2, 0, 0), (2, 14, 0), (-2, 14, 0)]
    end = [(-2, 14, 0), (2, 14, 0), (2, 14, 3), (-2, 14, 3)]
    quads = [*sides, ground, end]
    meshes = [(quad(speckled(rng), corners), Pose.identity()) for corners in quads]
    folder = tmp_path_factory.mktemp("passage")
    views, truth = [], []
    for k in range(5):
        y = 0.5 + STEP_M * k
        pose = look_at(np.array([0.1 * (-1) ** k, y, 1.5]), np.array([0.0, 14.0, 1.2]))
        picture, away, _ = raycast(meshes, CAMERA, pose, shade=False)
        path = folder / f"{k}.png"
        cv2.imwrite(str(path), picture[..., ::-1])
        views.append(View(path.name, path, CAMERA, pose))
        truth.append(away * CAMERA.unproject(pixel_centres(CAMERA))[:, 2].reshape(away.shape))
    points = []
    for corners in quads:
        a, b, _, d = np.array(corners, dtype=np.float64)
        s, t = rng.uniform(0, 1, (2, 80, 1))
        points.append(a + s * (b - a) + t * (d - a))
    points = np.concatenate(points)
    colours = np.full((len(points), 3), 128, dtype=np.uint8)
    errors = np.full(len(points), 0.3, dtype=np.float32)
    return Reconstruction(tuple(views), points, colours, errors), truth


@pytest.fixture(scope="module")
def looks(passage):
    metric, _ = passage
    return looks_of(metric, metric.views, 240)


def test_walls_and_ground_that_are_passed_have_their_distance(passage, looks):
    metric, truth = passage
    partners = partners_of(looks, metric.points)
    inverse = swept(looks[2], [looks[k] for k in partners[2]], ways_of(looks)[2])
    seen = inverse > 0
    near = (truth[2] > 0) & (truth[2] < 9.0)
    passed = seen & near
    off = inverse[passed] * truth[2][passed] - 1
    assert passed.sum() > 0.8 * near.sum()
    assert np.abs(np.median(off)) < 0.005
    assert np.quantile(np.abs(off), 0.8) < 0.05


def test_what_no_partner_shows_has_no_distance(looks):
    assert not swept(looks[2], [], ways_of(looks)[2]).any()


def test_a_photo_that_shows_everything_twice_as_large_is_no_partner(passage, looks):
    """It would be the better one by the angle under which things are seen."""
    metric, _ = passage
    end = metric.points[np.abs(metric.points[:, 1] - 14.0) < 1e-9]
    colours, errors = np.zeros((len(end), 3), np.uint8), np.zeros(len(end), np.float32)
    pose = look_at(np.array([1.5, 9.0, 1.5]), np.array([0.0, 14.0, 1.2]))
    close_up = View("near", metric.views[0].image, CAMERA, pose)
    near = looks_of(Reconstruction(metric.views, end, colours, errors), (close_up,), 240)
    assert len(near) == 1
    chosen = partners_of([*looks, *near], end)
    assert all(len(looks) not in partners for partners in chosen[:-1])
    assert chosen[-1] == []


def test_the_way_is_that_of_several_photos(looks):
    ways = ways_of(looks)
    assert np.allclose(np.linalg.norm(ways, axis=1), 1)
    assert (np.abs(ways[:, 1]) > 0.98).all()
