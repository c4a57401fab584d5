"""`benchmarks.random_rooms.room`: the same by seed, nothing in each other, all inside."""

import numpy as np
import pytest

from benchmarks.random_rooms.outlines import outline_of, overlaps, upright
from benchmarks.random_rooms.placing import is_free, rearranged
from benchmarks.random_rooms.room import LENS_SIZES_PX, random_items, random_room
from scenes.pose import Pose

SEEDS = (100, 103)


@pytest.fixture(scope="module", params=SEEDS)
def room(request):
    return random_room(request.param)


def outlines(room, poses):
    return {name: upright(room.movables[name].box_m, pose) for name, pose in poses.items()}


def scanned(room):
    return {item.object_id: item.world_from_object for item in room.scanned.objects}


def test_the_same_seed_gives_the_same_room(room):
    again = random_room(room.seed)
    for a, b in ((room.scanned, again.scanned), (room.live, again.live)):
        assert np.array_equal(a.static[0].vertices, b.static[0].vertices)
        assert np.array_equal(a.static[0].texture, b.static[0].texture)
        assert np.array_equal(a.light_direction, b.light_direction)
        for one, other in zip(a.objects, b.objects, strict=True):
            assert one.object_id == other.object_id
            assert np.array_equal(one.meshes[0].texture, other.meshes[0].texture)
            assert np.array_equal(one.world_from_object.matrix(), other.world_from_object.matrix())
    assert room.lens_px == again.lens_px


def test_the_room_is_as_large_and_as_full_as_said(room):
    assert room.lens_px in LENS_SIZES_PX
    assert 5 <= len(room.movables) <= 10
    low, high = room.scanned.footprint_m
    assert (high - low > 3.0).all()
    assert (high - low < 7.0).all()


def test_the_live_light_differs_from_the_scan_s_but_not_by_much(room):
    scan, live = (r.static[0].texture.astype(float) for r in (room.scanned, room.live))
    assert scan.shape == live.shape
    assert 0.2 < np.abs(scan - live).mean() < 25.0
    assert float(room.scanned.light_direction @ room.live.light_direction) < 1.0


def test_pictures_of_the_room_are_neither_black_nor_white(room):
    # Rows of the texture that no surface uses are grey.
    assert 60 < np.median(room.live.static[0].texture) < 235


@pytest.mark.parametrize("arrangement", [0, 1, 2])
def test_nothing_stands_in_anything_else(room, arrangement):
    poses = scanned(room)
    if arrangement:
        rng = np.random.default_rng(arrangement)
        poses = rearranged(room.movables, poses, room.ground, rng, share=0.5)
    standing = outlines(room, poses)
    solids = [outline_of(box, Pose.identity()) for box in room.scanned.solids]
    names = list(standing)
    for k, name in enumerate(names):
        assert standing[name].is_inside(*room.scanned.footprint_m)
        others = [standing[n] for n in names[k + 1 :]]
        assert not any(overlaps(standing[name], other, 0.0) for other in (*others, *solids))


def test_every_object_stands_on_something(room):
    heights = {0.0, *(stand.z for stand in room.ground.stands)}
    for pose in scanned(room).values():
        assert float(pose.translation[2]) in heights
        assert pose.rotation[2, 2] == pytest.approx(1.0)


def test_an_arrangement_moves_some_objects_and_leaves_others(room):
    before = scanned(room)
    rng = np.random.default_rng(5)
    after = rearranged(room.movables, before, room.ground, rng, share=0.5)
    moved = [n for n in before if not np.array_equal(before[n].matrix(), after[n].matrix())]
    assert 0 < len(moved) < len(before)
    name = moved[0]
    taken = [o for n, o in outlines(room, after).items() if n != name]
    assert is_free(room.movables[name], after[name], room.ground, taken)


def test_twins_share_a_kind_and_others_do_not():
    seen = set()
    for seed in range(30):
        items = random_items(np.random.default_rng(seed))
        twins = [name for name in items if name.endswith("-1")]
        seen.add(len(twins))
        for name in twins:
            assert items[name] is items[f"{name[:-2]}-2"]
        assert 6 <= len(items) <= 10
    assert {0, 1} <= seen


def test_highlights_of_a_shiny_object_follow_the_camera():
    for seed in range(40):
        room = random_room_with_gloss(seed)
        if room is not None:
            break
    name = next(n for n, item in room.movables.items() if item.gloss > 0)
    a = room.seen_at(name, "a", Pose.from_yaw(0.0, (0.0, 1.0, 0.0)))
    b = room.seen_at(name, "b", Pose.from_yaw(2.0, (0.0, 1.0, 0.0)))
    assert not np.array_equal(a.meshes[0].texture, b.meshes[0].texture)
    assert np.array_equal(a.meshes[0].vertices, b.meshes[0].vertices)


def random_room_with_gloss(seed):
    """The room of a seed near 100 if something in it shines."""
    room = random_room(100 + seed)
    return room if any(item.gloss > 0 for item in room.movables.values()) else None


def test_a_negative_seed_is_refused():
    with pytest.raises(ValueError, match="wanted a seed of 0 or more"):
        random_room(-1)
