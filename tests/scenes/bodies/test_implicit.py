"""Surfaces of shapes: closed, outward, where the shape is."""

import numpy as np

from scenes.bodies.implicit import (
    common,
    cone,
    ellipsoid,
    half_space,
    surface,
    turned_profile,
    union,
)


def volume(vertices, faces):
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float(np.einsum("ni,ni->n", a, np.cross(b, c)).sum() / 6.0)


def test_a_ball_is_closed_and_as_large_as_it_is():
    ball = ellipsoid((0, 0, 0), (0.1, 0.1, 0.1))
    vertices, faces, normals = surface(ball, (-0.1,) * 3, high=(0.1,) * 3, step_m=0.012)
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    assert abs(volume(vertices, faces) / (4 / 3 * np.pi * 1e-3) - 1.0) < 0.03
    assert np.abs(np.linalg.norm(vertices, axis=1) - 0.1).max() < 1e-4
    assert (np.einsum("ni,ni->n", vertices, normals) > 0.099).all()


def test_shapes_are_blended_and_cut():
    a = cone((0, 0, 0), (0.2, 0, 0), radii=(0.05, 0.03))
    b = cone((0.1, 0, -0.1), (0.1, 0, 0.1), radii=(0.03, 0.03))
    point = np.array([[0.14, 0.0, 0.05]])
    assert union(a, b, blend_m=0.05)(point)[0] < min(a(point)[0], b(point)[0])
    above = common(a, half_space((0, 0, -1.0), 0.0))
    assert above(np.array([[0.1, 0, -0.02]]))[0] > 0.0 > above(np.array([[0.1, 0, 0.02]]))[0]


def test_a_profile_goes_through_its_rings():
    shape = turned_profile([(0.0, 0.1, 0.2, 0.0), (0.5, 0.2, 0.1, 0.05), (1.0, 0.1, 0.1, 0.0)])
    on = np.array([[0.25, 0.0, 0.5], [0.05, 0.1, 0.5], [0.0, 0.2, 0.0]])
    assert np.abs(shape(on)).max() < 1e-3
