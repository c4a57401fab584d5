"""Objects moved by the mouse, in rooms of boxes and in scanned ones: walls stop, desks carry."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from scenes.opening import open_scene
from scenes.pose import Pose, rotation_angle
from sim.bodies import UNIT_BOX_CORNERS
from sim.physics.by_hand import physics_by_hand
from sim.physics.clear_place import TOLERATED_M
from sim.physics.mouse_hand import NotFree
from sim.physics.moving.primitives import Primitive, Shape
from sim.physics.scanned.opening import twin_of_room
from sim.physics.world import STEP_NS, World

SECOND_NS = 1_000_000_000
TABLE_TOP_M = 0.72
TICK_NS = 8 * STEP_NS
MIDDLE = np.array([0.0, 0.0, 0.4])


@pytest.fixture(params=["boxes", "scan"])
def physics(request, small_room, scanned_small_room):
    """The small room, as it is and as it was scanned."""
    if request.param == "boxes":
        return World(small_room, {}, is_by_hand=True)
    return twin_of_room(scanned_small_room, {})


def drag(physics, object_id, target, *, seconds, point=MIDDLE, turn_rad=0.0):
    """Pull for a while; the object's poses at every tick."""
    poses = []
    for _ in range(round(seconds * SECOND_NS / TICK_NS)):
        physics.pull(object_id, point, np.asarray(target), turn_rad=turn_rad)
        physics.step(TICK_NS)
        poses.append(physics.object_pose(object_id))
    return poses


def tilt_deg(pose):
    return math.degrees(math.acos(min(1.0, pose.rotation[2, 2])))


def corners(item, pose):
    """(N, 3) corners in the world of what an object collides with."""
    return np.concatenate(
        [
            pose @ (part.object_from_box @ (UNIT_BOX_CORNERS * part.half_size_m))
            for part in item.parts
        ]
    )


def test_a_pulled_object_reaches_the_target_without_overshoot(physics):
    target = np.array([0.3, 0.6, 0.75])
    poses = drag(physics, "chair-1", target, seconds=1.5)
    way = np.array([np.linalg.norm(pose @ MIDDLE - target) for pose in poses])
    assert way[-1] < 0.005
    assert (np.diff(way) < 0.002).all()  # critically damped: it never goes away again
    assert tilt_deg(poses[-1]) < 1.0
    assert not physics.is_at_rest


def test_a_chair_dragged_at_a_wall_stops_at_it(physics, small_room):
    chair = small_room.object_by_id("chair-1")
    poses = drag(physics, "chair-1", (-3.5, 1.0, 0.45), seconds=2.0)
    lowest = min(corners(chair, pose)[:, 0].min() for pose in poses)
    assert -2.02 < lowest < -1.95
    away = drag(physics, "chair-1", (-1.0, 1.0, 0.45), seconds=1.0)
    assert np.linalg.norm(away[-1] @ MIDDLE - (-1.0, 1.0, 0.45)) < 0.01


def test_a_chair_is_not_dragged_into_a_table(physics):
    poses = drag(physics, "chair-1", (1.4, 0.7, 0.45), seconds=2.0)
    assert max(pose.translation[0] for pose in poses) < 1.1 - 0.15
    assert not any(tilt_deg(pose) > 45.0 for pose in poses)


