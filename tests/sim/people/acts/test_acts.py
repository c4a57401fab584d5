"""Actions of people, in a room of boxes and in the same room as a scan shows it."""

import math
from dataclasses import replace

import numpy as np
import pytest

from scenes.pose import Pose, wrap_angle
from sim.people.actors import TICK_NS, Actor, introduce
from sim.people.acts.carrying import carry
from sim.people.acts.handing_over import hand_over
from sim.people.acts.pointing import point
from sim.people.acts.pushing import push
from sim.people.acts.reaching import reach
from sim.people.acts.sitting import sit
from sim.people.acts.supports import support_at
from sim.people.acts.walking import walk
from sim.people.person import shoulder
from sim.people.posture import PART_NAMES, part_poses
from sim.physics.any_room import physics_of
from sim.scenarios.actions import (
    Carry,
    Draw,
    HandOver,
    Hide,
    Point,
    Push,
    Put,
    Receive,
    Sit,
    Stand,
    Turn,
    Walk,
    name_of,
)
from sim.tables import ScenarioError

CAMERA_XY = np.array([0.0, -0.5])
TABLE_TOP_M = 0.72


@pytest.fixture(params=["boxes", "scanned"])
def room(request, small_room, scanned_small_room):
    return small_room if request.param == "boxes" else scanned_small_room


class Played:
    """A room after its people have done what they had to."""

    def __init__(self, room, scripts, *, seconds=25.0, starts=((-1.5, -1.5), (0.9, -1.2))):
        self.room = room
        self.actors = [
            Actor(name, room, start=at, yaw=0.0, actions=actions, camera_xy=CAMERA_XY)
            for (name, actions), at in zip(scripts.items(), starts, strict=False)
        ]
        introduce(self.actors)
        self.physics = physics_of(room, {a.person_id: a.target() for a in self.actors})
        self.said, self.rays, self.lines, self.postures = [], [], [], []
        for _ in range(round(seconds * 1e9 / TICK_NS)):
            for actor in self.actors:
                text = actor.tick(self.physics)
                if text is not None:
                    self.said.append(text)
            self.rays.append(self.actors[0].ray)
            self.lines += self.actors[0].new_annotations()
            self.postures.append(self.actors[0].posture(self.physics))
            self.physics.move_people({a.person_id: a.target() for a in self.actors})
            self.physics.step(TICK_NS)
            if all(a.action_index == len(scripts[a.person_id]) for a in self.actors):
                break

    def place(self, object_id):
        return self.physics.object_pose(object_id).translation

    def tilt_deg(self, object_id):
        return math.degrees(math.acos(min(1.0, self.physics.object_pose(object_id).rotation[2, 2])))


def test_a_chair_is_pushed_and_turned(room):
    pushed = Played(room, {"ann": [Push("chair-1", (0.2, 0.4)), Hide("chair-1", 0.3)]})
    assert np.linalg.norm(pushed.place("chair-1")[:2] - (0.2, 0.4)) < 0.25
    assert abs(pushed.place("chair-1")[2]) < 0.005
    assert pushed.said == ["pushes chair-1", "lets go of chair-1", "hides chair-1"]
    turned = Played(room, {"ann": [Turn("chair-1", 50.0)]})
    assert math.degrees(turned.physics.object_pose("chair-1").yaw() - 0.3) > 20.0


def test_a_book_is_carried_to_the_same_table_and_put_on_the_floor_and_back(room):
    there = Played(room, {"ann": [Carry("book-1", (1.35, 0.95), 40.0)]})
    assert there.place("book-1") == pytest.approx((1.35, 0.95, TABLE_TOP_M), abs=0.015)
    actions = [Carry("book-1", (0.4, -1.0)), Stand(0.3)]
    down = Played(room, {"ann": actions})
    assert down.place("book-1") == pytest.approx((0.4, -1.0, 0.0), abs=0.015)
    actions = [Carry("book-1", (0.4, -1.0)), Carry("book-1", (1.4, 0.9))]
    back = Played(room, {"ann": actions}, seconds=40.0)
    assert back.place("book-1") == pytest.approx((1.4, 0.9, TABLE_TOP_M), abs=0.02)
    assert back.tilt_deg("book-1") < 2.0


def test_a_chair_that_is_carried_comes_all_the_way_round_before_it_is_put_down(room):
    start = room.object_by_id("chair-1").world_from_object.yaw()
    carried = Played(room, {"ann": [Carry("chair-1", (0.2, 0.4), 150.0)]})
    assert carried.place("chair-1") == pytest.approx((0.2, 0.4, 0.0), abs=0.02)
    turned = carried.physics.object_pose("chair-1").yaw() - start
    assert math.degrees(wrap_angle(turned - math.radians(150.0))) == pytest.approx(0.0, abs=4.0)
    feet = carried.actors[0].person.body.position
    assert np.linalg.norm(feet - (0.2, 0.4)) > 0.4, "nobody puts a chair onto their own feet"


def test_something_is_put_on_another_object(room):
    seat = room.object_by_id("chair-1").world_from_object @ np.array([0.0, 0.03, 0.0])
    played = Played(room, {"ann": [Put("book-1", (seat[0], seat[1]))]})
    assert played.place("book-1")[2] == pytest.approx(0.47, abs=0.01)
    assert played.tilt_deg("book-1") < 2.0
    person = played.actors[0].person
    assert support_at(person, (seat[0], seat[1]), without="book-1") == pytest.approx(0.47, abs=5e-3)


