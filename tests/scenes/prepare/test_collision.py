import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.pose import quaternion_from_rotation
from scenes.prepare.collision import mesh_of_splats, typical_depth
from scenes.render.native import NativeRenderer
from scenes.splats import SplatCloud, concatenate

CAMERA = Pinhole(320, 240, 240.0, 240.0, 160.0, 120.0)


def patch(corner, u, v, step=0.03):
    """Flat grey splats over a rectangle."""
    corner, u, v = (np.asarray(x, dtype=np.float64) for x in (corner, u, v))
    across, along = (int(np.linalg.norm(x) / step) for x in (u, v))
    s, t = np.meshgrid((np.arange(across) + 0.5) / across, (np.arange(along) + 0.5) / along)
    means = corner + s.reshape(-1, 1) * u + t.reshape(-1, 1) * v
    axes = np.stack([u / np.linalg.norm(u), v / np.linalg.norm(v)], axis=1)
    rotation = np.column_stack([axes, np.cross(axes[:, 0], axes[:, 1])])
    n = len(means)
    return SplatCloud(
        means,
        np.tile([step * 0.7, step * 0.7, 0.001], (n, 1)),
        np.tile(quaternion_from_rotation(rotation), (n, 1)),
        np.full(n, 0.95),
        np.zeros((n, 1, 3)),
    )


@pytest.fixture(scope="module")
def corner():
    """A floor and two walls of 2 m that meet at the origin, with a step on the floor."""
    return concatenate(
        [
            patch((0, 0, 0), (2, 0, 0), (0, 2, 0)),
            patch((0, 0, 0), (0, 2, 0), (0, 0, 2)),
            patch((0, 0, 0), (0, 0, 2), (2, 0, 0)),
            patch((0.8, 0.6, 0.4), (0.6, 0, 0), (0, 0.5, 0)),
        ]
    )


@pytest.fixture(scope="module")
def mesh(corner):
    eyes = [(2.4, 1.4, 1.2), (1.4, 2.4, 1.5), (2.2, 2.2, 1.8), (1.8, 1.2, 2.2)]
    views = [(CAMERA, look_at(np.array(eye), np.array([0.4, 0.4, 0.5]))) for eye in eyes]
    return mesh_of_splats(corner, views, renderer=NativeRenderer())


def test_surfaces_are_where_the_splats_are(mesh):
    on_planes = np.abs(mesh.vertices).min(axis=1)
    on_step = np.abs(mesh.vertices - (1.1, 0.85, 0.4))
    is_step = (on_step < (0.36, 0.31, 0.03)).all(axis=1)
    assert is_step.sum() > 100
    assert np.percentile(on_planes[~is_step], 90) < 0.012
    assert np.median(on_step[is_step, 2]) < 0.012


def test_faces_look_to_the_free_side(mesh):
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    floor = (a[:, 2] < 0.02) & (a[:, 0] > 0.2) & (a[:, 1] > 0.2)
    assert (normals[floor, 2] > 0).mean() > 0.98


def test_nothing_seen(corner):
    away = look_at(np.array([5.0, 5.0, 1.0]), np.array([9.0, 9.0, 1.0]))
    with pytest.raises(ValueError, match="no surface"):
        mesh_of_splats(corner, [(CAMERA, away)], renderer=NativeRenderer())


def test_the_sky_does_not_coarsen_the_ground():
    rng = np.random.default_rng(0)
    ground = rng.uniform(2.0, 12.0, (60, 80)).astype(np.float32)
    street = ground.copy()
    street[:25] = 590.0
    street[25:27] = 0.0
    assert typical_depth(street) == pytest.approx(float(np.median(ground)), rel=0.1)
    assert typical_depth(ground) == float(np.median(ground))
