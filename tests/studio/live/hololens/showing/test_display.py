"""A session's state as items on a headset's display."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from devices.hololens.display_list import MAX_ITEMS, Label, Shape, Solid
from scenes.frames import look_at
from scenes.pose import Pose
from scenes.state import (
    Annotation,
    Avatar,
    Proposal,
    SceneState,
    SharedPrimitive,
    TrackedObject,
    TrackState,
)
from studio.live.hololens.showing.display import (
    MET,
    PROPOSED,
    STATE_COLOURS,
    Seen,
    items_of,
    steadied,
)

DEVICE_FROM_WORLD = Pose.from_yaw(0.6, (0.5, -0.2, -1.4))
MODEL = SimpleNamespace(box_m=(0.4, 0.5, 0.8), name="chair")
HEAD = look_at(np.array([1.0, 1.0, 1.6]), np.array([0.0, 0.0, 1.4]))
QUEST = Avatar(
    "p1",
    "remote",
    HEAD,
    (np.zeros((25, 3)), np.ones((1, 3))),
    np.array([[1.0, 1, 1.3], [0.2, 0.1, 0.2]]),
    "Bea",
)


def seen(met=frozenset(), eye=None):
    return Seen(DEVICE_FROM_WORLD, {"chair-1": MODEL}, met, "hololens", eye)


def items(state=None, avatars=(), **how):
    return items_of(state or SceneState(), avatars, seen=seen(**how))


def track(state=TrackState.TRACKED):
    pose = Pose.from_yaw(0.3, (0.2, 0.1, 0.0))
    return TrackedObject("chair-1", 0, pose, np.eye(4), 1.0, state, 1.0, 0)


def test_a_remote_person_has_head_hands_ray_and_name():
    found = items(avatars=[QUEST])
    assert found["person:p1:head"].shape is Shape.SPHERE
    assert np.allclose(
        found["person:p1:head"].world_from_item.translation, DEVICE_FROM_WORLD @ HEAD.translation
    )
    assert sum(name.startswith("person:p1:hand0.") for name in found) == 11
    assert sum(name.startswith("person:p1:hand1.") for name in found) == 1
    end = found["person:p1:ray-end"].world_from_item.translation
    assert np.allclose(end, DEVICE_FROM_WORLD @ QUEST.ray[1])
    assert found["person:p1:name"].text == "Bea"


def test_the_wearer_does_not_see_themselves():
    assert items(avatars=[Avatar("hololens", "local", HEAD)]) == {}


def test_a_name_turns_to_who_reads_it():
    eye = DEVICE_FROM_WORLD @ np.array([-2.0, 0.0, 1.6])
    label = items(avatars=[QUEST], eye=eye)["person:p1:name"]
    towards = eye - label.world_from_item.translation
    towards[2] = 0.0
    front = -label.world_from_item.rotation[:, 1]
    assert front @ towards / np.linalg.norm(towards) > math.cos(math.radians(9))


def test_an_object_has_an_outline_in_the_colour_of_its_state():
    found = items(SceneState(objects={"chair-1": track(TrackState.LOST)}))
    assert len(found) == 12
    assert {item.colour for item in found.values()} == {STATE_COLOURS[TrackState.LOST]}


def test_a_proposal_turns_green_once_it_is_met():
    proposal = Proposal("p1/a", "p1", "Bea", "chair-1", Pose.identity())
    state = SceneState(proposals={"p1/a": proposal})
    before, after = items(state), items(state, met=frozenset({"p1/a"}))
    assert {item.colour for item in before.values()} == {PROPOSED}
    assert {item.colour for item in after.values()} == {MET}
    assert "chair" in before["proposal:p1/a:words"].text
    assert "Bea" in before["proposal:p1/a:words"].text


@pytest.mark.parametrize("shape", ["box", "sphere", "cylinder", "arrow"])
def test_every_primitive_stands_on_its_base(shape):
    primitive = SharedPrimitive("p1/b", "p1", shape, (0.4, 0.2, 0.2), (1, 0, 0), Pose.identity())
    found = items(SceneState(primitives={"p1/b": primitive}))
    middle = np.mean([i.world_from_item.translation for i in found.values()], axis=0)
    assert abs((DEVICE_FROM_WORLD.inverse() @ middle)[2] - 0.1) < 1e-9
    assert all(isinstance(item, Solid) for item in found.values())


def test_lines_are_what_is_left_out_of_too_much():
    angle = np.linspace(0, 40 * np.pi, 4000)
    wild = np.stack([np.cos(angle), np.sin(angle), angle / 50], axis=1)
    state = SceneState(
        annotations={"l": Annotation("l", "p1", wild, (1, 1, 1))}, objects={"chair-1": track()}
    )
    found = items(state, [QUEST])
    assert len(found) == MAX_ITEMS
    assert "person:p1:head" in found
    assert "object:chair-1:edge11" in found


def test_what_hardly_moves_stays_the_very_same():
    state = SceneState(objects={"chair-1": track()})
    before = items(state)
    trembling = items_of(
        state,
        (),
        seen=Seen(
            Pose.from_yaw(0.6001, (0.5001, -0.2, -1.4)), {"chair-1": MODEL}, frozenset(), "h"
        ),
    )
    kept = steadied(before, trembling)
    assert all(kept[name] is before[name] for name in before)
    moved = items_of(
        state,
        (),
        seen=Seen(Pose.from_yaw(0.6, (0.51, -0.2, -1.4)), {"chair-1": MODEL}, frozenset(), "h"),
    )
    assert not any(steadied(before, moved)[name] is before[name] for name in before)
    label = {"a": Label("x", Pose.identity())}
    assert steadied(label, {"a": Label("y", Pose.identity())})["a"].text == "y"


def test_words_over_a_shape_say_whose_it_is_even_where_it_lies_on_its_side():
    lying = Pose(np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]), np.array([1.0, 0, 0.5]))
    one = SharedPrimitive("p1/a", "p1", "box", (0.2, 0.6, 0.3), (1, 0, 0), lying)
    state = SceneState(primitives={"p1/a": one})
    assert "primitive:p1/a:words" not in items(state, [QUEST])
    passed = replace(seen(), passed=frozenset({"p1/a"}))
    label = items_of(state, [QUEST], seen=passed)["primitive:p1/a:words"]
    assert label.text == "Bea has it"
    # Its depth of 0.6 m is what stands up: 0.3 m above its middle.
    place = DEVICE_FROM_WORLD.inverse() @ label.world_from_item.translation
    assert place[2] == pytest.approx(0.5 + 0.3 + 0.08)
    own = SceneState(primitives={"p1/a": replace(one, user_id="hololens")})
    assert items(own)["primitive:p1/a:words"].text == "yours"
