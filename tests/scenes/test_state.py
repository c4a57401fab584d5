import dataclasses
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenes.pose import Pose, rotation_from_vector
from scenes.state import (
    Annotation,
    Avatar,
    AvatarGone,
    LiveSurface,
    Proposal,
    SceneState,
    SharedPrimitive,
    TrackedObject,
    TrackState,
    id_of,
    is_there,
    lines_now,
    reduce_state,
)


def tracked(object_id: str, t_ns: int) -> TrackedObject:
    pose = Pose.from_yaw(0.0, (t_ns, 0, 0))
    return TrackedObject(object_id, t_ns, pose, np.eye(4), 1.0, TrackState.TRACKED, 1.0, t_ns)


CHANGES = [
    (tracked("a", 1), "objects"),
    (LiveSurface("a", np.zeros((4, 3)), (4, 3), "cam"), "surfaces"),
    (Avatar("a", "remote", Pose.identity()), "avatars"),
    (Annotation("a", "u", np.zeros((2, 3)), (1, 0, 0)), "annotations"),
    (SharedPrimitive("a", "u", "box", (1, 1, 1), (1, 0, 0), Pose.identity()), "primitives"),
    (Proposal("a", "u", "Ann", "chair", Pose.identity()), "proposals"),
]


@pytest.mark.parametrize(("change", "where"), CHANGES, ids=[w for _, w in CHANGES])
def test_a_change_makes_a_new_state_and_leaves_the_old(change, where):
    old = SceneState()
    new = reduce_state(old, change, 5)
    assert getattr(new, where) == {"a": change}
    assert (new.version, new.t_ns) == (1, 5)
    assert (old.version, old.t_ns) == (0, 0)
    assert not getattr(old, where)
    for other in ("objects", "surfaces", "avatars", "annotations"):
        if other != where:
            assert getattr(new, other) is getattr(old, other)


def test_states_cannot_be_changed_in_place():
    state = reduce_state(SceneState(), tracked("a", 1), 1)
    with pytest.raises(TypeError):
        state.objects["b"] = tracked("b", 1)  # type: ignore[index]
    with pytest.raises(dataclasses.FrozenInstanceError):
        state.version = 7  # type: ignore[misc]


def test_an_older_pose_is_ignored_and_an_equal_one_is_not():
    state = reduce_state(SceneState(), tracked("a", 10), 10)
    assert reduce_state(state, tracked("a", 9), 11) is state
    assert reduce_state(state, tracked("a", 10), 11).version == 2
    assert reduce_state(state, tracked("b", 9), 11).version == 2


@given(st.permutations(range(8)))
def test_whatever_the_order_of_arrival_the_newest_pose_wins(order):
    state, accepted = SceneState(), 0
    for t_ns in order:
        before = state
        state = reduce_state(state, tracked("a", t_ns), t_ns)
        accepted += state is not before
    assert state.objects["a"].t_ns == 7
    assert state.version == accepted
    assert state.t_ns == 7


@given(st.lists(st.tuples(st.sampled_from("abc"), st.integers(0, 50)), max_size=30))
def test_versions_grow_by_one_and_time_never_runs_back(arrivals):
    state = SceneState()
    for object_id, t_ns in arrivals:
        new = reduce_state(state, tracked(object_id, t_ns), t_ns)
        assert new.version in (state.version, state.version + 1)
        assert new.t_ns >= state.t_ns
        for key, item in state.objects.items():
            assert new.objects[key].t_ns >= item.t_ns
        state = new


def test_avatars_replace_the_one_with_their_id():
    one = Avatar("u", "local", Pose.identity())
    two = Avatar("u", "local", Pose.from_yaw(1.0))
    state = reduce_state(reduce_state(SceneState(), one, 1), two, 2)
    assert state.avatars == {"u": two}


REMOVALS = [
    (CHANGES[1], LiveSurface("a", np.zeros((0, 3)), (0, 0), "cam")),
    (CHANGES[2], AvatarGone("a")),
    (CHANGES[3], Annotation("a", "u", np.zeros((0, 3)), (1, 0, 0))),
]