def test_somebody_sits_down_with_bent_knees_and_stands_up_again(room):
    played = Played(room, {"ann": [Sit(1.0, "chair-1")]})
    assert played.said == ["sits down on chair-1", "stands up"]
    # Nobody's torso pushes the chair away.
    start = room.object_by_id("chair-1").world_from_object.translation
    assert played.place("chair-1") == pytest.approx(start, abs=0.01)
    lowest = min(played.postures, key=lambda p: part_poses(p)[0].translation[2])
    parts = dict(zip(PART_NAMES, part_poses(lowest), strict=True))
    assert parts["pelvis"].translation[2] == pytest.approx(0.47 + 0.10, abs=0.03)
    assert np.linalg.norm(parts["pelvis"].translation[:2] - start[:2]) < 0.1
    for side in ("left", "right"):
        assert parts[f"{side}-shoe"].translation[2] == pytest.approx(0.075, abs=0.01)
        thigh, shin = (parts[f"{side}-{name}"].rotation[:, 2] for name in ("thigh", "shin"))
        assert math.degrees(math.acos(thigh @ shin)) > 50.0
    # The back of the chair is at -y of its frame, so who sits there looks along its +y.
    assert lowest.yaw == pytest.approx(0.3 + 0.5 * math.pi, abs=0.15)
    assert part_poses(played.postures[-1])[0].translation[2] > 0.88


def test_one_person_gives_a_book_to_another_who_puts_it_down(room):
    played = Played(
        room,
        {
            "ann": [HandOver("book-1", "ben"), Walk((-1.5, -1.5))],
            "ben": [Receive("book-1"), Carry("book-1", (-0.4, -1.2))],
        },
        seconds=40.0,
    )
    order = [
        "takes book-1",
        "holds out book-1 to ben",
        "takes book-1",
        "gives book-1 to ben",
        "puts down book-1",
    ]
    assert played.said == order
    assert played.place("book-1") == pytest.approx((-0.4, -1.2, 0.0), abs=0.03)
    assert played.tilt_deg("book-1") < 3.0


def test_who_waits_in_vain_goes_on(small_room):
    played = Played(small_room, {"ann": [Receive("book-1"), Stand(0.2)]}, seconds=31.0)
    assert played.said == ["has waited for book-1 in vain"]
    assert played.actors[0].action_index == 2


def test_an_arm_points_at_an_object_and_at_a_place(small_room):
    played = Played(small_room, {"ann": [Point(1.0, "chair-1"), Point(0.5, at=(2.0, 0.0, 1.5))]})
    rays = [ray for ray in played.rays if ray is not None]
    assert len(rays) == 150
    assert rays[50][1] == pytest.approx(np.add(played.place("chair-1"), (0, 0, 0.45)), abs=0.01)
    assert rays[-1][1] == pytest.approx((2.0, 0.0, 1.5))
    # The arm is stretched towards it once it is up.
    at_shoulder = shoulder(played.actors[0].person, -1.0)
    along = (rays[-1][1] - at_shoulder) / np.linalg.norm(rays[-1][1] - at_shoulder)
    assert rays[-1][0] == pytest.approx(at_shoulder + 0.56 * along, abs=0.03)
    assert played.actors[0].ray is None


def test_a_line_grows_and_stays(small_room):
    points = ((0.0, 1.9, 1.0), (1.0, 1.9, 1.0), (1.0, 1.9, 1.5))
    played = Played(
        small_room, {"ann": [Draw(points, 0.5, (1.0, 0.0, 0.0)), Draw(points[:2], 1.0)]}
    )
    first = [line for line in played.lines if line.annotation_id == "ann-1"]
    assert {line.annotation_id for line in played.lines} == {"ann-1", "ann-2"}
    lengths = [np.linalg.norm(np.diff(a.points_in_world, axis=0), axis=1).sum() for a in first]
    assert np.allclose(np.diff(lengths), 0.005, atol=1e-6)
    assert first[-1].points_in_world == pytest.approx(np.array(points))
    assert (first[-1].colour, first[-1].user_id) == ((1.0, 0.0, 0.0), "ann")


def test_a_way_that_was_never_there_is_one_line(small_room):
    fence = replace(small_room.solids[0], half_size_m=(2.0, 0.05, 1.0),
                    object_from_box=Pose.from_yaw(0.0, (0.0, -1.0, 1.0)))  # fmt: skip
    room = replace(small_room, solids=(*small_room.solids, fence))
    with pytest.raises(ScenarioError, match=r"ann: actions\[1\] \(walk\): no way from"):
        Played(room, {"ann": [Stand(0.1), Walk((0.0, 1.0))]})


def test_each_action_has_the_name_of_its_function():
    for action, function in (
        (Carry("a", (0, 0)), carry), (HandOver("a", "b"), hand_over), (Point(1.0), point),
        (Push("a", (0, 0)), push), (Sit(1.0), sit), (Walk((0, 0)), walk),
    ):  # fmt: skip
        assert name_of(action) == function.__name__
    assert reach.__doc__
