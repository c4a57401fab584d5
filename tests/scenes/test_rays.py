from __future__ import annotations

import numpy as np
import pytest

from scenes.rays import RayScene

SHEET = np.array([[[-1.0, -1, 0], [1, -1, 0], [1, 1, 0]], [[-1.0, -1, 0], [1, 1, 0], [-1, 1, 0]]])


def test_cast_finds_the_triangle_and_its_distance():
    origins = np.array([[0.5, -0.5, 2.0], [-0.5, 0.5, 3.0], [5.0, 0.0, 1.0]])
    hits = RayScene(SHEET).cast(origins, np.tile([0.0, 0.0, -1.0], (3, 1)))
    assert hits.triangle.tolist() == [0, 1, -1]
    assert hits.distance[:2] == pytest.approx([2.0, 3.0])
    assert np.isinf(hits.distance[2])
    assert np.allclose(hits.normals[:2], [0, 0, 1])


def test_blocked_looks_only_as_far_as_the_segment():
    origins = np.array([[0.0, 0.1, 1.0]] * 2)
    segments = np.array([[0.0, 0.0, -0.9], [0.0, 0.0, -1.1]])
    assert RayScene(SHEET).blocked(origins, segments).tolist() == [False, True]


def test_distance_to_the_nearest_point():
    points = np.array([[0.0, 0.0, 0.25], [1.3, 0.0, 0.4], [0.2, 0.3, 0.0]])
    assert RayScene(SHEET).distance(points) == pytest.approx([0.25, 0.5, 0.0], abs=1e-6)