def test_a_dropped_book_rests_on_the_desk(physics):
    drag(physics, "book-1", (1.4, 0.7, TABLE_TOP_M + 0.3), seconds=1.0, point=np.zeros(3))
    assert physics.object_pose("book-1").translation[2] > TABLE_TOP_M + 0.28
    assert physics.release() == "book-1"
    lowest = math.inf
    for _ in range(2 * SECOND_NS // TICK_NS):
        physics.step(TICK_NS)
        lowest = min(lowest, physics.object_pose("book-1").translation[2])
    assert lowest > TABLE_TOP_M - 0.005
    assert physics.is_at_rest
    rest = physics.object_pose("book-1").translation
    for _ in range(SECOND_NS // TICK_NS):
        physics.step(TICK_NS)
        assert np.abs(physics.object_pose("book-1").translation - rest).max() < 0.001


@pytest.mark.parametrize(
    "side", [(0.5, -1.0, 0.3), (-1.0, 0.4, 0.1), (0.2, -1.0, 1.5), (0.0, 0.3, 3.0)]
)
def test_a_throw_lands_inside(physics, side):
    start = physics.object_pose("book-1").translation + np.array([0.0, 0.0, 0.5])
    drag(physics, "book-1", start, seconds=0.7, point=np.zeros(3))
    drag(physics, "book-1", start + 3.0 * np.array(side), seconds=0.2, point=np.zeros(3))
    before = physics.object_pose("book-1").translation
    physics.release()
    physics.step(TICK_NS)
    after = physics.object_pose("book-1").translation
    assert np.linalg.norm(after - before) / (TICK_NS / SECOND_NS) > 1.0  # it flies on
    physics.step(4 * SECOND_NS)
    x, y, z = physics.object_pose("book-1").translation
    assert abs(x) < 2.0
    assert abs(y) < 2.0
    assert -0.01 < z < 0.8
    assert physics.is_at_rest


def test_the_hand_turns_what_it_holds(physics):
    before = physics.object_pose("book-1")
    over = np.array([0.0, -1.0, 1.0])
    poses = drag(
        physics, "book-1", over, seconds=1.5, point=np.array([0.05, 0.1, 0.0]), turn_rad=math.pi / 2
    )
    wanted = Pose.from_yaw(before.yaw() + math.pi / 2)
    assert rotation_angle(poses[-1].rotation @ wanted.rotation.T) < math.radians(2.0)
    assert np.linalg.norm(poses[-1] @ np.array([0.05, 0.1, 0.0]) - over) < 0.01


def test_a_push_moves_along_it_and_no_further_than_friction_lets(physics):
    before = physics.object_pose("chair-1").translation
    physics.push("chair-1", before + np.array([0.0, 0.0, 0.3]), np.array([4.5, 0.0, 0.0]))
    physics.step(2 * SECOND_NS)
    way = physics.object_pose("chair-1").translation - before
    # 1 m/s against friction 0.45 ends after v² / 2 µ g = 0.11 m, and a chair rocks on its legs.
    assert 0.03 < way[0] < 0.16
    assert abs(way[1]) < 0.03
    assert physics.is_at_rest


def test_what_is_placed_in_a_table_is_put_beside_or_on_it(physics):
    placed = physics.place("chair-1", Pose.from_yaw(0.1, (1.3, 0.7, 0.0)))
    before = physics.object_pose("book-1").translation
    assert np.linalg.norm(placed.translation - (1.3, 0.7, 0.0)) > 0.05
    assert np.array_equal(physics.object_pose("chair-1").translation, placed.translation)
    physics.step(SECOND_NS)
    here = physics.object_pose("chair-1").translation
    assert np.abs(here[:2]).max() < 2.0
    assert here[2] > -0.005
    assert np.linalg.norm(physics.object_pose("book-1").translation - before) < 1.0


def test_what_is_placed_where_it_is_free_is_exactly_there(physics):
    wanted = Pose.from_yaw(1.0, (0.5, -1.0, 0.001))
    placed = physics.place("chair-1", wanted)
    assert np.abs(placed.matrix() - wanted.matrix()).max() < 1e-12
    physics.step(SECOND_NS)
    assert np.abs(physics.object_pose("chair-1").translation - wanted.translation).max() < 0.003


def test_a_place_at_rest_is_found_again(physics):
    physics.step(SECOND_NS)
    rest = physics.object_pose("book-1")
    drag(physics, "book-1", (0.0, 0.0, 1.0), seconds=0.5)
    physics.release()
    back = physics.place("book-1", rest)
    assert np.abs(back.translation - rest.translation).max() < 1e-9
    assert TOLERATED_M < 0.005


def test_primitives_come_and_go_while_everything_else_goes_on(physics):
    drag(physics, "chair-1", (0.3, 0.6, 0.75), seconds=0.3)
    before, speed_from = physics.object_pose("chair-1"), physics.t_ns
    ball = Primitive("ball", Shape.SPHERE, (0.2,) * 3, Pose.from_yaw(0.0, (-1.0, -1.0, 0.5)))
    block = replace(ball, object_id="block", shape=Shape.BOX, mass_kg=None)
    physics.add_virtual(ball)
    moved = physics.object_pose("chair-1").matrix() - before.matrix()
    assert np.abs(moved).max() < 0.005  # a pose is of the step's beginning, so it may go on by one
    physics.add_virtual(replace(block, world_from_object=Pose.from_yaw(0, (1.0, -1.0, 1.0))))
    assert physics.t_ns == speed_from
    assert set(physics.object_ids) == {"chair-1", "book-1", "ball", "block"}
    physics.step(2 * SECOND_NS)
    assert np.linalg.norm(physics.object_pose("chair-1") @ MIDDLE - (0.3, 0.6, 0.75)) < 0.01
    assert physics.object_pose("ball").translation[2] == pytest.approx(0.1, abs=0.005)
    assert physics.object_pose("block").translation[2] == 1.0
    drag(physics, "ball", (0.0, -1.0, 1.0), seconds=1.0, point=np.zeros(3))
    assert np.abs(physics.object_pose("ball").translation - (0.0, -1.0, 1.0)).max() < 0.01
    physics.remove_virtual("ball")
    assert "ball" not in physics.object_poses()
    physics.step(SECOND_NS)  # the hand that held it holds nothing
    assert physics.is_at_rest
    with pytest.raises(ValueError, match="taken"):
        physics.add_virtual(block)
    with pytest.raises(NotFree, match="block"):
        physics.pull("block", MIDDLE, MIDDLE)


def test_nonsense_is_refused(physics):
    with pytest.raises(NotFree, match="piano"):
        physics.pull("piano", MIDDLE, MIDDLE)
    with pytest.raises(ValueError, match="finite"):
        physics.pull("chair-1", MIDDLE, np.array([0.0, math.nan, 0.0]))
    with pytest.raises(NotFree, match="piano"):
        physics.place("piano", Pose.identity())
    assert physics.release() is None


def test_the_same_drag_ends_the_same(small_room):
    ends = []
    for _ in range(2):
        world = World(small_room, {}, is_by_hand=True)
        drag(world, "book-1", (0.0, 0.2, 1.4), seconds=0.4)
        world.release()
        world.step(2 * SECOND_NS)
        ends.append({name: pose.matrix() for name, pose in world.object_poses().items()})
    for name, matrix in ends[0].items():
        assert np.array_equal(matrix, ends[1][name])


def test_a_built_in_scene_runs_where_its_scan_has_the_objects():
    scene = open_scene("desk")
    physics = physics_by_hand(scene)
    assert set(physics.object_ids) == {item.object_id for item in scene.objects}
    for item in scene.objects:
        pose = physics.object_pose(item.object_id)
        assert np.abs(pose.matrix() - item.world_from_object.matrix()).max() < 1e-9
    physics.step(SECOND_NS)
    for item in scene.objects:
        way = physics.object_pose(item.object_id).translation - item.world_from_object.translation
        assert np.linalg.norm(way) < 0.01


def test_a_scene_that_nothing_collides_with_says_so():
    bare = SimpleNamespace(collision=None, physical=None, name="splats")
    with pytest.raises(ValueError, match="no collision mesh"):
        physics_by_hand(bare)
