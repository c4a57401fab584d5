from __future__ import annotations

import pytest

from scenes.samples import SAMPLE_NAMES
from sim.scenarios.actions import Carry, Push
from sim.scenarios.scenario import (
    DEFAULT_SCENARIOS,
    load_scenario,
    parse_scenario,
    scenario_names,
    validate_scenario,
)
from sim.tables import ScenarioError

GOOD = """
room = "small"
duration_s = 2
[camera]
fps = 10
lens_size_px = 128
[[people]]
id = "ann"
start = [-1.5, -1.5]
actions = [{ do = "push", object = "chair-1", to = [0.4, 0.9] }]
[[surfaces]]
id = "board"
corners = [[-1, 2, 2], [1, 2, 2], [1, 2, 1], [-1, 2, 1]]
"""


def test_a_good_scenario_is_read():
    scenario = parse_scenario(GOOD, source="good.toml")
    assert scenario.name == "good"
    assert scenario.people[0].actions == (Push("chair-1", (0.4, 0.9)),)
    assert scenario.camera.pose_error_deg == 0.2
    assert scenario.camera.pose_error_cm == 0.5


def test_built_in_scenarios_are_read():
    shipped = {"lab-rearrange", "lab-layout", "lab-short", "desk-reading", "tangram-lesson"}
    assert shipped <= set(scenario_names())
    assert set(DEFAULT_SCENARIOS) == set(SAMPLE_NAMES)
    scenario = load_scenario("lab-rearrange")
    actions = scenario.people[0].actions
    assert sum(isinstance(action, Push) for action in actions) == 3
    assert any(isinstance(action, Carry) for action in actions)
    assert 18.0 <= scenario.duration_s <= 30.0
    assert [s.surface_id for s in scenario.surfaces] == ["whiteboard", "screen"]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("duration_s = 2", "duration_s = -1", ("duration_s", "-1", "0.1..3600")),
        ("duration_s = 2", 'duration_s = "long"', ("duration_s", "'long'", "a number")),
        ("duration_s = 2", "duration_s = nan", ("duration_s", "nan")),
        ("duration_s = 2", "", ("duration_s", "missing")),
        ("fps = 10", "frames = 10", ("camera.frames", "no such key", "fps")),
        ("fps = 10", "fps = true", ("camera.fps", "True")),
        ("lens_size_px = 128", "lens_size_px = 129", ("camera.lens_size_px", "129", "even")),
        ("lens_size_px = 128", "lens_size_px = 99999", ("lens_size_px", "99999", "64..4096")),
        ("start = [-1.5, -1.5]", "start = [1.0]", ("people[0].start", "[1.0]", "[x, y]")),
        ('do = "push"', 'do = "fly"', ("people[0].actions[0].do", "'fly'", "walk, stand, push")),
        ("to = [0.4, 0.9]", "to = [0.4, 0.9], how = 1", ("actions[0].how", "no such key")),
        ('id = "ann"', 'id = ""', ("people[0].id", "''")),
        ("[1, 2, 1], ", "", ("surfaces[0].corners", "four [x, y, z]")),
        ("[[-1, 2, 2]", "[[-1, 2]", ("surfaces[0].corners", "[x, y, z]")),
        ("[camera]", "[[camera]]", ("camera", "a table")),
    ],
)
def test_a_wrong_value_is_one_clear_line(old, new, words):
    assert old in GOOD
    with pytest.raises(ScenarioError) as caught:
        parse_scenario(GOOD.replace(old, new), source="bad.toml")
    message = str(caught.value)
    assert message.startswith("bad.toml")
    assert "\n" not in message
    for word in words:
        assert word in message


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('room = "small"', 'room = "attic"', ("room", "'attic'", "'small'")),
        ('object = "chair-1"', 'object = "sofa-9"', ("sofa-9", "book-1, chair-1")),
        ("to = [0.4, 0.9]", "to = [0.4, 9.0]", ("actions[0].to", "9.0", "y -2..2")),
        ("[1, 2, 2]", "[1, 3, 2]", ("surfaces[0].corners", "y -2..2")),
        ("[1, 2, 2]", "[-2, 2, 0]", ("surfaces[0].corners", "convex")),
        ("start = [-1.5, -1.5]", "start = [-15, 0]", ("people[0].start", "-15", "x -2..2")),
    ],
)
def test_a_scenario_that_does_not_fit_the_room_is_refused(small_room, old, new, words):
    assert old in GOOD
    with pytest.raises(ScenarioError) as caught:
        validate_scenario(parse_scenario(GOOD.replace(old, new), source="bad.toml"), small_room)
    for word in ("bad.toml", *words):
        assert word in str(caught.value)


def test_no_toml_and_no_file_are_clear(tmp_path):
    with pytest.raises(ScenarioError, match=r"bad\.toml: not TOML"):
        parse_scenario("room = ", source="bad.toml")
    with pytest.raises(ScenarioError, match="lab-rearrange"):
        load_scenario(tmp_path / "nowhere.toml")
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ScenarioError, match=r"binary\.toml"):
        load_scenario(binary)


def test_one_id_twice_is_refused():
    second = '\n[[people]]\nid = "ann"\nstart = [0, 0]\n'
    with pytest.raises(ScenarioError, match="'ann' twice"):
        parse_scenario(GOOD + second, source="bad.toml")
