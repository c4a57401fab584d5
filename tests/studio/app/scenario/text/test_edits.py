"""Edits of a scenario's text change what they are asked to change and no other byte."""

import tomllib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.scenarios.scenario import SCENARIO_FOLDER, parse_scenario
from studio.app.scenario.fields import ACTION_FIELDS, FAULT_FIELDS, new_values
from studio.app.scenario.text import edits
from studio.app.scenario.text.toml_spans import EditError, block_of, span_of

SHIPPED = {path.stem: path.read_text() for path in sorted(SCENARIO_FOLDER.glob("*.toml"))}
ODD = """# Two people, written by hand.
  room = "lab"   # where
duration_s = 12   # seconds

[ camera ]
fps = 10 # a second

# Ann comes first.
[[people]]
id = "ann # not a comment"
start = [ -1.0 ,  2.0 ] # by the door
actions = [
    # first she waits
    { do = "stand", seconds = 1 }, # a moment
    { do = "push", object = "chair-1", to = [ 0.5, 0.25 ] }   # no comma here
    ,
    { do = "walk", to = [1.0, 1.5] }
]

# Ben comes later.
[[people]]
id = "ben"
start = [0.9, -1.2]

[[people.actions]]
do = "stand" # he waits
seconds = 2.0

[[people.actions]]
do = "walk"
to = [1.0, -1.0]

# What goes wrong.
[faults]
drop_share = 0.1 # rarely

[[faults.blur]]
px = 2.0
[[faults.blur]]
px = 3.0 # later
from_s = 6.0
"""
TEXTS = {**SHIPPED, "odd": ODD}
LONG = ("lab-layout", "lab-rearrange", "tangram-lesson")
NAMES = [pytest.param(name, marks=[pytest.mark.slow] * (name in LONG)) for name in TEXTS]
METRES = st.floats(-2.0, 2.0).map(lambda v: round(v, 3))
OBJECTS, PEOPLE = ("chair-1", "book-1"), ("ben",)


def parsed(text):
    return parse_scenario(text, source="test.toml")


def comments(text):
    return [line[line.index("#") :] for line in text.splitlines() if "#" in line]


def only_within(before, after, start, end):
    """Whether all that differs lies within `start..end` of the text before."""
    tail = len(before) - end
    return before[:start] == after[:start] and (not tail or before[-tail:] == after[-tail:])


@pytest.mark.parametrize("name", NAMES)
def test_every_value_is_found_where_it_is_written(name):
    text = TEXTS[name]

    def walk(value, path):
        items = value.items() if isinstance(value, dict) else enumerate(value)
        for key, item in items:
            here = (*path, key)
            if isinstance(item, dict | list):
                walk(item, here)
            else:
                span = span_of(text, here)
                assert tomllib.loads(f"v = {text[span.start : span.end]}")["v"] == item

    walk(tomllib.loads(text), ())


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=8)
@given(x=METRES, y=METRES)
def test_a_person_moves_and_nothing_else(name, x, y):
    text = TEXTS[name]
    person = parsed(text).people[-1]
    moved = edits.with_person_at(text, person.person_id, x, y)
    index = edits.person_index(text, person.person_id)
    span = span_of(text, ("people", index, "start"))
    assert parsed(moved).people[-1].start == (x, y)
    assert only_within(text, moved, span.start, span.end)
    assert edits.with_person_at(text, person.person_id, *person.start) == text


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=15)
@given(data=st.data())
def test_actions_are_put_in_moved_and_taken_out(name, data):
    text = TEXTS[name]
    person = parsed(text).people[data.draw(st.integers(0, len(parsed(text).people) - 1))]
    count = len(person.actions)
    do = data.draw(st.sampled_from([d for d in ACTION_FIELDS if d != "draw"]))
    values = {"do": do, **new_values(ACTION_FIELDS[do], objects=OBJECTS, people=PEOPLE, x=1, y=0)}
    at = data.draw(st.integers(0, count))
    added = edits.with_action(text, person.person_id, at, values)
    (now,) = [p for p in parsed(added).people if p.person_id == person.person_id]
    assert now.actions[:at] + now.actions[at + 1 :] == person.actions
    assert comments(added) == comments(text)
    back = edits.without_action(added, person.person_id, at)
    assert parsed(back) == parsed(text)
    assert comments(back) == comments(text)
    index, to = (data.draw(st.integers(0, count - 1)) for _ in range(2))
    moved = edits.with_action_moved(text, person.person_id, index, to)
    order = list(person.actions)
    order.insert(to, order.pop(index))
    (now,) = [p for p in parsed(moved).people if p.person_id == person.person_id]
    assert list(now.actions) == order
    assert sorted(comments(moved)) == sorted(comments(text))


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("fault", FAULT_FIELDS)
def test_every_fault_is_added_changed_and_removed(name, fault):
    text = edits.without_fault(TEXTS[name], fault)
    text = edits.without_fault(text, fault)
    values = new_values(FAULT_FIELDS[fault], objects=OBJECTS, people=PEOPLE, x=0.5, y=0.5)
    added = edits.with_fault(text, fault, values)
    assert parsed(added).faults != parsed(text).faults
    number = next(f for f in FAULT_FIELDS[fault] if f.kind in ("number", "count"))
    wanted = int(number.high) if number.kind == "count" else number.high
    changed = edits.with_fault_value(added, fault, 0, number.key, wanted)
    (line,) = [line for line in edits.faults_of(changed) if line.name == fault]
    assert line.values[number.key] == wanted
    back = edits.without_fault(changed, fault)
    assert parsed(back).faults == parsed(text).faults
    assert back.startswith(text.rstrip("\n"))


