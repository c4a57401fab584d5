import asyncio
from itertools import pairwise

import pytest

from sim.headset.client import RATE_HZ
from sim.headset.connection import HubAddress, HubRefusedError
from sim.headset.crowd import CrowdPlan, run_crowd
from sim.headset.faults import read_headset_faults
from sim.headset.moves import FILM_S, place_in_film
from tests.sim.headset.conftest import PATIENCE_S, lasting, play


async def codes_of(hub, count=1000):
    for _ in range(count):
        yield hub.invite().code


def played(hub, plan, until):
    """The tally of a crowd at a room whose state changes, its pace, and how many joined when."""
    counts = []
    tally, pace = asyncio.run(
        play(hub, plan, until=until, codes=codes_of(hub.hub), joined=counts.append)
    )
    return tally, pace, counts


def test_two_people_see_the_room_and_each_other(hub):
    tally, pace, counts = played(hub, CrowdPlan(HubAddress(hub.url), 2), lasting(3.0))
    assert counts == [1, 2]
    assert tally.failures == []
    assert tally.connections == 2
    assert len(tally.joins_s) == 2
    assert max(tally.joins_s) < 2.0 + pace.late_s
    assert tally.sent > 0.5 * 2 * pace.rounds
    assert tally.received > 0.5 * tally.sent
    assert tally.states > 30
    assert tally.unreadable == 0
    assert 0 < tally.hand.percentile(50) < 100 + pace.late_ms
    assert 0 < tally.state.percentile(50) < 100 + pace.late_ms
    assert len(hub.hub.take().avatars) in (0, 1, 2)


def test_what_people_draw_reaches_the_session(hub, monkeypatch):
    monkeypatch.setattr("sim.headset.client.DRAW_EVERY_S", 0.9)
    monkeypatch.setattr("sim.headset.client.DRAW_S", 0.6)

    def has_drawn(tally, _pace):  # an entry of the log and the answer come one after the other
        return tally.done > 5 and tally.log == tally.done

    tally, _, _ = played(hub, CrowdPlan(HubAddress(hub.url), 1), has_drawn)
    assert tally.refused == 0
    lines = hub.hub.take().lines
    assert {line.user_id for line in lines} == {"p1"}


def test_a_black_hole_ends_and_everything_is_back(hub):
    faults = read_headset_faults(["black_hole:at=0.5,for=1", "loss:size=0.5", "jitter:size=0.01"])

    def are_back(tally, _pace):
        return len(tally.returns_s) == 2

    tally, pace, _ = played(hub, CrowdPlan(HubAddress(hub.url), 2, faults=faults), are_back)
    assert tally.failures == []
    assert tally.connections == 4
    assert max(tally.returns_s) < 2.0 + pace.late_s
    assert tally.left_out > 0.3 * tally.sent


def test_a_headset_that_is_off_or_asleep_sends_nothing(hub):
    faults = read_headset_faults(["off:at=0,for=1", "sleep:at=1"])
    plan = CrowdPlan(HubAddress(hub.url), 1, faults=faults, draws=False)
    tally, pace, _ = played(hub, plan, lasting(2.0))
    assert tally.sent == 0
    assert tally.left_out > 0.3 * pace.rounds
    assert 5 < tally.states < 50


def test_a_wrong_code_and_too_few_codes_end_it(hub):
    async def join(codes):
        await run_crowd(CrowdPlan(HubAddress(hub.url), 2, 1.0), codes, over=asyncio.Event())

    async def wrong():
        yield "nobody"

    with pytest.raises(HubRefusedError, match="code is wrong"):
        asyncio.run(join(wrong()))
    with pytest.raises(ValueError, match="1 for 2 people"):
        asyncio.run(join(codes_of(hub.hub, 1)))


def test_a_hub_that_ends_says_goodbye(hub):
    async def end():
        plan = CrowdPlan(HubAddress(hub.url), 1)
        crowd = asyncio.create_task(run_crowd(plan, codes_of(hub.hub), over=asyncio.Event()))
        while not hub.hub.people():
            await asyncio.sleep(0.05)
        await asyncio.sleep(0.3)
        await asyncio.to_thread(hub.hub.close)
        return await crowd

    tally = asyncio.run(asyncio.wait_for(end(), PATIENCE_S))
    assert tally.failures == ["Ann 1: the session is over"]


def test_plans_have_limits():
    address = HubAddress("http://127.0.0.1:1/")
    with pytest.raises(ValueError, match="1 to 256"):
        CrowdPlan(address, 0)
    with pytest.raises(ValueError, match="more than 0"):
        CrowdPlan(address, 1, 0.0)
    with pytest.raises(ValueError, match="1 to 120"):
        CrowdPlan(address, rate_hz=1000.0)


def test_a_film_is_played_forward_and_backward_without_a_jump():
    count = round(FILM_S * RATE_HZ)
    places = [place_in_film(seq, count) for seq in range(3 * count)]
    assert {abs(a - b) for a, b in pairwise(places)} == {1}
    assert {0, count - 1} <= set(places)
