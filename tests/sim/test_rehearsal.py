"""A whole small session: same seed, same bytes; truth, faults and pose error as the file says."""

from __future__ import annotations

import math

import numpy as np
import pytest

from scenes.pose import rotation_angle
from sim.rehearsal import simulate
from sim.scenarios.scenario import parse_scenario
from sim.tables import ScenarioError

SCENARIO = """
room = "small"
duration_s = 1.8
[camera]
fps = 10
lens_size_px = 128
bitrate_mbps = 2.0
[[people]]
id = "ann"
start = [-1.05, 1.58]
facing_deg = -60.0
actions = [{ do = "push", object = "chair-1", to = [-0.3, 0.2] }]
[[remote]]
id = "ben"
path = [[0.5, -1.5, 1.6], [0.8, -1.0, 1.6]]
points_at = ["chair-1", "book-1"]
[faults]
dropped_frames = [4, 5]
"""


@pytest.fixture(scope="module")
def scenario():
    return parse_scenario(SCENARIO, source="small.toml")


@pytest.fixture(scope="module")
def steps(small_room, scenario):
    return list(simulate(small_room, scenario, seed=7))


def test_the_same_seed_gives_the_same_bytes(small_room, scenario, steps):
    again = list(simulate(small_room, scenario, seed=7))
    other = next(iter(simulate(small_room, scenario, seed=8)))
    assert len(again) == len(steps)
    for a, b in zip(steps, again, strict=True):
        assert a.packet.data == b.packet.data
        assert all(
            np.array_equal(x, y) for x, y in zip(a.frame.images, b.frame.images, strict=True)
        )
        assert a.frame.received_ns == b.frame.received_ns
        assert a.events == b.events
        for name, pose in a.truth.recorded.world_from_object.items():
            assert np.array_equal(pose.matrix(), b.truth.recorded.world_from_object[name].matrix())
    assert other.packet.data != steps[0].packet.data


def test_frames_come_in_order_and_lost_ones_leave_a_gap(steps):
    assert [s.frame.seq for s in steps] == [0, 1, 2, 3, *range(6, 18)]
    for s in steps:
        assert s.frame.t_ns == s.frame.seq * 100_000_000 == s.packet.t_ns == s.truth.recorded.t_ns
        assert s.frame.received_ns > s.frame.t_ns
        assert [image.shape for image in s.frame.images] == [(128, 128, 3)] * 2
        assert s.packet.stream_id == s.frame.stream_id
    assert steps[0].packet.keyframe
    dropped = [e.text for s in steps for e in s.events if e.kind == "dropped"]
    assert dropped == ["frame 4 lost on the way", "frame 5 lost on the way"]


def test_the_known_camera_pose_is_off_by_what_the_scenario_says(steps):
    known, true = steps[0].frame.world_from_rig, steps[0].truth.recorded.world_from_rig
    assert known is not None
    error = rotation_angle(known.rotation @ true.rotation.T)
    assert math.degrees(error) == pytest.approx(0.2, abs=1e-6)
    assert np.linalg.norm(known.translation - true.translation) == pytest.approx(0.005)


def test_truth_says_what_moved_and_where_it_is_seen(small_room, steps):
    first, last = steps[0].truth.recorded, steps[-1].truth.recorded
    assert first.moved == frozenset()
    assert last.moved == {"chair-1"}
    assert set(last.visible_fraction) == {"chair-1", "book-1"}
    assert all(0.0 <= share <= 1.0 for share in last.visible_fraction.values())
    masks = steps[-1].truth.masks
    assert masks is not None
    front, back = masks["chair-1"]
    assert front.shape == (128, 128)
    assert front.any()
    assert not back.any()
    lens = steps[-1].frame.rig.lenses[0]
    seat = last.world_from_object["chair-1"] @ np.array([[0.0, 0.0, 0.45]])
    (pixel,), _ = lens.project(last.world_from_rig.inverse() @ seat)
    rows, columns = np.nonzero(front)
    assert np.abs(pixel - [columns.mean(), rows.mean()]).max() < 8.0