@pytest.mark.parametrize(("added", "removal"), REMOVALS, ids=[a[1] for a, _ in REMOVALS])
def test_what_is_removed_is_gone_and_what_was_never_there_changes_nothing(added, removal):
    change, where = added
    state = reduce_state(SceneState(), change, 1)
    without = reduce_state(state, removal, 2)
    assert getattr(without, where) == {}
    assert (without.version, without.t_ns) == (2, 2)
    assert getattr(state, where) == {"a": change}
    assert reduce_state(without, removal, 3) is without
    assert reduce_state(without, change, 4).version == 3


def test_things_of_people_come_change_and_go():
    pose = Pose.from_yaw(0.3, (1, 2, 0))
    body = SharedPrimitive("p1/b", "p1", "box", (1, 1, 1), (1, 0, 0), pose)
    copy = Proposal("p1/c", "p1", "Ann", "chair-1", pose)
    state = reduce_state(reduce_state(SceneState(), body, 1), copy, 2)
    assert state.primitives["p1/b"] is body
    assert state.proposals["p1/c"] is copy
    assert (id_of(body), id_of(copy), is_there(body), is_there(copy)) == (
        "p1/b",
        "p1/c",
        True,
        True,
    )
    gone = reduce_state(state, replace(body, shape=None), 3)
    gone = reduce_state(gone, replace(copy, object_id=""), 4)
    assert not gone.primitives
    assert not gone.proposals
    assert gone.version == 4
    assert reduce_state(gone, replace(copy, object_id=""), 5) is gone


def test_a_carried_surface_is_seen_elsewhere():
    corners = np.eye(4, 3)
    surface = LiveSurface("tv", corners, (16, 16), "cam")
    assert surface.seen_in_world is corners
    assert replace(surface, carried_to=corners + 1).seen_in_world[0, 0] == 2


@pytest.mark.parametrize(
    ("off_m", "yaw_deg", "tilt_deg", "symmetry", "is_met"),
    [
        (0.04, 9, 0, 1, True),
        (0.06, 0, 0, 1, False),
        (0.0, 11, 0, 1, False),
        (0.0, 0, 11, 1, False),
        (0.0, 180, 0, 1, False),
        (0.0, 185, 0, 2, True),
        (0.0, 95, 0, 2, False),
        (0.0, 95, 0, 4, True),
        (0.0, -85, 5, 4, True),
        (0.0, 123, 0, 0, True),
        (0.0, 123, 12, 0, False),
    ],
)
def test_an_object_stands_as_proposed_within_5_cm_and_10_degrees(
    off_m, yaw_deg, tilt_deg, symmetry, is_met
):
    wanted = Pose.from_yaw(0.7, (1, 2, 0))
    tilt = Pose(rotation_from_vector([np.radians(tilt_deg), 0, 0]), np.zeros(3))
    turn = Pose.from_yaw(np.radians(yaw_deg), (0, 0, off_m)) @ tilt
    copy = Proposal("c", "p1", "Ann", "chair-1", wanted)
    assert copy.is_met(wanted @ turn, symmetry=symmetry) == is_met


def test_a_line_on_an_object_goes_along_with_it():
    then, now = Pose.from_yaw(0.0, (1.0, 0.0, 0.0)), Pose.from_yaw(np.pi / 2, (3.0, 1.0, 0.0))
    points = np.array([[1.5, 0.0, 0.4], [1.5, 0.2, 0.4]])
    line = Annotation("a", "p1", points, (1.0, 0.0, 0.0), "chair", then)
    state = reduce_state(SceneState(), line, 0)
    assert lines_now(state)[0] is line  # nobody follows the chair
    track = TrackedObject("chair", 1, now, np.eye(4), 1.0, TrackState.TRACKED, 1.0, 0)
    (moved,) = lines_now(reduce_state(state, track, 1))
    assert np.allclose(moved.points_in_world, [[3.0, 1.5, 0.4], [2.8, 1.5, 0.4]])
    assert state.annotations["a"] is line
