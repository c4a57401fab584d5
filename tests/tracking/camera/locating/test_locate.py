"""A camera found from one picture; refused in another room, between twins, and when cancelled."""

import math
from dataclasses import replace

import numpy as np
import pytest

from scenes.pose import Pose, rotation_angle
from tracking.camera.locating.hypotheses import Refined
from tracking.camera.locating.locate import best_of, locate_camera, prepare_map


def left_of(result, true):
    step = true.inverse() @ result.world_from_rig
    return math.degrees(rotation_angle(step.rotation)), float(np.linalg.norm(step.translation))


@pytest.fixture(scope="module")
def find(table, objects, frame, room_map):
    def locate(**options):
        return locate_camera(
            frame,
            options.pop("room", table.scan.room),
            table.renderer,
            **{
                "objects": objects,
                "rng": np.random.default_rng(0),
                "room_map": room_map,
                **options,
            },
        )

    return locate


def test_a_camera_is_found_without_knowing_anything_of_its_place(find, there):
    shares = []
    result = find(progress=lambda share, what: shares.append((share, what)))
    degrees, metres = left_of(result, there)
    assert result.trusted, result.refusal
    assert degrees < 0.3
    assert metres < 0.02
    assert (result.sigma > 0).all()
    assert result.found_share > 0.4
    assert "located at x 0.5" in result.described()
    assert shares == sorted(shares, key=lambda each: each[0])
    assert {what for _, what in shares} == {"comparing places", "refining"}


def test_where_it_stood_is_tried_first(find, there):
    said = []
    near = there @ Pose.from_yaw(0.0, (0.1, -0.1, 0.05))
    result = find(near_world_from_rig=near, progress=lambda _share, what: said.append(what))
    degrees, metres = left_of(result, there)
    assert result.trusted
    assert (degrees < 0.3, metres < 0.02) == (True, True)
    assert set(said) == {"looking where it stood"}


def test_another_room_is_refused(find, table):
    means = table.scan.room.means[:, [1, 0, 2]]
    result = find(room=replace(table.scan.room, means=means), objects=(), room_map=None)
    assert not result.trusted
    assert "NOT located" in result.described()
    assert np.isinf(result.sigma).all()


def test_cancelled_is_refused_and_draws_nothing_more(find):
    result = find(room_map=None, cancelled=lambda: True)
    assert not result.trusted
    assert "cancelled" in result.refusal


def test_a_map_that_is_cancelled_is_none(table):
    rng = np.random.default_rng(0)
    assert prepare_map(table.scan.room, table.renderer, rng=rng, cancelled=lambda: True) is None


def test_odds_are_those_to_another_place_and_not_to_the_same():
    here, there = Pose.identity(), Pose.from_yaw(3.0)
    best, again = Refined(here, 80, 100), Refined(here, 79, 100)
    rival = Refined(there, 70, 100)
    assert best_of([again, best]) == (best, best.nats)
    chosen, odds = best_of([rival, again, best])
    assert chosen is best
    assert odds == pytest.approx(best.nats - rival.nats)