def test_avatars_have_heads_that_look_somewhere(steps):
    local, remote = steps[0].avatars
    assert (local.user_id, local.role, len(local.hands)) == ("ann", "local", 2)
    assert (remote.user_id, remote.role) == ("ben", "remote")
    assert 1.45 < local.world_from_head.translation[2] < 1.85
    assert abs(local.world_from_head.rotation[2, 0]) < 0.2
    assert local.world_from_head.rotation[2, 1] < -0.5
    assert remote.ray is not None


def test_a_scenario_for_another_room_is_refused(small_room, scenario):
    other = parse_scenario(SCENARIO.replace("small", "attic", 1), source="attic.toml")
    with pytest.raises(ScenarioError, match="attic"):
        simulate(small_room, other, seed=0)


def test_a_bump_moves_the_camera_and_not_what_its_marker_says(small_room, steps):
    text = SCENARIO.replace("duration_s = 1.8", "duration_s = 0.6")
    text += "bump_s = 0.2\nbump_deg = 8.0\nbump_cm = 3.0\n"
    bumped = list(simulate(small_room, parse_scenario(text, source="bump.toml"), seed=7))
    assert [e.text for s in bumped for e in s.events if e.kind == "bumped"] == [
        "camera bumped: turned by 8°, shifted by 3 cm"
    ]
    before, after = (step.truth.recorded.world_from_rig for step in bumped[1:3])
    turned = rotation_angle(after.rotation @ before.rotation.T)
    assert math.degrees(turned) == pytest.approx(8.0, abs=1e-6)
    assert np.linalg.norm(after.translation - before.translation) == pytest.approx(0.03)
    assert bumped[-1].truth.recorded.world_from_rig is after
    assert bumped[-1].frame.world_from_rig is bumped[0].frame.world_from_rig
    assert bumped[1].packet.data == steps[1].packet.data
    then, still, moved = (s.frame.images[0].astype(float) for s in (steps[1], steps[2], bumped[2]))
    assert np.abs(moved - then).mean() > 2 * np.abs(still - then).mean()


def test_what_is_drawn_comes_with_the_frames(small_room):
    text = SCENARIO.replace("duration_s = 1.8", "duration_s = 1.4").replace(
        '[{ do = "push", object = "chair-1", to = [-0.3, 0.2] }]',
        '[{ do = "draw", points = [[0.0, 0.0, 1.2], [0.2, 0.0, 1.2]], speed_m_s = 1.0 }]',
    )
    text = text.replace(
        "[faults]",
        "draws = [{ points = [[0, 1, 1], [1, 1, 1]], from_s = 0.25, seconds = 0.5 }]\n[faults]",
    )
    drawn = list(simulate(small_room, parse_scenario(text, source="draw.toml"), seed=7))
    last = {line.annotation_id: line for step in drawn for line in step.annotations}
    assert last["ann-1"].points_in_world == pytest.approx(np.array([[0, 0, 1.2], [0.2, 0, 1.2]]))
    assert last["ben-1"].points_in_world[-1] == pytest.approx([1, 1, 1])
    assert sum(bool(step.annotations) for step in drawn) < len(drawn)
    assert any(step.avatars[0].ray is not None for step in drawn)


def test_what_the_sensor_gave_is_there_beside_what_was_decoded(steps):
    for step in steps[:3]:
        for taken, decoded in zip(step.taken, step.frame.images, strict=True):
            assert taken.shape == decoded.shape
            assert 0 < np.abs(taken.astype(int) - decoded.astype(int)).mean() < 4.0


def test_keyframes_are_as_far_apart_as_is_asked(small_room, scenario):
    played = simulate(small_room, scenario, seed=7, keyframe_interval=3)
    assert [step.packet.keyframe for step, _ in zip(played, range(4), strict=False)] == [
        *(True, False, False, True)
    ]
