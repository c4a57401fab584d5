"""People who sit, give and point go on, or stop, where a session goes on with another scenario."""

import pytest

from sim.rehearsal import simulate
from sim.scenarios.scenario import parse_scenario
from sim.scenarios.switch import Switch

TEXT = """
room = "small"
duration_s = 6.0
[camera]
fps = 4
lens_size_px = 64
bitrate_mbps = 1.0
[[people]]
id = "ann"
start = [-0.6, 0.2]
facing_deg = 90.0
actions = [{ do = "sit", object = "chair-1", seconds = 2.0 }, { do = "walk", to = [-1.2, 0.0] }]
[[people]]
id = "cem"
start = [0.75, 0.9]
facing_deg = -20.0
actions = [{ do = "hand_over", object = "book-1", to = "dan" }]
[[people]]
id = "dan"
start = [0.3, -1.4]
facing_deg = 90.0
actions = [
  { do = "receive", object = "book-1" },
  { do = "point", at = [0.0, 1.9, 1.2], seconds = 1.0 },
]
"""


def play(room, *then):
    switches = [Switch(round(t * 1e9), parse_scenario(text, source="b.toml")) for t, text in then]
    scenario = parse_scenario(TEXT, source="a.toml")
    return list(simulate(room, scenario, seed=3, then=switches))


@pytest.fixture(scope="module")
def whole(small_room):
    return play(small_room)


def texts(steps, source):
    return [e.text for s in steps for e in s.events if e.source == source]


def test_the_same_scenario_changes_nothing(small_room, whole):
    assert "sits down on chair-1" in texts(whole, "ann")
    found = play(small_room, *((t, TEXT) for t in (0.3, 1.5, 2.6, 3.4, 4.0, 4.7, 5.2)))
    assert [s.packet.data for s in found] == [s.packet.data for s in whole]


def test_who_sits_stands_up_before_going_on(small_room, whole):
    other = TEXT.replace(
        '{ do = "sit", object = "chair-1", seconds = 2.0 }, { do = "walk", to = [-1.2, 0.0] }',
        '{ do = "walk", to = [-0.6, -1.0] }',
    )
    found = play(small_room, (2.75, other))
    assert texts(found, "ann")[-1] == "stops"
    heights = [s.avatars[0].world_from_head.translation[2] for s in found]
    assert min(heights) < heights[0] - 0.2
    assert heights[-1] == pytest.approx(heights[0], abs=0.05)
    assert found[-1].avatars[0].world_from_head.translation[1] < 0.0
