"""A hub on the loopback with a room of one object that moves."""

from __future__ import annotations

import asyncio
import time
from types import SimpleNamespace
from unittest.mock import patch

import numpy as np
import pytest

from devices.clock import WallClock
from devices.hub.contract import Asset, HubSettings
from devices.hub.entry.tokens import TOKEN_NS, Ticket, Tokens
from devices.hub.roles import Role
from devices.hub.server import Hub
from scenes.pose import Pose
from scenes.state import SceneState, TrackedObject, TrackState, reduce_state
from sim.headset.client import RATE_HZ
from sim.headset.crowd import run_crowd
from sim.headset.tally import Tally

PATIENCE_S = 120.0
"""Seconds for what takes a few where the machine does nothing else."""


class Pace:
    """Counts how often this machine lets a task go on that wants to as often as a headset sends.

    Where it does nothing else, that is `RATE_HZ` a second and hardly late.
    """

    def __init__(self):
        self._late_s, self._before = [], 0

    @property
    def rounds(self):
        """How often since everybody was there."""
        return len(self._late_s) - self._before

    def begin(self):
        self._before = len(self._late_s)

    @property
    def late_ms(self):
        """Milliseconds by which it went on late since then, 95th percentile."""
        return 1000 * float(np.percentile(self._late_s[self._before :], 95))

    @property
    def late_s(self):
        """Seconds by which it went on late, all together."""
        return sum(self._late_s)

    async def go_on(self):
        due_s = time.perf_counter()
        while True:
            due_s = max(due_s + 1 / RATE_HZ, time.perf_counter())
            await asyncio.sleep(due_s - time.perf_counter())
            self._late_s.append(max(time.perf_counter() - due_s, 0.0))


def lasting(seconds):
    """A condition of `play`: as many rounds as a machine that does nothing else has in that time.

    A loaded machine needs longer for what is the same to whoever takes part.
    """
    return lambda _tally, pace: pace.rounds >= seconds * RATE_HZ


async def play(hub, plan, *, until, codes, joined=lambda _count: None):
    """The tally of a crowd at a room that changes 30 times a second, and the machine's pace.

    Args:
        hub: the fixture.
        plan: without an end.
        until: asked of tally and pace, once all have joined, whether it is over.
        codes: of invitations.
        joined: takes how many are there.
    """
    over, whole, tally, pace = asyncio.Event(), asyncio.Event(), Tally(), Pace()

    async def publishing():
        while True:
            hub.publish()
            await asyncio.sleep(1 / 30)

    async def ending():
        await whole.wait()
        pace.begin()
        try:
            while not until(tally, pace):
                await asyncio.sleep(0.005)
        finally:
            over.set()

    def here(count):
        joined(count)
        if count == plan.clients:
            whole.set()

    beside = [asyncio.create_task(work) for work in (publishing(), ending(), pace.go_on())]
    try:
        with patch("sim.headset.crowd.Tally", return_value=tally):
            await asyncio.wait_for(run_crowd(plan, codes, over=over, joined=here), PATIENCE_S)
    finally:
        for task in beside:
            task.cancel()
        await asyncio.gather(*beside, return_exceptions=True)
    return tally, pace


def moved(state, number, t_ns):
    """The state after a chair was tracked once more."""
    pose = Pose.from_yaw(0.01 * number, (0.01 * number, 0.0, 0.0))
    track = TrackedObject(
        "chair-1", t_ns, pose, np.eye(4) * 1e-4, 1.0, TrackState.TRACKED, 0.9, number
    )
    return reduce_state(state, track, t_ns)


@pytest.fixture
def hub():
    """A hub, its clock, what it said, and a way to publish the next state."""
    clock, tokens, said = WallClock(), Tokens(), []
    one = Hub(
        HubSettings(),
        {"/": Asset(b"<!doctype html><title>room</title>", "text/html")},
        clock=clock,
        say=said.append,
        tokens=tokens,
    )
    one.start()
    states = [SceneState()]

    def publish():
        states.append(moved(states[-1], len(states), clock.now_ns()))
        one.publish(states[-1])

    def expired(person_id):
        return tokens.make(Ticket(person_id, Role.REMOTE, 1), clock.now_ns() - TOKEN_NS)

    yield SimpleNamespace(
        hub=one, clock=clock, said=said, publish=publish, expired=expired, url=one.url
    )
    one.close()
