import numpy as np
import pytest

from scenes.mesh import PhysicalObject, PhysicalRoom, TexturedMesh
from scenes.pose import Pose

GOOD = {
    "vertices": np.array([[0, 0, 0], [1, 0, 0], [0, 2, 0]], float),
    "faces": np.array([[0, 1, 2]]),
    "uv": np.array([[0, 0], [1, 0], [0, 1]]),
    "texture": np.full((2, 2, 3), 7, np.uint8),
}


def test_a_mesh_is_a_value_of_fixed_types():
    mesh = TexturedMesh(**GOOD)
    kinds = {"vertices": "f8", "faces": "i4", "uv": "f4", "texture": "u1"}
    for name, kind in kinds.items():
        array = getattr(mesh, name)
        assert array.dtype == np.dtype(kind)
        with pytest.raises(ValueError, match="read-only"):
            array[0, 0] = 1
    np.testing.assert_array_equal(mesh.bounds(), [[0, 0, 0], [1, 2, 0]])


def test_a_mesh_may_have_no_faces():
    assert len(TexturedMesh(**{**GOOD, "faces": np.zeros((0, 3))}).faces) == 0


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("vertices", np.zeros((3, 2)), "vertices"),
        ("vertices", np.full((3, 3), np.nan), "vertices"),
        ("faces", np.zeros((1, 4)), "faces"),
        ("faces", np.array([[0, 1, 3]]), "index 3, limit 2"),
        ("faces", np.array([[0, 1, -1]]), "faces"),
        ("uv", np.zeros((2, 2)), "uv"),
        ("texture", np.zeros((2, 2)), "texture"),
        ("texture", np.zeros((0, 2, 3)), "texture"),
    ],
)
def test_what_is_no_mesh_is_refused(name, value, said):
    with pytest.raises(ValueError, match=said):
        TexturedMesh(**{**GOOD, name: value})


def test_objects_are_found_by_id():
    def thing(object_id):
        return PhysicalObject(object_id, "box", (), (1, 1, 1), (), 1.0, 0.5, Pose.identity())

    room = PhysicalRoom(
        "r", (), (thing("b"), thing("a")), (), np.array([0, 0, 1.0]), Pose.identity()
    )
    assert room.object_by_id("a") is room.objects[1]
    with pytest.raises(KeyError, match="'c'; it has: a, b"):
        room.object_by_id("c")
