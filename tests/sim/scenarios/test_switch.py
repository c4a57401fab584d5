"""A session goes on with another scenario: the same bytes before the instant, its own after."""

from __future__ import annotations

import numpy as np
import pytest

from sim.rehearsal import simulate
from sim.scenarios.scenario import parse_scenario
from sim.scenarios.switch import Switch, first_difference_s
from sim.tables import ScenarioError

HEAD = """
room = "small"
duration_s = 5.6
[camera]
fps = 5
lens_size_px = 64
bitrate_mbps = 1.0
"""
PEOPLE = """
[[people]]
id = "ann"
start = [-1.05, 1.58]
facing_deg = -60.0
actions = [{ do = "push", object = "chair-1", to = [-0.3, 0.2] }, { do = "stand", seconds = 0.5 }]
[[people]]
id = "cem"
start = [0.75, 0.9]
facing_deg = -20.0
actions = [{ do = "carry", object = "book-1", to = [1.3, 0.9] }]
"""
REMOTE = """
[[remote]]
id = "ben"
path = [[0.5, -1.5, 1.6], [0.8, -1.0, 1.6]]
points_at = ["chair-1", "book-1"]
"""
FAULTS = """
[faults]
dropped_frames = [4, 5]
drop_share = 0.1
bump_s = 0.5
"""
TEXT = HEAD + PEOPLE + REMOTE + FAULTS
SEED = 7


def scenario(text=TEXT, name="small"):
    return parse_scenario(text, source=f"{name}.toml")


def play(room, *then, first=TEXT):
    """All steps of the first scenario that goes on with (seconds, text) ones."""
    switches = [Switch(round(t_s * 1e9), scenario(text, "other")) for t_s, text in then]
    return list(simulate(room, scenario(first), seed=SEED, then=switches))


def assert_same(ours, theirs):
    assert [s.frame.seq for s in ours] == [s.frame.seq for s in theirs]
    for a, b in zip(ours, theirs, strict=True):
        assert a.packet.data == b.packet.data
        assert a.frame.received_ns == b.frame.received_ns
        said = [e for e in a.events if e.kind != "switched"]
        assert said == list(b.events)
        for name, pose in a.truth.recorded.world_from_object.items():
            assert np.array_equal(pose.matrix(), b.truth.recorded.world_from_object[name].matrix())
        for person, other in zip(a.avatars, b.avatars, strict=True):
            assert np.array_equal(person.world_from_head.matrix(), other.world_from_head.matrix())


def before(steps, t_s):
    return [s for s in steps if s.frame.t_ns < t_s * 1e9]


def texts(steps, source):
    return [e.text for s in steps for e in s.events if e.source == source]


@pytest.fixture(scope="module")
def whole(small_room):
    return play(small_room)


def test_what_is_played_here_has_all_that_a_switch_could_disturb(whole):
    """People in the middle of things, an object held, a bump, drops."""
    assert {"pushes chair-1", "lets go of chair-1"} <= set(texts(whole, "ann"))
    assert texts(whole, "cem") == ["takes book-1", "puts down book-1"]
    said = texts(whole, "camera-360")
    assert sum("bumped" in text for text in said) == 1
    assert {"frame 4 lost on the way", "frame 5 lost on the way"} < set(said)


def test_the_same_scenario_changes_nothing_at_ten_instants_on_the_way(small_room, whole):
    instants = (0.0, 0.2, 0.405, 0.5, 0.61, 1.0, 1.777, 2.4, 3.2, 5.39)
    assert_same(play(small_room, *((t_s, TEXT) for t_s in instants)), whole)


@pytest.mark.slow
def test_the_same_scenario_changes_nothing_at_one_instant(small_room, whole):
    assert_same(play(small_room, (2.6, TEXT)), whole)


@pytest.mark.parametrize("t_s", [pytest.param(2.0, marks=pytest.mark.slow), 2.53])
def test_frames_before_the_instant_are_the_same_and_what_is_held_is_let_go(small_room, whole, t_s):
    """`cem` carries the book then; the new list is a walk."""
    other = TEXT.replace(
        '{ do = "carry", object = "book-1", to = [1.3, 0.9] }', '{ do = "walk", to = [0.2, 1.2] }'
    )
    found = play(small_room, (t_s, other))
    assert_same(before(found, t_s), before(whole, t_s))
    assert texts(found, "cem") == ["takes book-1", "stops, lets go of book-1"]
    assert texts(found, "ann") == texts(whole, "ann")
    book, theirs = (s[-1].truth.recorded.world_from_object["book-1"] for s in (found, whole))
    assert 0.7 < book.translation[2] < 0.76
    assert np.linalg.norm(book.translation - theirs.translation) > 0.01
    head = found[-1].avatars[1].world_from_head.translation
    assert np.linalg.norm(head[:2] - (0.2, 1.2)) < 0.2


