import numpy as np
import pytest

from benchmarks.evaluate.protocols.ten_objects import scanned_poses, shuffled, ten_objects
from benchmarks.evaluate.tables.recover import judged
from scenes.pose import Pose
from scenes.state import TrackState


@pytest.fixture(scope="module")
def scanned():
    return ten_objects()


@pytest.fixture(scope="module")
def room(scanned):
    return scanned[0]


def by_id(found):
    return {item.object_id: item for item in found}


def test_ten_different_objects_that_the_scan_knows_too(scanned):
    room, scene = scanned
    ids = [item.object_id for item in room.objects]
    assert len(set(ids)) == 10
    assert [model.object_id for model in scene.objects] == ids
    for item, model in zip(room.objects, scene.objects, strict=True):
        apart = item.world_from_object.translation - model.world_from_object.translation
        assert np.linalg.norm(apart) < 0.01
        assert item.kind == model.kind


def test_everything_right(room, answer):
    found = judged(room, answer(scanned_poses(room)))
    assert len(found) == 10
    assert all(item.right and item.own_place for item in found)


def test_exchanged_twins_are_right_but_not_at_their_own_place(room, answer):
    poses = dict(scanned_poses(room))
    seen = answer(poses)
    first, second = seen.tracks["chair-1"], seen.tracks["chair-2"]
    seen.tracks["chair-1"], seen.tracks["chair-2"] = second, first
    found = by_id(judged(room, seen))
    for name in ("chair-1", "chair-2"):
        assert found[name].right
        assert not found[name].own_place


def test_two_tracks_on_one_chair_leave_the_other_wrong(room, answer):
    poses = dict(scanned_poses(room))
    seen = answer(poses)
    seen.tracks["chair-2"] = seen.tracks["chair-1"]
    found = judged(room, seen)
    assert sum(item.right for item in found) == 9


def test_a_lost_track_says_that_it_may_be_wrong(room, answer):
    seen = answer(scanned_poses(room), off={"mug-1": (0.5, 0.0)}, states={"mug-1": TrackState.LOST})
    mug = by_id(judged(room, seen))["mug-1"]
    assert not mug.right
    assert mug.flagged


def test_a_turned_round_stool_is_right_and_a_turned_chair_is_not(room, answer):
    seen = answer(scanned_poses(room), off={"stool-1": (0.0, 1.0), "chair-1": (0.0, 1.0)})
    found = by_id(judged(room, seen))
    assert found["stool-1"].right
    assert not found["chair-1"].right


@pytest.mark.parametrize("seed", range(3))
def test_shuffled_things_stand_on_something_and_apart(room, seed):
    poses = shuffled(room, np.random.default_rng([seed, 10]))
    assert poses.keys() == {item.object_id for item in room.objects}
    for item in room.objects:
        place = poses[item.object_id].translation
        assert place[2] in ((0.0,) if item.box_m[2] > 0.3 else (0.5, 0.74))
        moved = place - item.world_from_object.translation
        assert np.linalg.norm(moved) > 0.01
    for i, a in enumerate(room.objects):
        for b in room.objects[:i]:
            gap = poses[a.object_id].translation - poses[b.object_id].translation
            radius = 0.5 * (np.hypot(*a.box_m[:2]) + np.hypot(*b.box_m[:2]))
            assert np.linalg.norm(gap) > 0.8 * radius
    assert isinstance(poses["mug-1"], Pose)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_no_object_of_a_layout_stands_before_another(room, seed):
    poses = shuffled(room, np.random.default_rng(seed))
    eye = room.world_from_rig.translation
    seen = []
    for item in room.objects:
        x, y, _ = poses[item.object_id].translation - eye
        half_width = 0.5 * float(np.hypot(*item.box_m[:2]))
        seen.append((float(np.arctan2(y, x)), float(np.arcsin(half_width / np.hypot(x, y)))))
    for k, (azimuth, half) in enumerate(seen):
        for other, other_half in seen[:k]:
            assert abs(azimuth - other) > half + other_half
