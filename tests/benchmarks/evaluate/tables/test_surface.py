import cv2
import numpy as np
import pytest

from benchmarks.evaluate.protocols.flat_faces import FlatFaces
from benchmarks.evaluate.tables.surface import registered_corners
from scenes.mesh import PhysicalRoom, TexturedMesh
from scenes.pose import Pose
from scenes.quad import quad_of

BOARD = np.array([[-0.5, 2.0, 1.6], [0.5, 2.0, 1.6], [0.5, 2.0, 1.0], [-0.5, 2.0, 1.0]])
SIZE = (50, 30)


def painted(size):
    rng = np.random.default_rng(5)
    picture = sum(
        cv2.resize(rng.normal(size=(n, n, 3)), size, interpolation=cv2.INTER_CUBIC) / n**0.5
        for n in (3, 5, 9)
    )
    return np.clip(128 + 60 * np.asarray(picture), 0, 255).astype(np.uint8)


def cut_up(corners, cells, texture):
    """A rectangle of many small triangles, each with its own vertices, as rooms are cut."""
    ticks = np.linspace(0, 1, cells + 1)
    x, y = (grid.ravel() for grid in np.meshgrid(ticks, ticks))
    right, down = corners[1] - corners[0], corners[3] - corners[0]
    points = corners[0] + x[:, None] * right + y[:, None] * down
    uv = np.stack([x, 1 - y], axis=1)
    first = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    below = first + cells + 1
    index = np.concatenate(
        [np.stack([first, below, first + 1], 1), np.stack([first + 1, below, below + 1], 1)]
    ).ravel()
    faces = np.arange(len(index), dtype=np.int32).reshape(-1, 3)
    return TexturedMesh(points[index], faces, uv[index].astype(np.float32), texture)


def room(*meshes):
    pytest.importorskip("open3d")
    eye = Pose(np.eye(3), np.array([0.0, 0.0, 1.3]))
    return FlatFaces(PhysicalRoom("small", meshes, (), (), np.array([0.0, 0.0, 1.0]), eye))


def test_corners_of_a_cut_up_board_are_found_beside_another_in_its_plane():
    other = cut_up(BOARD + np.array([1.2, 0, 0]), 4, painted((20, 20)))
    wall = cut_up(BOARD * [8, 1.01, 2] - [0, 0, 0.5], 3, painted((20, 20)))
    faces = room(wall, other, cut_up(BOARD, 7, painted(SIZE)))
    np.testing.assert_allclose(faces.rectangle_towards((0.1, 2.0, 1.2)), BOARD, atol=1e-6)
    beside = faces.rectangle_towards((1.2, 2.0, 1.3))
    np.testing.assert_allclose(beside, BOARD + np.array([1.2, 0, 0]), atol=1e-6)
    with pytest.raises(ValueError, match="nothing is seen"):
        faces.rectangle_towards((0.0, -2.0, 1.3))


def test_a_face_that_is_no_rectangle_is_refused():
    mesh = cut_up(BOARD, 1, painted(SIZE))
    half = TexturedMesh(mesh.vertices[:3], mesh.faces[:1], mesh.uv[:3], mesh.texture)
    with pytest.raises(ValueError, match="no rectangle"):
        room(half).rectangle_towards(BOARD[[0, 1, 3]].mean(axis=0))


def test_paint_is_looked_up_where_it_is():
    art = painted((200, 120))
    got = room(cut_up(BOARD, 7, art)).painting(quad_of(BOARD), SIZE)
    want = cv2.resize(art, SIZE, interpolation=cv2.INTER_AREA)
    assert np.abs(got.astype(int) - want).max() <= 2


@pytest.mark.parametrize("shift", [(0.0, 0.0), (1.5, -0.7)])
def test_registration_measures_a_shift(shift):
    art, part = painted((220, 140)), (slice(10, 130), slice(10, 210))
    moved = cv2.warpAffine(art, np.array([[1, 0, shift[0]], [0, 1, shift[1]]]), (220, 140))
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) + np.array(shift) / (200, 120)
    found = registered_corners(art[part], moved[part])
    assert np.abs((found - corners) * (200, 120)).max() < 0.1


def test_pictures_of_other_things_do_not_register():
    other = painted((200, 120))[::-1, ::-1]
    assert np.isnan(registered_corners(painted((200, 120)), np.ascontiguousarray(other))).all()
