"""Each fault in a small session: what arrives differs as it should, and the truth says so."""

from __future__ import annotations

import numpy as np
import pytest

from sim.rehearsal import simulate
from sim.scenarios.scenario import parse_scenario

SCENARIO = """
room = "small"
duration_s = 1.0
[camera]
fps = 10
lens_size_px = 128
bitrate_mbps = 4.0
[[people]]
id = "ann"
start = [-1.05, 1.58]
facing_deg = -60.0
actions = [{ do = "push", object = "chair-1", to = [-0.3, 0.2] }]
[faults]
"""


def played(room, faults, seed=7):
    scenario = parse_scenario(SCENARIO + faults, source="faults.toml")
    return list(simulate(room, scenario, seed=seed))


def brightness(step, channel=slice(None)):
    return float(step.frame.images[0][..., channel].mean())


def said(steps):
    return [(e.t_ns / 1e9, e.text) for s in steps for e in s.events if e.kind == "fault"]


@pytest.fixture(scope="module")
def plain(small_room):
    return played(small_room, "")


def test_without_faults_the_truth_has_none(plain):
    assert len(plain) == 10
    assert all(dict(s.truth.recorded.faults) == {} for s in plain)
    assert all(s.truth.recorded.captured_ns is None for s in plain)
    assert said(plain) == []


def test_a_frozen_picture_comes_again_and_time_goes_on(small_room, plain):
    steps = played(small_room, "freeze = { from_s = 0.3, to_s = 0.6 }")
    drawn = [s.truth.masks["chair-1"][0] for s in steps]
    assert all((drawn[k] == drawn[2]).all() for k in (3, 4, 5))
    differences = [
        np.abs(a.frame.images[0].astype(int) - b.frame.images[0].astype(int)).mean()
        for a, b in zip(steps, plain, strict=True)
    ]
    assert max(differences[:3]) == 0.0
    assert min(differences[3:6]) > 0.0
    assert [s.frame.t_ns for s in steps] == [s.frame.t_ns for s in plain]
    for a, b in zip(steps, plain, strict=True):
        true, free = (s.truth.recorded.world_from_object["chair-1"] for s in (a, b))
        assert np.array_equal(true.matrix(), free.matrix())
    assert ["freeze" in s.truth.recorded.faults for s in steps] == [3 <= k < 6 for k in range(10)]
    assert said(steps) == [
        (0.3, "the camera's picture is frozen"),
        (0.6, "no more: the camera's picture is frozen"),
    ]


def test_exposure_and_white_balance_change_the_light_while_they_last(small_room, plain):
    darker = played(small_room, "exposure = { ev = -1, from_s = 0.5 }")
    assert brightness(darker[4]) == brightness(plain[4])
    assert brightness(darker[5]) < 0.8 * brightness(plain[5])
    assert darker[5].truth.recorded.faults == {"exposure": -1.0}
    warmer = played(small_room, "white_balance = { warmth = 0.3 }")
    assert brightness(warmer[0], 0) > 1.05 * brightness(plain[0], 0)
    assert brightness(warmer[0], 2) < 0.95 * brightness(plain[0], 2)
    assert brightness(warmer[0], 1) == pytest.approx(brightness(plain[0], 1), rel=0.02)


def test_blur_takes_detail_away(small_room, plain):
    def detail(step):
        picture = step.frame.images[0].astype(float)
        return np.abs(np.diff(picture[40:88, 40:88], axis=1)).mean()

    blurred = played(small_room, "blur = { px = 3, to_s = 0.2 }")
    assert detail(blurred[0]) < 0.7 * detail(plain[0])
    assert detail(blurred[9]) > 0.8 * detail(plain[9])


