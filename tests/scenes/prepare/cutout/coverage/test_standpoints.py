"""Standpoints for the photos that show what nobody saw."""

from dataclasses import replace

import numpy as np
import pytest

from scenes.pose import Pose
from scenes.prepare.cutout.coverage.in_photos import coverage_of
from scenes.prepare.cutout.coverage.standpoints import BODY_M, MIN_GAIN, PHOTOS, advice_for
from scenes.render.native import NativeRenderer

RENDERER = NativeRenderer()
AHEAD, BEHIND = (1.6, 0.1, 0.7), (-1.5, 0.2, 0.8)
AROUND = [(1.5 * np.cos(a), 1.5 * np.sin(a), 0.9) for a in np.linspace(0.0, 5.5, 8)]


def advised(package):
    item = package.objects[0]
    coverage = coverage_of(package, item, renderer=RENDERER)
    return advice_for(package, item, coverage=coverage, renderer=RENDERER)


def wall(flat_splats, low, high, at, axis):
    """A wall that fills a rectangle of the plan, up to two metres."""
    along = np.arange(low, high, 0.02)
    up = np.arange(0.01, 2.0, 0.02)
    a, z = (part.ravel() for part in np.meshgrid(along, up))
    points = np.column_stack([a, a, z])
    points[:, axis] = at
    return flat_splats(points, axis, (0.5, 0.5, 0.5), step_m=0.02)


def test_an_object_seen_from_the_front_is_to_be_seen_from_behind(crate_seen_from):
    advice = advised(crate_seen_from(AHEAD))
    assert 1 <= len(advice.standpoints) <= PHOTOS
    assert min(at.eye_m[0] for at in advice.standpoints) < -0.2
    gains = [at.gain for at in advice.standpoints]
    assert gains == sorted(gains, reverse=True)
    assert advice.unseen == pytest.approx(sum(gains) + advice.left, abs=1e-9)
    assert advice.left < MIN_GAIN
    assert advice == advised(crate_seen_from(AHEAD))


def test_photos_from_there_leave_nothing(crate_seen_from):
    advice = advised(crate_seen_from(AHEAD))
    again = advised(crate_seen_from(AHEAD, *(at.eye_m for at in advice.standpoints)))
    assert again.standpoints == ()
    assert again.unseen < MIN_GAIN


def test_an_object_seen_from_all_around_needs_no_photo(crate_seen_from):
    advice = advised(crate_seen_from(*AROUND))
    assert (advice.standpoints, advice.unseen) == ((), 0.0)


def test_nobody_is_sent_where_no_floor_is_free(crate_seen_from, flat_splats):
    """A wall close behind the crate: its back shows from nowhere."""
    package = crate_seen_from(AHEAD, more=(wall(flat_splats, -2.4, 2.4, -0.3, 0),))
    advice = advised(package)
    assert all(at.eye_m[0] > -0.3 + BODY_M - 0.06 for at in advice.standpoints)
    assert advice.left > 0.15


def test_nobody_is_sent_out_of_the_footprint_or_on_to_another_object(crate_seen_from):
    package = crate_seen_from(AHEAD)
    tight = replace(package, footprint_m=np.array([[-0.7, -2.5], [2.5, 2.5]]))
    assert all(at.eye_m[0] > -0.7 for at in advised(tight).standpoints)
    crate = package.objects[0]
    other = replace(crate, object_id="b", world_from_object=Pose.from_yaw(0.0, (-1.2, 0.0, 0.0)))
    for at in advised(replace(package, objects=(crate, other))).standpoints:
        assert np.abs(np.array(at.eye_m[:2]) - (-1.2, 0.0)).max() > 0.15 + BODY_M - 0.06


def test_no_floor_at_all_is_no_place(crate_seen_from):
    package = crate_seen_from(AHEAD)
    bare = replace(package, room=package.room.select(np.zeros(len(package.room), dtype=bool)))
    advice = advised(bare)
    assert advice.standpoints == ()
    assert advice.left == advice.unseen > 0.2