def test_all_kinds_of_the_simulator_have_a_form():
    from sim.faults.settings import LINES, NUMBERS
    from sim.scenarios.actions import ACTION_NAMES

    assert set(ACTION_FIELDS) == set(ACTION_NAMES.values())
    assert set(FAULT_FIELDS) == {kind.name for kind in (*NUMBERS, *LINES)}


@pytest.mark.parametrize("name", NAMES)
def test_people_come_and_go(name):
    text = TEXTS[name]
    added = edits.with_person(text, "zoe", 0.5, -0.5)
    assert [p.person_id for p in parsed(added).people][-1] == "zoe"
    assert comments(added) == comments(text)
    assert parsed(edits.without_person(added, "zoe")) == parsed(text)
    with pytest.raises(EditError, match="zoe"):
        edits.with_person(added, "zoe", 0.0, 0.0)
    with pytest.raises(EditError, match=r"nobody.*wanted one of"):
        edits.without_person(text, "nobody")


def test_comments_of_the_next_person_stay_when_one_goes():
    left = edits.without_person(ODD, "ann # not a comment")
    assert "# Ben comes later." in left
    assert "# Ann comes first." not in left
    assert left.startswith(ODD[: block_of(ODD, ("people", 0)).start])


@pytest.mark.parametrize("name", SHIPPED)
def test_remote_paths_surfaces_and_camera(name):
    text = SHIPPED[name]
    remote = parsed(text).remote[0]
    moved = edits.with_remote_point(text, remote.user_id, 0, (0.25, -0.75, 1.5))
    assert parsed(moved).remote[0].path == ((0.25, -0.75, 1.5), *remote.path[1:])
    longer = edits.with_new_remote_point(text, remote.user_id, 1, (0.0, 0.0, 1.6))
    assert edits.without_remote_point(longer, remote.user_id, 1) == text
    corners = [[0, 0, 1], [1, 0, 1], [1, 0, 0], [0, 0, 0]]
    surface = edits.with_surface(text, "new", corners)
    assert parsed(edits.without_surface(surface, "new")) == parsed(text)
    camera = edits.with_camera(text, fps=7.5, position=[0.0, 0.5, 1.4], facing_deg=30.0)
    assert parsed(camera).camera.position == (0.0, 0.5, 1.4)
    assert comments(camera) == comments(text)


@given(seconds=st.floats(0.1, 3600.0))
def test_a_whole_number_stays_one_and_others_are_rounded(seconds):
    changed = edits.with_duration(ODD, seconds)
    assert parsed(changed).duration_s == pytest.approx(seconds, abs=1e-4)
    assert edits.with_duration(ODD, 30.0) == ODD.replace("duration_s = 12 ", "duration_s = 30 ")


def test_what_cannot_be_edited_is_refused_by_name():
    with pytest.raises(EditError, match="not TOML"):
        edits.with_duration("duration_s = = 3", 4.0)
    with pytest.raises(EditError, match=r"camera.*key by key"):
        edits.with_camera('room = "lab"\nduration_s = 3\ncamera.fps = 5\n', facing_deg=1.0)
    with pytest.raises(EditError, match="no fault 'fog'"):
        edits.with_fault(ODD, "fog", {})


def test_scenarios_without_a_newline_or_faults_take_them():
    bare = 'room = "lab"\nduration_s = 3.0'
    text = edits.with_person(edits.with_fault(bare, "exposure", {"ev": 1.0}), "ann", 0.0, 0.0)
    assert parsed(text).people[0].person_id == "ann"
    assert text.startswith(bare)
