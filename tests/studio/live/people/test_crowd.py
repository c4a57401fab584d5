"""Simulated people in a process of their own join a live session, and give their figures."""

from __future__ import annotations

import time
from contextlib import contextmanager
from types import SimpleNamespace

import numpy as np
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
        late_ms = []

        def publish(task):
            state, number = SceneState(), 0
            due_ns = clock.now_ns()
            while not task.pause(1 / 30):
                number += 1
                late_ms.append((clock.now_ns() - due_ns) / 1e6 - 1000 / 30)
                due_ns = clock.now_ns()
                state = moved(state, number, clock.now_ns())
                hub.publish(state)
                hub.take()

        task = Task("states", publish).start()
        yield SimpleNamespace(hub=hub, clock=clock, tokens=tokens, late_ms=late_ms)
        task.cancel()
        task.join(120)


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


def until(condition, seconds=120.0):
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "not reached in time"
        time.sleep(0.05)


def test_two_people_are_measured_and_attacks_refused(room):
    crowd, said = crowd_of(room, seconds=None)
    with started(crowd):
        # Guesses come last of what is tried, once all are there for a while.
        until(lambda: "guessing" in room.hub.counts().refused)
        rows = {row.name: row for row in crowd.rows()}
    late_ms = 2 * float(np.percentile(room.late_ms, 95))  # of what the machine lets go on at once
    assert said == []
    assert rows["live.clients.failed"].value == 0
    assert rows["live.refused_percent"].value == 100
    assert rows["live.refused_percent"].passed
    assert 0 < rows["live.frame_to_client_ms.p50"].value < 200 + late_ms
    assert 0 < rows["live.hand_to_client_ms.p95"].value < 200 + late_ms
    assert 0 < rows["live.join_s"].value < 5
    # On a busy machine they may be here for too few samples: left out then, not 0.
    growth = rows.get("live.clients2.rss_growth_percent")
    assert growth is None or growth.value < 50


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
        until(lambda: crowd.process_ids)
        until(lambda: not crowd.process_ids)
        rows = {row.name: row for row in crowd.rows()}
    assert not rows["live.clients.failed"].passed
    assert "not reached" in said[0]
    assert "live.frame_to_client_ms.p50" not in rows
