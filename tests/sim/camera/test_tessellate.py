from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenes.mesh import TexturedMesh
from sim.camera.tessellate import refine_mesh


def _areas(vertices, faces):
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)


def _edge_lengths(vertices, faces):
    corners = vertices[faces]
    return np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)


def _mesh(vertices, faces):
    return TexturedMesh(
        np.asarray(vertices, dtype=float),
        np.asarray(faces, dtype=np.int32),
        np.asarray(vertices, dtype=np.float32)[:, :2],
        np.zeros((2, 2, 3), np.uint8),
    )


@settings(max_examples=25, deadline=None)
@given(st.lists(st.floats(-1, 1), min_size=12, max_size=12))
def test_refining_keeps_area_and_shortens_edges(numbers):
    mesh = _mesh(np.array(numbers).reshape(4, 3), [[0, 1, 2], [0, 2, 3]])
    fine = refine_mesh(mesh, max_edge_m=0.2)
    assert _edge_lengths(fine.vertices, fine.faces).max() <= 0.2
    assert _areas(fine.vertices, fine.faces).sum() == pytest.approx(
        _areas(mesh.vertices, mesh.faces).sum(), abs=1e-9
    )
    assert np.abs(fine.uv - fine.vertices[:, :2]).max() < 1e-6


def test_neighbours_split_their_common_edge_alike():
    quad = _mesh([[0, 0, 0], [1.3, 0, 0], [1.3, 0.4, 0], [0, 0.4, 0]], [[0, 1, 2], [0, 2, 3]])
    fine = refine_mesh(quad, max_edge_m=0.07, eye=np.array([0.1, 0.1, 0.3]), max_edge_rad=0.2)
    edges = np.sort(fine.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, uses = np.unique(edges, axis=0, return_counts=True)
    lonely = np.unique(edges, axis=0)[uses == 1]
    middle = 0.5 * (fine.vertices[lonely[:, 0]] + fine.vertices[lonely[:, 1]])
    on_border = (
        np.isclose(middle[:, 0], 0)
        | np.isclose(middle[:, 0], 1.3)
        | np.isclose(middle[:, 1], 0)
        | np.isclose(middle[:, 1], 0.4)
    )
    assert on_border.all()


def test_normals_are_sharp_over_creases_and_smooth_over_curves(small_room):
    walls = refine_mesh(small_room.static[0], max_edge_m=10.0)
    assert np.allclose(np.abs(walls.normals).max(axis=1), 1.0)
    turn = np.linspace(0, 2 * np.pi, 33)[:-1]
    ring = np.stack([np.cos(turn), np.sin(turn), np.zeros(32)], axis=1)
    vertices = np.concatenate([ring, ring + np.array([0.0, 0.0, 1.0])])
    k = np.arange(32)
    n = (k + 1) % 32
    faces = np.concatenate([np.stack([k, n, n + 32], 1), np.stack([k, n + 32, k + 32], 1)])
    tube = refine_mesh(_mesh(vertices, faces), max_edge_m=10.0)
    radial = tube.vertices * [1, 1, 0]
    assert np.einsum("ij,ij->i", tube.normals, radial).min() > 0.999
