"""Figures against a truth, where the right answer is known."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from scenes.cameras import Fisheye, Rig
from scenes.pose import Pose
from sim.wire.streaming.truth_file import PictureTime, TruthRow
from studio.live.against_truth import (
    Published,
    bump_rows,
    calibration_rows,
    delay_rows,
    lens_apart_px,
    located_row,
    matched,
    object_rows,
    recovery_row,
)

MS = 1_000_000
S = 1_000_000_000


def at(x=0.0):
    return Pose.from_yaw(0.0, (x, 0.0, 0.0))


def truth_of(count, *, bump_at=None, degrees=0.6):
    rows = []
    for k in range(count):
        is_turned = bump_at is not None and k >= bump_at
        camera = Pose.from_yaw(math.radians(degrees) if is_turned else 0.0)
        time = PictureTime(k, 0, k * 100 * MS, 1000 * S + k * 100 * MS)
        rows.append(TruthRow(time, {"chair": at(1.0)}, {"chair": 1.0}, camera))
    return rows


def published_of(rows, *, delay_ms=80, error_m=0.0, first=0):
    return [
        Published(
            row.time.stamp_ns,
            row.time.wall_ns + 30 * MS,
            row.time.wall_ns + delay_ms * MS,
            {"chair": at(1.0 + error_m)},
            row.world_from_rig,
        )
        for row in rows[first:]
    ]


def value(rows, name):
    return next(row for row in rows if row.name == name)


def test_pictures_are_matched_by_stamp_and_arrival():
    truth = truth_of(20)
    # After a restart the camera's clock begins anew: the same stamps, half a minute later.
    again = [
        TruthRow(PictureTime(100 + k, 1, k * 100 * MS, 1030 * S + k * 100 * MS), {}, {}, None)
        for k in range(20)
    ]
    pairs = matched(published_of(truth) + published_of(again), truth + again)
    assert [pair.truth.time.number for pair in pairs] == [*range(20), *range(100, 120)]


def test_delays_are_from_capture_to_poses():
    truth = truth_of(50)
    rows = delay_rows(matched(published_of(truth, delay_ms=80), truth))
    assert value(rows, "live.frame_to_pose_ms.p95").value == pytest.approx(80)
    assert value(rows, "live.frame_to_pose_ms.p95").passed
    late = delay_rows(matched(published_of(truth, delay_ms=180), truth))
    assert value(late, "live.frame_to_pose_ms.p95").passed is False
    assert delay_rows([])[0].passed is False


def test_recovery_counts_from_the_network_s_return():
    published = published_of(truth_of(20))
    back_ns = 1000 * S + 500 * MS
    row = recovery_row(published, [back_ns])
    # The picture of 0.5 s arrives 30 ms after it was taken and has poses 50 ms later.
    assert row.value == pytest.approx(0.08)
    assert recovery_row(published, [2000 * S]).value == math.inf
    assert math.isnan(recovery_row(published, []).value)
    # Of a long session the last pictures are kept, and those before and after a gap.
    assert math.isnan(recovery_row(published[15:], [back_ns]).value)
    kept = [published[4], published[5], *published[15:]]
    assert recovery_row(kept, [back_ns]).value == row.value


def test_a_bump_that_throws_a_chair_is_seen():
    truth = truth_of(100, bump_at=50)
    published = published_of(truth)
    thrown = [
        Published(p.pts_ns, p.arrived_ns, p.published_ns, {"chair": at(1.2)}, p.world_from_rig)
        if 55 <= k < 58
        else p
        for k, p in enumerate(published)
    ]
    noticed = [truth[50].time.wall_ns + 700 * MS]
    rows = bump_rows(published, truth, noticed)
    assert value(rows, "live.bump.noticed_s").value == pytest.approx(0.67)
    assert value(rows, "live.bump.moved_cm.max").value == pytest.approx(0.0)
    rows = bump_rows(thrown, truth, noticed)
    assert value(rows, "live.bump.moved_cm.max").value == pytest.approx(20.0)
    assert value(bump_rows(published, truth, []), "live.bump.noticed_s").value == math.inf


@pytest.mark.parametrize(
    ("flagged", "moved_cm"), [(frozenset({"chair"}), 0.0), (frozenset(), 40.0)]
)
def test_what_was_said_to_be_lost_and_is_found_again_was_not_thrown(flagged, moved_cm):
    truth = truth_of(100, bump_at=50)
    published = [
        replace(p, world_from_object={"chair": at(1.4)}, flagged=flagged) if k < 60 else p
        for k, p in enumerate(published_of(truth))
    ]
    moved = value(bump_rows(published, truth, [truth[50].time.wall_ns]), "live.bump.moved_cm.max")
    assert moved.value == pytest.approx(moved_cm)


def test_a_bump_while_nothing_arrives_counts_from_the_next_picture():
    truth = truth_of(120, bump_at=40)
    published = published_of(truth)
    gap = published[:30] + published[60:]
    noticed = [published[65].published_ns]
    row = value(bump_rows(gap, truth, noticed), "live.bump.noticed_s")
    assert row.value == pytest.approx((noticed[0] - published[60].arrived_ns) / 1e9)


def test_a_bump_after_the_last_picture_that_is_published_late_is_not_judged():
    truth = truth_of(120, bump_at=40)
    early = published_of(truth[:40])
    late = [*early[:-1], replace(early[-1], published_ns=early[-1].published_ns + 60 * S)]
    row = value(bump_rows(late, truth, []), "live.bump.noticed_s")
    assert row.value is None or math.isnan(row.value)


def test_lenses_are_compared_over_their_circle():
    lens = Fisheye.from_fov(1440, math.radians(200.0))
    shifted = Fisheye(1440, 1440, lens.f_px, lens.cx + 0.3, lens.cy, lens.max_angle)
    assert lens_apart_px(lens, lens) == 0.0
    assert lens_apart_px(shifted, lens) == pytest.approx(0.3)
    rig = Rig((lens, lens), (at(), at()))
    found = Rig((lens, shifted), rig.rig_from_lens)
    rows = calibration_rows(found, Pose.from_yaw(math.radians(0.05), (0.004, 0, 0)), rig, at())
    assert [round(row.value, 3) for row in rows] == [0.3, 0.05, 4.0]
    assert [row.passed for row in rows] == [True, True, True]


def test_a_camera_beside_its_place_was_not_located():
    assert located_row([(at(0.02), at()), (at(0.5), at())]).value == 50.0
    turned = Pose.from_yaw(math.radians(2.0))
    assert located_row([(turned, at())]).value == 0.0
    assert located_row([]).passed is False


def test_objects_that_are_seen_are_measured():
    truth = truth_of(5)
    error, wrong = object_rows(matched(published_of(truth, error_m=0.01), truth))
    assert (error.name, wrong.name) == ("live.object_cm.p50", "live.wrong_percent")
    assert error.value == pytest.approx(1.0)
    assert (wrong.value, wrong.passed) == (0.0, True)
    mixed = published_of(truth[:4], error_m=0.01) + published_of(truth[4:], error_m=0.2)
    assert object_rows(matched(mixed, truth))[1].value == pytest.approx(20.0)
    hidden = [
        TruthRow(r.time, r.world_from_object, {"chair": 0.0}, r.world_from_rig) for r in truth
    ]
    assert [row.value for row in object_rows(matched(published_of(hidden), hidden))] == [None]