def test_a_hidden_code_hides_the_camera_s_pose_for_a_while(small_room, plain):
    steps = played(small_room, "hidden_code = { to_s = 0.3 }")
    assert [s.frame.world_from_rig is None for s in steps] == [k < 3 for k in range(10)]
    assert all(a.packet.data == b.packet.data for a, b in zip(steps, plain, strict=True))
    assert np.array_equal(
        steps[0].truth.recorded.world_from_rig.matrix(),
        plain[0].truth.recorded.world_from_rig.matrix(),
    )


def test_bursts_take_frames_in_a_row(small_room):
    steps = played(small_room, "burst = { lasts_s = 0.2, every_s = 0.5, from_s = 0.1 }")
    assert [s.frame.seq for s in steps] == [0, 3, 4, 5, 8, 9]
    assert sum(e.kind == "dropped" for s in steps for e in s.events) == 4


def test_a_drifting_clock_stamps_frames_wrongly_and_the_truth_knows_both(small_room, plain):
    steps = played(small_room, "clock_drift_ppm = 1000")
    for k, (a, b) in enumerate(zip(steps, plain, strict=True)):
        assert a.frame.t_ns == a.packet.t_ns == a.truth.recorded.t_ns == k * 100_100_000
        if k:
            assert a.truth.recorded.captured_ns == b.frame.t_ns
        assert a.frame.received_ns == b.frame.received_ns
        assert a.packet.data == b.packet.data


def test_without_a_headset_the_avatar_is_gone_and_the_person_is_not(small_room, plain):
    steps = played(small_room, 'headset_off = { person = "ann", from_s = 0.2, to_s = 0.5 }')
    assert [len(s.avatars) for s in steps] == [1, 1, 0, 0, 0, 1, 1, 1, 1, 1]
    assert all(a.packet.data == b.packet.data for a, b in zip(steps, plain, strict=True))


def test_an_occluder_hides_its_share_of_the_object_as_it_moves(small_room, plain):
    steps = played(
        small_room, 'occluder = { object = "chair-1", share = 0.7, from_s = 0.2, to_s = 0.8 }'
    )
    for a, b in zip(steps[2:8], plain[2:8], strict=True):
        free, seen = (s.truth.recorded.visible_fraction["chair-1"] for s in (b, a))
        # What the person hides already, the panel may hide again.
        assert free - 0.7 - 0.05 <= seen <= 0.3 + 0.05
    assert steps[1].packet.data == plain[1].packet.data
    assert (
        steps[9].truth.recorded.visible_fraction["chair-1"]
        == plain[9].truth.recorded.visible_fraction["chair-1"]
    )
    assert set(steps[5].truth.recorded.world_from_object) == {"chair-1", "book-1"}


def test_twins_stand_where_they_are_put_and_can_be_pushed_against(small_room):
    steps = played(
        small_room,
        'twins = { object = "chair-1", at = [-0.42, 0.4], yaw_deg = 20 }\n',
    )
    first, last = steps[0].truth.recorded, steps[-1].truth.recorded
    twin = first.world_from_object["chair-1:twin-1"]
    assert twin.translation == pytest.approx([-0.42, 0.4, 0.0], abs=0.01)
    assert steps[0].truth.masks["chair-1:twin-1"][0].sum() > 50
    assert first.faults == {"twins": 1.0}
    assert last.world_from_object.keys() == {"chair-1", "book-1", "chair-1:twin-1"}


def test_the_same_seed_gives_the_same_bytes_with_every_fault(small_room):
    faults = """
drop_share = 0.2
blur = { px = 1, kind = "motion" }
exposure = { ev = 0.5 }
occluder = { object = "chair-1", share = 0.5 }
twins = { object = "chair-1", at = [0.4, 0.9] }
freeze = { from_s = 0.5, lasts_s = 0.2 }
"""
    a, b = (played(small_room, faults) for _ in range(2))
    assert [s.packet.data for s in a] == [s.packet.data for s in b]
    assert [dict(s.truth.recorded.faults) for s in a] == [dict(s.truth.recorded.faults) for s in b]
