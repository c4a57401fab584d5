"""A scan with faults becomes a surface, or one line; objects begin where they were scanned."""

import numpy as np
import pytest

from benchmarks.twin.scan_like import block, scan_like
from scenes.mesh import BoxPart, CollisionMesh, PhysicalObject
from scenes.pose import Pose
from sim.physics.any_room import physics_of
from sim.physics.moving.people import HandTarget, PersonTarget
from sim.physics.scanned.opening import twin_of_room
from sim.physics.scanned.surface import scanned_surface
from sim.physics.scanned.twin import Twin
from sim.physics.world import World

SECOND_NS = 1_000_000_000
ROOM = block((-2, -2, 0), (2, 2, 2.5), is_room=True)
TABLE = block((1.1, 0.2, 0), (1.7, 1.2, 0.72))
HOUSE = scan_like(np.concatenate([ROOM, TABLE]), edge_m=0.12, noise_m=0.002, seed=3)


def mesh(triangles):
    vertices = np.asarray(triangles, dtype=np.float32).reshape(-1, 3)
    return CollisionMesh(vertices, np.arange(len(vertices), dtype=np.int32).reshape(-1, 3))


def cube(object_id, place, side_m=0.3):
    half = 0.5 * side_m
    part = BoxPart(Pose.from_yaw(0.0, (0.0, 0.0, half)), (half,) * 3)
    return PhysicalObject(
        object_id, "cube", (), (side_m,) * 3, (part,), 2.0, 0.5, Pose.from_yaw(0.2, place)
    )


def shell(item, gap_m):
    """Surface of the object in a scan that saw it, a little too large."""
    half = 0.5 * np.asarray(item.box_m) + gap_m
    middle = np.add(item.world_from_object.translation, (0, 0, 0.5 * item.box_m[2]))
    return scan_like(block(middle - half, middle + half), edge_m=0.05, noise_m=0.001, seed=1)


def rest(triangles, *movables):
    ready = scanned_surface(mesh(triangles), movables, name="attic")
    twin = Twin(ready.surface, ready.movables, notes=ready.notes)
    twin.part_overlaps()
    twin.step(2 * SECOND_NS)
    return twin


def test_objects_stay_where_they_were_though_the_scan_has_them(scanned_as, small_room):
    low, high = cube("low", (-0.5, 0.0, 0.0)), cube("high", (1.4, 0.7, 0.72))
    twin = rest(np.concatenate([HOUSE, shell(low, 0.03), shell(high, 0.03)]), low, high)
    for item in (low, high):
        moved = twin.object_pose(item.object_id).translation - item.world_from_object.translation
        assert np.linalg.norm(moved) < 0.005
    assert twin.notes == ()


def test_what_the_scan_kept_of_an_object_does_not_hold_it(small_room):
    item = cube("low", (-0.5, 0.0, 0.0))
    twin = rest(np.concatenate([HOUSE, shell(item, 0.03)]), item)
    twin.throw("low", np.array([2.5, 0.0, 0.0]))
    twin.step(SECOND_NS)
    assert twin.object_pose("low").translation[0] > -0.2


def test_objects_in_one_another_are_moved_apart_gently_and_it_is_said():
    twin = rest(HOUSE, cube("a", (-0.5, 0.0, 0.0)), cube("b", (-0.28, 0.0, 0.0)))
    a, b = (twin.object_pose(name).translation for name in "ab")
    assert np.linalg.norm(a - b) > 0.28
    assert max(np.abs(a - (-0.5, 0.0, 0.0)).max(), np.abs(b - (-0.28, 0.0, 0.0)).max()) < 0.2
    assert any("overlapped" in note for note in twin.notes)


def test_an_object_below_the_floor_is_lifted():
    twin = rest(HOUSE, cube("a", (-0.5, 0.0, -0.06)))
    assert twin.object_pose("a").translation[2] == pytest.approx(0.0, abs=0.004)
    assert "lifted by 6 cm" in twin.notes[0]


@pytest.mark.parametrize("fault", ["turned", "inside out", "degenerate", "holes"])
def test_faulty_triangles_carry_like_good_ones(fault):
    rng = np.random.default_rng(5)
    # Corners that neighbours share, as in any mesh of a scan.
    triangles = scan_like(np.concatenate([ROOM, TABLE]), edge_m=0.12, noise_m=0.0, seed=3)
    if fault == "turned":
        some = rng.random(len(triangles)) < 0.45
        triangles = np.where(some[:, None, None], triangles[:, ::-1], triangles)
    elif fault == "inside out":
        triangles = triangles[:, ::-1]
    elif fault == "degenerate":
        triangles = np.concatenate([triangles, np.repeat(triangles[:50, :1], 3, axis=1)])
    else:
        triangles = triangles[rng.random(len(triangles)) < 0.9]
    twin = rest(triangles, cube("low", (-0.5, 0.0, 0.05)), cube("high", (1.4, 0.7, 0.75), 0.2))
    twin.throw("low", np.array([-6.0, 0.0, 1.0]))
    twin.step(SECOND_NS)
    assert twin.object_pose("low").translation[2] == pytest.approx(0.0, abs=0.01)
    assert twin.object_pose("high").translation[2] > 0.70


def test_a_room_without_a_floor_gets_one_and_it_is_said():
    vectors = np.cross(HOUSE[:, 1] - HOUSE[:, 0], HOUSE[:, 2] - HOUSE[:, 0])
    is_floor = (vectors[:, 2] > 0.0) & (HOUSE[:, :, 2].max(axis=1) < 0.1)
    twin = rest(HOUSE[~is_floor], cube("low", (-0.5, 0.0, 0.0)))
    assert twin.object_pose("low").translation[2] == pytest.approx(0.0, abs=0.003)
    assert "no floor" in twin.notes[0]
    deep = HOUSE[~is_floor] - (0.0, 0.0, 1.0)
    with pytest.raises(ValueError, match=r"'attic'.*no floor.*z = -1\.0.*shift it"):
        scanned_surface(mesh(deep), (), name="attic")


def test_what_is_no_room_is_one_line():
    with pytest.raises(ValueError, match="'attic': its collision mesh has no triangles"):
        scanned_surface(mesh(np.zeros((0, 3, 3))), (), name="attic")
    with pytest.raises(ValueError, match=r"spans 4000 m, limit 200 m; is it in millimetres"):
        scanned_surface(mesh(1000.0 * ROOM), (), name="attic")
    with pytest.raises(ValueError, match="finite"):
        mesh(np.full((1, 3, 3), np.nan))


def test_each_room_gets_its_own_physics(small_room, scanned_small_room):
    aside = HandTarget(np.array([-1.8, -1.8, 1.0]))
    people = {"ann": PersonTarget(np.array([-1.8, -1.8]), aside, aside)}
    assert isinstance(physics_of(small_room, people), World)
    assert physics_of(small_room, people).notes == ()
    assert isinstance(physics_of(scanned_small_room, people), Twin)
    with pytest.raises(ValueError, match="no collision mesh"):
        twin_of_room(small_room, people)


def test_support_is_the_scanned_surface_below(scanned_small_room):
    twin = twin_of_room(scanned_small_room, {})
    for place, height in (((1.4, 0.7, 1.0), 0.72), ((1.4, 0.7, 0.3), 0.0), ((0.0, 0.0, 2.0), 0.0)):
        assert twin.support_height(np.array(place)) == pytest.approx(height, abs=0.01)
    # Under the book the scan has nothing of its own: what carried it is there.
    assert twin.support_height(np.array([1.35, 0.6, 0.72])) == pytest.approx(0.72, abs=0.002)
