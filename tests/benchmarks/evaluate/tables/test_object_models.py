"""Scanned objects against physical ones: balls of flat splats beside a ball of triangles."""

from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

from benchmarks.evaluate.tables.object_models import compared, views_around
from scenes.render.native import NativeRenderer
from scenes.splats import SplatCloud

RADIUS_M, MIDDLE = 0.2, np.array([0.0, 0.0, 0.3])
BALL = trimesh.creation.icosphere(subdivisions=4, radius=RADIUS_M)
ITEM = SimpleNamespace(meshes=[SimpleNamespace(vertices=BALL.vertices + MIDDLE, faces=BALL.faces)])


def similarity_of(size):
    """Of a ball whose splats lie so many times as far from its middle as they should."""
    x, y, z = BALL.vertices.T / RADIUS_M
    lying = np.stack([1.0 + z + 1e-9, -y, x, np.zeros_like(x)], axis=1)
    lying /= np.linalg.norm(lying, axis=1, keepdims=True)
    count = len(lying)
    cloud = SplatCloud(
        means=(MIDDLE + size * BALL.vertices).astype(np.float32),
        scales=np.tile(np.array([0.014, 0.014, 0.0005], np.float32), (count, 1)),
        rotations=lying.astype(np.float32),
        opacities=np.full(count, 1.0, np.float32),
        sh=np.zeros((count, 1, 3), np.float32),
    )
    source = SimpleNamespace(splats=cloud)
    model = SimpleNamespace(source=source, centre_m=MIDDLE, radius_m=1.1 * RADIUS_M)
    return compared(model, ITEM, NativeRenderer(), views=views_around(model)[::5])


@pytest.fixture(scope="module")
def right():
    return similarity_of(1.0)


def test_what_is_as_it_should_be_is_found_so(right):
    assert 0.0 <= right.scale < 0.03
    assert abs(right.surface_m) < 0.008
    assert right.elsewhere < 0.2


@pytest.mark.parametrize("size", [0.96, 1.05])
def test_a_size_that_is_off_is_told(right, size):
    off = similarity_of(size)
    assert off.scale - right.scale == pytest.approx(size - 1.0, abs=0.003)
    assert off.surface_m - right.surface_m == pytest.approx((size - 1.0) * RADIUS_M, abs=0.002)
    assert off.outline_m - right.outline_m == pytest.approx((size - 1.0) * RADIUS_M, abs=0.002)
