"""A headset that is not there: its wearer, pictures and surfaces are what a test says."""

from __future__ import annotations

from collections import deque

import numpy as np
import pytest

from devices.hololens.headset import HeadsetPlan
from devices.hololens.values import HandJoints, HeadAndHands, HeadsetStatus, Ray
from scenes.frames import look_at


class FakeSubscription:
    def __init__(self):
        self.waiting = deque()
        self.is_closed = False

    def take(self, timeout_s=0.0):
        return self.waiting.popleft() if self.waiting else None

    def close(self):
        self.is_closed = True


class FakeSurfaces(FakeSubscription):
    def take(self, timeout_s=0.0):
        found = list(self.waiting)
        self.waiting.clear()
        return found


class FakeHeadset:
    """Stands for `devices.hololens.headset.Headset`."""

    def __init__(self, plan=None, clock=None):
        self.plan = plan or HeadsetPlan("127.0.0.1")
        self.videos, self.bodies, self.meshes = FakeSubscription(), FakeSubscription(), FakeSurfaces()
        self.drawn = []
        self.events = []
        self.is_closed = False
        self.said = HeadsetStatus("127.0.0.1")

    def video(self):
        return self.videos

    def body(self):
        return self.bodies

    def surfaces(self):
        return self.meshes

    def draw(self, items):
        self.drawn.append(dict(items))

    def status(self):
        return self.said

    def take_events(self):
        taken, self.events = self.events, []
        return taken

    def close(self):
        self.is_closed = True


@pytest.fixture
def headset():
    return FakeHeadset()


def hand(*, points):
    """A right hand whose index finger is stretched, and the middle one curled if it points."""
    places = np.zeros((26, 3))
    places[:, 0] = 0.3
    for first, bends in ((6, False), (11, points), (16, points), (21, points)):
        place, along = np.array([0.3, 0.4, 1.3]), np.array([0.0, 1.0, 0.0])
        for k in range(5):
            places[first + k] = place
            if bends and k:
                along = np.array([0.0, along[1] * 0.2 - 0.8, -0.6])
                along /= np.linalg.norm(along)
            place = place + 0.03 * along
    rotations = np.tile(np.eye(3), (26, 1, 1))
    return HandJoints(places, rotations, np.full(26, 0.01), np.ones(26, bool))


def sample(*, t_ns=0, points=True, seq=1, is_lost=False):
    """A wearer at (0, 0, 1.6) who looks along y, in the headset's world."""
    head = look_at(np.array([0.0, 0.0, 1.6]), np.array([0.0, 2.0, 1.6]))
    gaze = Ray(np.array([0.0, 0.0, 1.6]), np.array([0.0, 1.0, 0.0]))
    shown = None if is_lost else head
    return HeadAndHands(seq, t_ns, t_ns, shown, gaze, None, hand(points=points))


@pytest.fixture
def sample_of():
    return sample
