"""`sim.scenarios.first`: a scenario that fits any room."""

from dataclasses import replace

import numpy as np
import pytest

from sim.scenarios.actions import Carry, Push, Walk
from sim.scenarios.first import first_scenario
from sim.scenarios.scenario import parse_scenario, validate_scenario


def made(room):
    return parse_scenario(first_scenario(room), source="first.toml")


def test_what_stands_on_the_floor_is_pushed_and_what_lies_on_a_table_carried(small_room):
    scenario = made(small_room)
    validate_scenario(scenario, small_room)
    actions = scenario.people[0].actions
    assert [a.object for a in actions if isinstance(a, Push)] == ["chair-1"]
    assert [a.object for a in actions if isinstance(a, Carry)] == ["book-1"]
    assert scenario.camera.position is not None


def test_pushed_objects_go_where_nothing_stands(small_room):
    for action in made(small_room).people[0].actions:
        if isinstance(action, Push):
            chair = small_room.object_by_id("chair-1").world_from_object.translation[:2]
            assert 0.3 < np.linalg.norm(np.array(action.to) - chair) < 0.9


def test_in_a_room_without_objects_somebody_walks(small_room):
    empty = replace(small_room, objects=())
    scenario = made(empty)
    validate_scenario(scenario, empty)
    assert all(isinstance(action, Walk) for action in scenario.people[0].actions)


def test_the_same_room_gives_the_same_file(small_room):
    assert first_scenario(small_room) == first_scenario(small_room)


def test_a_room_without_floor_is_refused(small_room):
    tiny = replace(small_room, footprint_m=np.array([[1.9, 1.9], [1.95, 1.95]]))
    with pytest.raises(ValueError, match="no free floor"):
        first_scenario(tiny)


def test_nobody_starts_at_the_very_edge_of_a_room_whose_walls_were_not_scanned(small_room):
    open_room = replace(small_room, solids=(), objects=())
    scenario = made(open_room)
    validate_scenario(scenario, open_room)
    low, high = open_room.footprint_m
    assert (np.array(scenario.people[0].start) > low + 0.1).all()
    assert (np.array(scenario.people[0].start) < high - 0.1).all()
