"""A hub on the loopback with a room of one object that moves."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from devices.clock import WallClock
from devices.hub.contract import Asset, HubSettings
from devices.hub.entry.tokens import TOKEN_NS, Ticket, Tokens
from devices.hub.roles import Role
from devices.hub.server import Hub
from scenes.pose import Pose
from scenes.state import SceneState, TrackedObject, TrackState, reduce_state


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
