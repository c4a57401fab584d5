"""Without OpenGL, everything that OpenGL would draw is drawn as strokes."""

import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.mesh import CollisionMesh
from scenes.pose import Pose
from studio.app.model.documents.added_mesh import Geometry
from studio.app.viewport.drawing.outlines import MAX_EDGES, Outlines, mesh_edges
from studio.app.viewport.drawing.shapes import Line, Solid, Squares, Surface, Wire

CAMERA = Pinhole.from_fov(160, 120, 1.0)
POSE = look_at(np.array([0.0, -3.0, 0.0]), np.zeros(3))
RED = (1.0, 0.0, 0.0)
CORNERS = np.array([[-0.5, 0, -0.5], [0.5, 0, -0.5], [0.5, 0, 0.5], [-0.5, 0, 0.5]])
FACES = np.array([[0, 1, 2], [0, 2, 3]])


def grid(side):
    """A square of so many by so many squares of two triangles."""
    x, z = np.meshgrid(np.linspace(-0.5, 0.5, side + 1), np.linspace(-0.5, 0.5, side + 1))
    vertices = np.stack([x.ravel(), 0 * x.ravel(), z.ravel()], axis=1)
    at = (np.arange(side)[:, None] * (side + 1) + np.arange(side)).ravel()
    up = at + side + 1
    faces = np.concatenate([np.stack([at, at + 1, up + 1], 1), np.stack([at, up + 1, up], 1)])
    return vertices.astype(np.float32), faces.astype(np.int32)


def solid(form):
    return Solid("body", form, (1.0, 1.0, 1.0), RED, Pose.identity())


def wire():
    return Wire("wire", CollisionMesh(CORNERS.astype(np.float32), FACES.astype(np.int32)), RED)


def surface():
    colours = np.tile(np.array([255, 0, 0], np.uint8), (4, 1))
    geometry = Geometry(CORNERS.astype(np.float32), FACES.astype(np.int32), colours)
    return Surface("mesh", geometry, Pose.identity())


SHAPES = [
    *(solid(form) for form in ("ball", "box", "cylinder", "cone")),
    Line("edge", CORNERS[[0, 1, 2, 3, 0]], RED),
    wire(),
    surface(),
    Squares("errors", CORNERS[None], np.array([RED])),
]


def drawn(shape, *, room_m=0.0, pose=POSE):
    picture = np.zeros((120, 160, 3), np.uint8)
    Outlines().draw(picture, np.full((120, 160), room_m, np.float32), [shape], CAMERA, pose)
    assert not picture[..., 1:].any()  # in the shape's own colour
    return picture[..., 0] > 0


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: f"{shape.key}-{type(shape).__name__}")
def test_every_shape_has_an_outline_where_it_is_and_the_room_hides_it(shape):
    seen = drawn(shape)
    assert seen.sum() > 60
    rows, columns = np.nonzero(seen)
    pixels, _ = CAMERA.project(POSE.inverse() @ np.array([[-0.5, -0.5, -0.5], [0.5, -0.5, 0.5]]))
    low, high = pixels.min(axis=0) - 3, pixels.max(axis=0) + 3
    assert low[0] < columns.min() <= columns.max() < high[0]
    assert low[1] < rows.min() <= rows.max() < high[1]
    assert not drawn(shape, room_m=1.0).any()
    assert np.array_equal(drawn(shape, room_m=9.0), seen)


def test_an_edge_is_hidden_only_where_the_room_is_in_front():
    line = Line("edge", np.array([[-1.0, 0, 0], [1.0, 0, 0]]), RED)
    picture, depth = np.zeros((120, 160, 3), np.uint8), np.full((120, 160), 9.0, np.float32)
    depth[:, :80] = 1.0
    Outlines().draw(picture, depth, [line], CAMERA, POSE)
    assert picture[:, 90:].any()
    assert not picture[:, :65].any()


def test_what_reaches_behind_the_camera_is_cut_off_and_what_is_behind_it_left_out():
    through = Line("edge", np.array([[0.2, -5.0, 0.1], [0.2, 4.0, 0.1]]), RED)
    assert drawn(through).any()
    assert not drawn(Line("edge", np.array([[0.0, -5.0, 0], [1.0, -4.0, 0]]), RED)).any()


def test_gaps_of_a_line_are_not_bridged():
    gap = np.array([[-1.0, 0, 0.2], [-1.0, 0, 0.4], [np.nan] * 3, [1.0, 0, 0.2], [1.0, 0, 0.4]])
    assert not drawn(Line("edge", gap, RED))[:, 60:100].any()


def test_a_mesh_of_many_triangles_has_a_bounded_number_of_edges():
    vertices, faces = grid(100)
    assert len(mesh_edges(faces)) == MAX_EDGES
    few = mesh_edges(grid(2)[1])
    assert len(few) == 16  # each once: 12 sides of squares, 4 diagonals
    assert len({tuple(edge) for edge in few.tolist()}) == 16
    seen = drawn(Wire("wire", CollisionMesh(vertices, faces), RED))
    assert all(quarter.any() for quarter in (seen[50:60, 70:80], seen[60:70, 80:90]))


def test_edges_are_kept_and_no_more_than_so_many_meshes():
    outlines = Outlines()
    picture, depth = np.zeros((120, 160, 3), np.uint8), np.zeros((120, 160), np.float32)
    for _ in range(40):
        outlines.draw(picture, depth, [wire()], CAMERA, POSE)
    assert len(outlines._kept) == 16
