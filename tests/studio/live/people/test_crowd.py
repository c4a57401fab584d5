"""Simulated people in a process of their own join a live session, and give their figures."""

from __future__ import annotations

import time
from contextlib import contextmanager
from types import SimpleNamespace

import pytest

from devices.clock import WallClock
from devices.hub.entry.tokens import Tokens
from scenes.state import SceneState
from scenes.workers.task import Task
from studio.live.people.crowd import Crowd
from studio.live.people.hosting import Hosting, hosted
from tests.sim.headset.conftest import moved


@pytest.fixture
def room(tiny):
    """A hub whose room changes 30 times a second, live since it was made."""
    clock, tokens = WallClock(), Tokens()
    with hosted(Hosting(), tiny.scene, clock=clock, say=lambda _line: None, tokens=tokens) as hub:

        def publish(task):
            state, number = SceneState(), 0
            while not task.pause(1 / 30):
                number += 1
                state = moved(state, number, clock.now_ns())
                hub.publish(state)
                hub.take()

        task = Task("states", publish).start()
        yield SimpleNamespace(hub=hub, clock=clock, tokens=tokens)
        task.cancel()
        task.join(2)


def crowd_of(room, *, seconds, live_s=None, clients=2):
    said = []
    crowd = Crowd(
        room.hub,
        live_s or (lambda: room.clock.now_ns() / 1e9),
        clients=clients,
        seconds=seconds,
        clock=room.clock,
        tokens=room.tokens,
        say=said.append,
    )
    return crowd, said


@contextmanager
def started(crowd):
    crowd.start()
    try:
        yield
    finally:
        crowd.end()


def until(condition, seconds):
    for _ in range(round(seconds / 0.05)):
        if condition():
            return
        time.sleep(0.05)
    raise AssertionError("not reached in time")


def test_two_people_are_measured_and_attacks_refused(room):
    crowd, said = crowd_of(room, seconds=14.0)
    with started(crowd):
        until(lambda: crowd.process_ids, 5)
        until(lambda: not crowd.process_ids, 25)
        rows = {row.name: row for row in crowd.rows()}
    assert said == []
    assert rows["live.clients.failed"].value == 0
    assert rows["live.refused_percent"].value == 100
    assert rows["live.refused_percent"].passed
    assert 0 < rows["live.frame_to_client_ms.p50"].value < 200
    assert 0 < rows["live.hand_to_client_ms.p95"].value < 200
    assert 0 < rows["live.join_s"].value < 5
    assert rows["live.clients2.rss_growth_percent"].value < 50


def test_before_the_session_is_live_nobody_joins(room):
    crowd, said = crowd_of(room, seconds=None, live_s=lambda: None)
    with started(crowd):
        time.sleep(0.5)
        assert crowd.process_ids == ()
    assert [row.name for row in crowd.rows()] == ["live.clients.failed"]
    assert said == []


def test_people_who_cannot_join_are_a_failure_with_its_reason(room):
    room.hub.close()
    crowd, said = crowd_of(room, seconds=None)
    with started(crowd):
        until(lambda: crowd.process_ids, 5)
        until(lambda: not crowd.process_ids, 15)
        rows = {row.name: row for row in crowd.rows()}
    assert not rows["live.clients.failed"].passed
    assert "not reached" in said[0]
    assert "live.frame_to_client_ms.p50" not in rows
