"""Impossible actions are refused before they begin: one line that names the action."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.twin.scan_like import block
from scenes.pose import Pose
from sim.people.remote import remote_annotations, remote_avatar
from sim.scenarios.action_checks import HEAVIEST_KG
from sim.scenarios.action_tables import read_action
from sim.scenarios.actions import ACTION_NAMES, Draw, HandOver, Point, Put, Receive, Sit
from sim.scenarios.scenario import parse_scenario, validate_scenario
from sim.tables import ScenarioError, Table

HEAD = """
room = "small"
duration_s = 2
[[people]]
id = "ann"
start = [-1.5, -1.5]
"""
ROOM = block((-2, -2, 0), (2, 2, 2.5), is_room=True)


def scenario(actions, more=""):
    return parse_scenario(f"{HEAD}actions = [{actions}]\n{more}", source="bad.toml")


@pytest.mark.parametrize("scan", [False, True])
@pytest.mark.parametrize(
    ("action", "words"),
    [
        ('do = "walk", to = [1.12, 0.7]', ("actions[0].to", "[1.12, 0.7]", "furniture")),
        ('do = "push", object = "chair-1", to = [1.12, 0.7]', ("actions[0].to", "furniture")),
        ('do = "carry", object = "book-9", to = [0, 0]', ("actions[0].object", "book-9")),
        ('do = "sit", to = [9, 0], seconds = 1', ("actions[0].to", "[9.0, 0.0]", "x -2..2")),
        ('do = "hand_over", object = "book-1", to = "ben"', ("actions[0].to", "'ben'", "receive")),
    ],
)
def test_what_cannot_be_is_one_line(small_room, scanned_small_room, scan, action, words):
    room = scanned_small_room if scan else small_room
    with pytest.raises(ScenarioError) as caught:
        validate_scenario(scenario(f"{{ {action} }}"), room)
    for word in ("bad.toml: people[0].", *words):
        assert word in str(caught.value)
    assert "\n" not in str(caught.value)


def test_what_is_behind_a_wall_is_refused(small_room, scanned_as):
    wall = block((-2, -0.4, 0), (2, -0.35, 2.5))
    room = scanned_as(small_room, np.concatenate([ROOM, wall]))
    validate_scenario(scenario('{ do = "walk", to = [1.0, -1.0] }'), room)
    for action, word in (
        ('do = "walk", to = [0, 1.5]', r"actions\[0\].to = \[0.0, 1.5\] cannot be reached"),
        ('do = "push", object = "chair-1", to = [0, -1]', r"object = 'chair-1' cannot be reached"),
    ):
        with pytest.raises(ScenarioError, match=word):
            validate_scenario(scenario(f"{{ {action} }}"), room)


def test_what_is_too_heavy_is_refused(small_room):
    chair = replace(small_room.object_by_id("chair-1"), mass_kg=30.0)
    room = replace(small_room, objects=(chair, small_room.object_by_id("book-1")))
    with pytest.raises(ScenarioError, match=r"weighs 30.0 kg, limit of carry 8.2 kg; push it"):
        validate_scenario(scenario('{ do = "carry", object = "chair-1", to = [0, 0] }'), room)
    validate_scenario(scenario('{ do = "push", object = "chair-1", to = [0, 0] }'), room)
    assert abs(HEAVIEST_KG - 8.17) < 0.01


def test_every_action_is_read_from_its_table():
    good = {
        "put": ({"object": "a", "to": [1, 2], "height_m": 0.5}, Put("a", (1.0, 2.0), 0.5)),
        "sit": ({"object": "a", "seconds": 2}, Sit(2.0, "a")),
        "hand_over": ({"object": "a", "to": "b"}, HandOver("a", "b")),
        "receive": ({"object": "a"}, Receive("a")),
        "point": ({"at": [1, 2, 3], "seconds": 1}, Point(1.0, at=(1.0, 2.0, 3.0))),
        "draw": ({"points": [[0, 0, 0], [1, 0, 0]]}, Draw(((0.0,) * 3, (1.0, 0.0, 0.0)))),
    }
    for name, (keys, action) in good.items():
        assert read_action(Table({"do": name, **keys}, "x.toml", "")) == action
        assert ACTION_NAMES[type(action)] == name


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"do": "sit", "seconds": 1}, "either object or to"),
        ({"do": "point", "seconds": 1, "object": "a", "at": [0, 0, 0]}, "either object or at"),
        ({"do": "draw", "points": [[0, 0, 0]]}, "at least two"),
        ({"do": "draw", "points": [[0, 0, 0], [1, 0, 0]], "colour": [2, 0, 0]}, "within 0..1"),
        ({"do": "put", "object": "a", "to": [0, 0], "height_m": 9}, "0..2"),
        ({"do": "receive", "object": "a", "seconds": 1}, "no such key"),
    ],
)
def test_a_wrong_key_is_one_clear_line(table, words):
    with pytest.raises(ScenarioError, match=words):
        read_action(Table(table, "x.toml", "people[0].actions[0]"))


def test_a_remote_user_draws_a_line_that_grows():
    text = f"""{HEAD}
[[remote]]
id = "ben"
path = [[0.5, -1.5, 1.6]]
draws = [{{ points = [[0, 1, 1], [1, 1, 1]], from_s = 1.0, seconds = 2.0, colour = [0, 0, 1] }}]
"""
    (remote,) = parse_scenario(text, source="x.toml").remote
    assert remote_annotations(remote, since_s=0.0, t_s=0.9) == ()
    (line,) = remote_annotations(remote, since_s=1.0, t_s=2.0)
    assert line.points_in_world == pytest.approx(np.array([[0, 1, 1], [0.5, 1, 1]]))
    assert (line.annotation_id, line.colour) == ("ben-1", (0.0, 0.0, 1.0))
    (whole,) = remote_annotations(remote, since_s=2.9, t_s=3.1)
    assert whole.points_in_world[-1] == pytest.approx([1, 1, 1])
    assert remote_annotations(remote, since_s=3.1, t_s=3.2) == ()
    look = Pose.from_yaw(0.0, (0.0, 0.0, 1.0))
    assert remote_avatar(remote, 0.5, {}, look, t_s=2.0).ray[1] == pytest.approx([0.5, 1, 1])
    assert remote_avatar(remote, 0.5, {}, look, t_s=0.5).ray is None
