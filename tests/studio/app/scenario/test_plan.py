"""The plan's times against the simulator's own."""

from itertools import pairwise

import numpy as np
import pytest

from scenes.samples import sample_room
from sim.navigation.floor import FloorMap
from sim.people.actors import TICK_NS, Actor, introduce
from sim.physics.moving.people import HANDS
from sim.scenarios.scenario import load_scenario, parse_scenario
from studio.app.scenario.plan import Item, RoomPlan, planned


@pytest.fixture(scope="module")
def lab():
    room = sample_room("lab")
    (low, high) = room.footprint_m.tolist()
    items = tuple(
        Item(o.object_id, o.box_m, o.world_from_object.translation, o.world_from_object.yaw())
        for o in room.objects
    )
    camera = room.world_from_rig.translation[:2]
    return room, RoomPlan(tuple(low), tuple(high), items, camera, FloorMap(room))


class Still:
    """A physics in which nothing moves and hands are where they are wanted."""

    def __init__(self, room, actors):
        self._room, self._actors = room, {actor.person_id: actor for actor in actors}

    def object_pose(self, object_id):
        return self._room.object_by_id(object_id).world_from_object

    def hand_position(self, person_id, hand):
        return self._actors[person_id].person.body.hands[HANDS.index(hand)].position

    def support_height(self, point):
        return 0.0


def true_ends_s(room, scenario):
    actors = [
        Actor(
            person.person_id,
            room,
            start=person.start,
            yaw=np.radians(person.facing_deg),
            actions=person.actions,
            camera_xy=room.world_from_rig.translation[:2],
        )
        for person in scenario.people
    ]
    introduce(actors)
    physics, ends = Still(room, actors), {}
    for tick in range(12_000):
        for actor in actors:
            before = actor.action_index
            actor.tick(physics)
            for index in range(before, actor.action_index):
                ends[actor.person_id, index] = tick * TICK_NS * 1e-9
    return ends


ALONE = """
room = "lab"
duration_s = 60.0
[[people]]
id = "ann"
start = [-0.9, 2.0]
actions = [
  { do = "walk", to = [-1.7, -1.5], face_deg = 90.0 },
  { do = "stand", seconds = 1.5 },
  { do = "hide", object = "chair-1", seconds = 1.0 },
  { do = "point", object = "chair-2", seconds = 2.0 },
  { do = "draw", points = [[0.0, 0.0, 0.01], [1.0, 0.0, 0.01]] },
  { do = "sit", to = [-1.0, 0.5], seconds = 2.0, face_deg = 0.0 },
  { do = "turn", object = "stool-2", by_deg = 90.0 },
  { do = "walk", to = [1.5, -1.5] },
]
"""


def test_times_are_near_those_of_the_simulated_people(lab):
    room, plan = lab
    scenario = parse_scenario(ALONE, source="alone.toml")
    ends = true_ends_s(room, scenario)
    before_true = 0.0
    for block in planned(scenario, plan):
        true = ends[block.person_id, block.index] - before_true
        before_true = ends[block.person_id, block.index]
        assert block.end_s - block.start_s == pytest.approx(true, abs=0.35 + 0.2 * true), block


def test_blocks_follow_one_another_and_ways_end_where_the_next_begins(lab):
    _, plan = lab
    for name in ("lab-rearrange", "lab-layout", "lab-short"):
        blocks = planned(load_scenario(name), plan)
        assert len(blocks) == len(load_scenario(name).people[0].actions)
        for before, after in pairwise(blocks):
            assert before.end_s == after.start_s
            assert after.end_s > after.start_s
            np.testing.assert_allclose(before.way[-1], after.way[0])


def test_a_way_goes_around_the_furniture_that_is_in_it(lab):
    _, plan = lab
    text = ALONE.split("actions")[0] + 'actions = [{ do = "walk", to = [1.0, -1.5] }]\n'
    (block,) = planned(parse_scenario(text, source="x.toml"), plan)
    for a, b in pairwise(block.way):
        for t in np.linspace(0.0, 1.0, 50):
            assert not plan.floor.is_solid(a + t * (b - a))


def test_who_comes_first_to_a_handing_over_waits(lab):
    _, plan = lab
    text = """
room = "lab"
duration_s = 30.0
[[people]]
id = "ann"
start = [-1.5, -1.5]
actions = [{ do = "stand", seconds = 6.0 }, { do = "hand_over", object = "book-1", to = "ben" }]
[[people]]
id = "ben"
start = [0.9, -1.2]
actions = [{ do = "receive", object = "book-1" },
  { do = "put", object = "book-1", to = [1.4, 0.9] }]
"""
    blocks = {
        (b.person_id, b.index): b for b in planned(parse_scenario(text, source="x.toml"), plan)
    }
    given, taken = blocks["ann", 1], blocks["ben", 0]
    assert given.end_s > 8.0
    assert taken.end_s == pytest.approx(given.end_s, abs=0.5)