def test_a_list_that_goes_on_like_the_old_one_is_gone_on_with(small_room, whole):
    longer = TEXT.replace(
        '{ do = "stand", seconds = 0.5 }]',
        '{ do = "walk", to = [1.2, -1.2] }]',
    )
    t_s = 1.0
    found = play(small_room, (t_s, longer))
    assert_same(before(found, t_s), before(whole, t_s))
    assert texts(found, "ann") == texts(whole, "ann")
    far = found[-1].avatars[0].world_from_head.translation[:2]
    assert np.linalg.norm(far - whole[-1].avatars[0].world_from_head.translation[:2]) > 0.3


def test_who_is_missing_stops_and_does_nothing_more(small_room, whole):
    alone = HEAD + PEOPLE[PEOPLE.index('[[people]]\nid = "cem"') :] + REMOTE + FAULTS
    found = play(small_room, (0.8, alone))
    assert texts(found, "ann") == [*texts(before(whole, 0.8), "ann"), "stops"]
    after = [s.avatars[0].world_from_head.translation for s in found if s.frame.t_ns > 2e9]
    assert np.ptp(np.array(after), axis=0)[:2].max() < 0.02
    assert texts(found, "cem") == texts(whole, "cem")


def test_faults_remote_users_and_duration_are_the_new_ones(small_room, whole):
    other = HEAD.replace("5.6", "1.6") + PEOPLE + "[faults]\ndelay_ms = 900.0\nbump_s = 1.3\n"
    found = play(small_room, (1.0, other))
    assert_same(before(found, 1.0), before(whole, 1.0))
    late = [s.frame.received_ns - s.frame.t_ns for s in found if s.frame.t_ns >= 1.0e9]
    assert min(late) > 0.85e9
    assert found[-1].frame.t_ns == 1.4e9
    assert {a.user_id for a in found[-1].avatars} == {"ann", "cem"}
    bumps = [e.t_ns for s in found for e in s.events if e.kind == "bumped"]
    assert bumps == [0.6e9, 1.4e9]


def test_a_bump_that_would_have_been_earlier_does_not_come_late(small_room):
    calm = TEXT.replace("bump_s = 0.5", "")
    found = play(small_room, (1.0, TEXT), first=calm)
    assert not [e for s in found for e in s.events if e.kind == "bumped"]


@pytest.mark.parametrize(
    ("t_s", "text", "said"),
    [
        (
            1.0,
            TEXT.replace("fps = 5", "fps = 10"),
            "camera.fps = 10.0, wanted 5.0 as in small.toml",
        ),
        (1.0, TEXT.replace('"cem"', '"dan"'), "people.id = 'dan', wanted one of ann, cem"),
        (1.0, TEXT.replace("5.6", "1.0"), "duration_s = 1, wanted more than the 1 s"),
        (5.6, TEXT, "goes on at 5.6 s, wanted an instant from 0 s to before 5.6 s"),
        (-0.1, TEXT, "goes on at -0.1 s"),
        (1.0, TEXT.replace('"small"', '"attic"'), "attic"),
        (
            1.0,
            TEXT + '[[surfaces]]\nid = "board"\n'
            "corners = [[-0.5, 1.5, 1.7], [0.5, 1.5, 1.7], [0.5, 1.5, 1.0], [-0.5, 1.5, 1.0]]\n",
            "surfaces: wanted the same",
        ),
    ],
)
def test_what_cannot_change_is_refused(small_room, t_s, text, said):
    with pytest.raises(ScenarioError) as refused:
        play(small_room, (t_s, text))
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


def test_instants_come_in_order(small_room):
    with pytest.raises(ScenarioError, match="wanted an instant from 2"):
        play(small_room, (2.0, TEXT), (1.0, TEXT))


WALKS = TEXT.replace('{ do = "stand", seconds = 0.5 }', '{ do = "stand", seconds = 3.0 }')


@pytest.mark.parametrize(
    ("other", "found_s"),
    [
        (TEXT, None),
        (TEXT + "blur = { px = 3.0, from_s = 4.0 }\n", 4.0),
        (TEXT + "blur = { px = 3.0, from_s = 1.0, to_s = 1.8 }\n", None),  # all before
        (TEXT + "blur = { px = 3.0, from_s = 5.6 }\n", None),  # all after the end
        (TEXT.replace("bump_s = 0.5", "bump_s = 1.5"), None),  # it does not come late
        (TEXT.replace("bump_s = 0.5", "bump_s = 3.3"), 3.4),  # the next frame
        (TEXT.replace("drop_share = 0.1", "drop_share = 0.2"), 2.0),
        (TEXT.replace("duration_s = 5.6", "duration_s = 6.0"), 2.0),
        (TEXT.replace("[0.8, -1.0, 1.6]]", "[0.9, -1.0, 1.6]]"), 2.0),
        (TEXT.replace(", 1.58]", ", 1.5]"), None),  # where she started is past
        (WALKS, 4.5),
        (TEXT.replace(PEOPLE, ""), 2.0),
    ],
)
def test_the_first_moment_that_can_differ(other, found_s):
    """The actions are taken to begin 4.5 s apart."""
    found = first_difference_s(
        scenario(),
        scenario(other),
        from_s=2.0,
        begins_s=lambda _scenario, _id, number: 4.5 * number,
    )
    assert found == (None if found_s is None else pytest.approx(found_s))
