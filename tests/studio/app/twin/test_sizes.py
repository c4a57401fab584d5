"""Bodies and meshes of another size, unit or upper axis stand where they stood."""

import numpy as np
import pytest

from scenes.coloured_mesh import Geometry
from studio.app.model.documents.document import Document
from studio.app.model.documents.document_file import document_from_text, document_to_text
from studio.app.twin import sizes
from studio.app.twin.additions import mesh_added, primitive_added
from studio.app.twin.bodies import bodies_of, is_same_body, virtual_of
from studio.app.twin.edits import EditError, Stance, placed, pose_of

CORNERS = np.array([[-0.2, -0.1, 0], [0.2, -0.1, 0], [-0.2, 0.1, 0], [0, 0, 0.6]], np.float32)
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
LEANING = Stance((0.5, 0.4, 0.1), yaw_deg=30.0, tilt_x_deg=20.0, tilt_y_deg=-10.0)


@pytest.fixture
def document():
    geometry = Geometry(CORNERS, FACES, np.full((4, 3), 99, np.uint8))
    made, mesh_id = mesh_added(Document("desk"), {}, geometry, source="a.stl", place=(0, 0, 0))
    assert mesh_id == "mesh-1"
    return placed(made, {}, mesh_id, LEANING)


def size(document):
    return sizes.size_of(document, "mesh-1")


def test_scale_and_sides_leave_the_triangles_of_the_file_as_they_are(document):
    mesh = document.twin.meshes["mesh-1"]
    twice = sizes.scaled(document, "mesh-1", 2.0)
    assert size(twice) == pytest.approx((0.8, 0.4, 1.2))
    assert twice.twin.meshes["mesh-1"].geometry is mesh.geometry
    wide = sizes.resized(twice, "mesh-1", (0.8, 1.6, 1.2))
    assert wide.twin.meshes["mesh-1"].scale == pytest.approx((2.0, 8.0, 2.0))
    assert wide.twin.meshes["mesh-1"].scaled.size_m == pytest.approx((0.8, 1.6, 1.2))
    assert sizes.scale_of(wide.twin.meshes["mesh-1"]) == pytest.approx(32 ** (1 / 3))
    assert pose_of(wide, {}, "mesh-1") is mesh.world_from_mesh
    again = document_from_text(document_to_text(wide), source="test")
    assert again.twin.meshes["mesh-1"].scale == wide.twin.meshes["mesh-1"].scale


def test_the_physics_has_it_as_large(document):
    wide = sizes.resized(document, "mesh-1", (0.4, 0.8, 0.3))
    before, after = bodies_of(document.twin)["mesh-1"], bodies_of(wide.twin)["mesh-1"]
    assert not is_same_body(before, after)
    assert virtual_of(after).box_m == pytest.approx((0.4, 0.8, 0.3))
    large = sizes.scaled(document, "mesh-1", 6.0)
    assert not bodies_of(large.twin), "it is a part of a building by now"


def test_another_unit_sizes_it_and_may_be_taken_back(document):
    feet = sizes.read_in_unit(document, "mesh-1", "ft")
    assert size(feet) == pytest.approx([0.3048 * side for side in size(document)])
    assert size(sizes.read_in_unit(feet, "mesh-1", "m")) == pytest.approx(size(document))
    with pytest.raises(EditError, match=r"0\.0006 m in mm, limits 0\.01 to 20 m; it stays"):
        sizes.read_in_unit(document, "mesh-1", "mm")
    with pytest.raises(EditError, match="unit 'parsec', wanted one of m, cm"):
        sizes.read_in_unit(document, "mesh-1", "parsec")


def test_another_upper_axis_stands_on_its_base_with_its_scale(document):
    wide = sizes.resized(document, "mesh-1", (0.4, 0.2, 1.2))
    turned = sizes.read_with_up(wide, "mesh-1", "y")
    assert size(turned) == pytest.approx((0.4, 1.2, 0.2)), "z of before is y"
    vertices = turned.twin.meshes["mesh-1"].scaled.vertices
    assert vertices.min(axis=0) == pytest.approx((-0.2, -0.6, 0.0))
    back = sizes.read_with_up(turned, "mesh-1", "z").twin.meshes["mesh-1"]
    assert back.scale == pytest.approx((1.0, 1.0, 2.0))
    assert back.geometry.vertices == pytest.approx(CORNERS, abs=1e-6)
    assert sizes.read_with_up(wide, "mesh-1", "z") is wide


def test_a_flat_mesh_stays_flat():
    flat = Geometry(CORNERS * np.float32([1, 1, 0]), FACES, np.full((4, 3), 9, np.uint8))
    made, mesh_id = mesh_added(Document("desk"), {}, flat, source="a.ply", place=(0, 0, 0))
    assert sizes.size_of(sizes.resized(made, mesh_id, (1.0, 1.0, 0.5)), mesh_id) == (
        pytest.approx((1.0, 1.0, 0.0))
    )


@pytest.mark.parametrize("sides", [(0.0, 1.0, 1.0), (1.0, 1.0), "large", (30.0, 1.0, 1.0)])
def test_sides_that_are_none_are_refused(document, sides):
    with pytest.raises(EditError, match=r"wanted|limits"):
        sizes.resized(document, "mesh-1", sides)


def test_bodies_have_their_own_limits_and_nothing_else_has_a_size(document):
    made, box = primitive_added(document, {}, shape="box", place=(0, 0, 0))
    assert sizes.size_of(sizes.resized(made, box, (0.1, 0.2, 0.3)), box) == (0.1, 0.2, 0.3)
    assert sizes.size_of(made, "chair-1") is None
    for refuse in (sizes.scaled, sizes.read_in_unit, sizes.read_with_up):
        with pytest.raises(EditError, match="no such mesh"):
            refuse(made, box, 2.0)
    with pytest.raises(EditError, match="no such primitive"):
        sizes.resized(made, "chair-1", (1, 1, 1))
