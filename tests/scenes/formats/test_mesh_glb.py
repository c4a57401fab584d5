import numpy as np
import pytest

from scenes.formats.mesh_glb import read_mesh, write_mesh
from scenes.formats.storage.error import FormatError
from scenes.mesh import CollisionMesh


@pytest.fixture
def mesh():
    rng = np.random.default_rng(5)
    return CollisionMesh(
        rng.normal(size=(20, 3)).astype(np.float32), rng.integers(0, 20, (30, 3)).astype(np.int32)
    )


def test_comes_back_exactly(mesh, tmp_path):
    path = tmp_path / "room.glb"
    size = write_mesh(path, mesh)
    assert size == path.stat().st_size
    back = read_mesh(path)
    np.testing.assert_array_equal(back.vertices, mesh.vertices)
    np.testing.assert_array_equal(back.faces, mesh.faces)


@pytest.mark.parametrize("keep", [0, 3, 11, 40, 200])
def test_a_cut_file_is_refused(mesh, tmp_path, keep):
    path = tmp_path / "room.glb"
    write_mesh(path, mesh)
    path.write_bytes(path.read_bytes()[:keep])
    with pytest.raises(FormatError, match="no mesh that can be read"):
        read_mesh(path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(FormatError, match="no such file"):
        read_mesh(tmp_path / "none.glb")


def test_an_obj_with_decimal_commas_is_read(tmp_path):
    path = tmp_path / "room.obj"
    path.write_text("v 0,5 -1,25 0,0\nv 1,0 0,0 0,0\nv 0,0 1e0 2,5\nf 1 2 3\n")
    assert read_mesh(path).vertices.tolist() == [[0.5, -1.25, 0.0], [1.0, 0.0, 0.0], [0, 1, 2.5]]
