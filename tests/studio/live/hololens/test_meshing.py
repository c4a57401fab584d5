"""A headset's surfaces in the physics of a room."""

import numpy as np
import pytest

from devices.clock import ManualClock
from devices.hololens.values import SpatialSurface, SurfaceGone
from scenes.mesh import CollisionMesh
from scenes.pose import Pose
from studio.live.hololens.meshing import HiddenSurfaces, Meshing

WORLD_FROM_DEVICE = Pose.from_yaw(0.4, (0.3, 0.2, 1.4))


def plate(z, *, half=0.4, count=9, version=1, name="a"):
    """A level square in the headset's world that lies at a height of the room's."""
    side = np.linspace(-half, half, count)
    x, y = np.meshgrid(side, side)
    in_world = np.stack([x.ravel(), y.ravel(), np.full(x.size, z)], axis=1)
    k = np.arange(count * count).reshape(count, count)
    a, b, c, d = k[:-1, :-1].ravel(), k[:-1, 1:].ravel(), k[1:, 1:].ravel(), k[1:, :-1].ravel()
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.int32)
    return SpatialSurface(
        name, version, 0, WORLD_FROM_DEVICE.inverse() @ in_world, faces, Pose.identity()
    )


@pytest.fixture
def meshing(scanned_package, headset):
    found = Meshing(
        headset.meshes,
        scanned_package,
        world_from_device=lambda: WORLD_FROM_DEVICE,
        clock=ManualClock(),
    )
    found.begin()
    return found


def test_cells_that_change_are_said_and_no_others(scanned_package, headset):
    said = []
    meshing = Meshing(
        headset.meshes,
        scanned_package,
        world_from_device=lambda: WORLD_FROM_DEVICE,
        clock=ManualClock(),
        changed=said.append,
    )
    meshing.begin()
    meshing.take(plate(0.02), WORLD_FROM_DEVICE)
    assert not said, "the scan has that already"
    meshing.take(plate(0.6), WORLD_FROM_DEVICE)
    (cells,) = said
    heights = np.concatenate([mesh.vertices[:, 2] for mesh in cells.values()])
    assert np.allclose(heights, 0.6, atol=0.01)
    assert sum(len(mesh.faces) for mesh in cells.values()) == len(meshing.hidden.faces)
    meshing.take(plate(0.602, version=2), WORLD_FROM_DEVICE)
    assert len(said) == 1, "a mesh trembles"
    meshing.take(SurfaceGone("a", 0), WORLD_FROM_DEVICE)
    assert said[1].keys() == cells.keys()
    assert not any(len(mesh.faces) for mesh in said[1].values())


def height(meshing, at=(0.0, 0.0, 1.0)):
    return meshing._twin.support_height(np.array(at))


def test_what_the_scan_has_already_changes_nothing(meshing):
    meshing.take(plate(0.02), WORLD_FROM_DEVICE)
    assert meshing.status().changes == 0
    assert meshing.status().surfaces == 1
    assert meshing.whole().faces.shape == meshing._scene.collision.faces.shape


def test_a_new_table_stops_things_and_goes_again(meshing, tmp_path):
    meshing.take(plate(0.6), WORLD_FROM_DEVICE)
    assert abs(height(meshing) - 0.6) < 0.02
    assert len(meshing.hidden.faces) > 0
    assert meshing.save(tmp_path / "mesh.glb")
    meshing.take(plate(0.6 + 0.002, version=2), WORLD_FROM_DEVICE)
    assert meshing.status().changes == 1  # a mesh trembles
    meshing.take(SurfaceGone("a", 0), WORLD_FROM_DEVICE)
    assert abs(height(meshing)) < 0.02
    assert not len(meshing.hidden.faces)
    assert not meshing.save(tmp_path / "none.glb")


def test_what_stands_where_a_surface_appears_does_not_jump(meshing):
    twin = meshing._twin
    before = twin.object_poses()
    meshing.take(plate(0.25), WORLD_FROM_DEVICE)
    for _ in range(20):
        meshing.advance(20_000_000)
    for name, pose in twin.object_poses().items():
        assert np.linalg.norm(pose.translation - before[name].translation) < 0.2
    assert meshing.status().largest_step_mm < 2.0


def test_a_room_without_a_mesh_says_so(scanned_package, headset):
    from dataclasses import replace

    bare = replace(scanned_package, collision=None)
    found = Meshing(headset.meshes, bare, world_from_device=lambda: None, clock=ManualClock())
    with pytest.raises(ValueError, match="no collision mesh"):
        found.begin()


PLATE = CollisionMesh(np.eye(3), np.array([[0, 1, 2]]))
NOTHING = CollisionMesh(np.zeros((0, 3)), np.zeros((0, 3)))


class Hub:
    def __init__(self):
        self.taken = []

    def hide_behind(self, cells):
        self.taken.append({cell: len(mesh.faces) for cell, mesh in cells.items()})


def test_a_hub_gets_what_changes_and_another_one_all_of_it():
    hidden, first, second = HiddenSurfaces(), Hub(), Hub()
    hidden.show(first)
    assert not first.taken, "nothing is sent while there is nothing"
    hidden.change({(0, 0, 0): PLATE, (1, 0, 0): PLATE})
    hidden.change({(1, 0, 0): NOTHING})
    hidden.show(first)
    hidden.show(first)
    assert first.taken == [{(0, 0, 0): 1, (1, 0, 0): 0}]
    hidden.change({(2, 0, 0): PLATE})
    hidden.show(second)
    assert second.taken == [{(0, 0, 0): 1, (2, 0, 0): 1}]


def test_a_hub_and_a_room_of_sites_each_get_what_changes():
    hidden, hub, room = HiddenSurfaces(), Hub(), Hub()
    hidden.change({(0, 0, 0): PLATE})
    hidden.show(hub)
    hidden.show(hub, room)
    hidden.change({(1, 0, 0): PLATE})
    hidden.show(hub, room)
    hidden.show(hub, room)
    assert hub.taken == room.taken == [{(0, 0, 0): 1}, {(1, 0, 0): 1}]
