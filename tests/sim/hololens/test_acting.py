"""A scenario's people wear the headset, and what they push moves before its camera."""

from __future__ import annotations

import numpy as np
import pytest

from devices.clock import WallClock
from scenes.samples import sample_room
from sim.hololens.acting import Acting, Followed, UnknownPersonError
from sim.hololens.drawing.scenery import Scenery
from sim.hololens.wearer import Stroller
from sim.scenarios.scenario import load_scenario


def test_a_follower_is_between_two_moments():
    followed, moves = Followed(), Stroller(0)
    with pytest.raises(RuntimeError, match="no moment"):
        followed.at(0.0)
    for t_s in (0.0, 0.1, 0.2):
        followed.put(t_s, moves.at(t_s))
    for t_s in (-1.0, 0.05, 0.17, 9.0):
        true = moves.at(min(max(t_s, 0.0), 0.2))
        found = followed.at(t_s)
        off = found.world_from_head.translation - true.world_from_head.translation
        assert np.linalg.norm(off) < 2e-3
        assert found.right is not None
        assert true.right is not None
        assert np.abs(found.right.positions_m - true.right.positions_m).max() < 5e-3


def test_people_play_their_parts_in_real_time():
    room, scenario = sample_room("lab"), load_scenario("lab-short")
    acting, scenery, clock = Acting(room, scenario), Scenery(room), WallClock()
    first = acting.wearer.at(0.0)
    assert first.right is not None
    assert first.right.positions_m.shape == (26, 3)
    acting.start(clock, scenery)
    clock.sleep_until(clock.now_ns() + 1_500_000_000)
    acting.close()
    now = acting.wearer.at(1.0)
    moved = now.world_from_head.translation - first.world_from_head.translation
    assert np.isfinite(moved).all()
    assert set(scenery.poses()) >= {item.object_id for item in room.objects}
    with pytest.raises(UnknownPersonError, match="nobody called 'eve'"):
        Acting(room, scenario, person="eve")
