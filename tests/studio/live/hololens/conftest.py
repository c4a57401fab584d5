"""A headset that is not there: its wearer, pictures and surfaces are what a test says."""

from __future__ import annotations

from collections import deque

import numpy as np
import pytest

from benchmarks.twin.scan_like import block, scan_like
from devices.hololens.plan import HeadsetPlan
from devices.hololens.values import HandJoints, HeadAndHands, HeadsetStatus, Ray
from scenes.frames import WORLD_FROM_BOARD_FACING_X, look_at
from scenes.mesh import BoxPart, CollisionMesh
from scenes.package import ScenePackage
from scenes.pose import Pose
from scenes.quad import QrCode
from scenes.splats import SplatCloud
from scenes.state import ObjectModel


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
        self.videos, self.bodies, self.meshes = (
            FakeSubscription(),
            FakeSubscription(),
            FakeSurfaces(),
        )
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


@pytest.fixture(scope="session")
def scanned_package():
    """A room of four metres with one carton on its floor, as a scan has it."""
    box = block((-2, -2, 0), (2, 2, 2.5), is_room=True)
    triangles = scan_like(box, edge_m=0.1, noise_m=0.002, seed=3)
    corners, index = np.unique(triangles.reshape(-1, 3).round(5), axis=0, return_inverse=True)
    mesh = CollisionMesh(corners.astype(np.float32), index.reshape(-1, 3).astype(np.int32))
    splats = SplatCloud(
        np.zeros((1, 3), np.float32), np.full((1, 3), 0.05, np.float32),
        np.array([[1, 0, 0, 0]], np.float32), np.ones(1, np.float32),
        np.zeros((1, 1, 3), np.float32),
    )  # fmt: skip
    parts = (BoxPart(Pose.from_yaw(0.0, (0, 0, 0.1)), (0.1, 0.1, 0.1)),)
    carton = ObjectModel(
        "carton-1",
        "carton",
        "carton",
        splats,
        (0.2, 0.2, 0.2),
        0.0,
        Pose.from_yaw(0.2, (0.1, 0.1, 0.0)),
        parts,
        1.0,
    )
    code = QrCode("room:1", 0.24, Pose.from_yaw(0.0, (-2, 0, 1.5)) @ WORLD_FROM_BOARD_FACING_X)
    return ScenePackage(
        "box",
        splats,
        (carton,),
        (code,),
        Pose.identity(),
        np.array([[-2.0, -2.0], [2.0, 2.0]]),
        None,
        collision=mesh,
    )


@pytest.fixture
def headset():
    return FakeHeadset()


def hand(*, points):
    """A right hand whose index finger is stretched, and the middle one curled if it points."""
    places = np.zeros((26, 3))
    places[:, 0] = 0.3
    straight, curled = [[0, 1, 0]] * 4, [[0, 1, 0], [0, 1, 0], [0, 0, -1], [0, -1, 0]]
    for first, bends in ((6, False), (11, points), (16, points), (21, points)):
        ways = np.array(curled if bends else straight, dtype=float)
        places[first : first + 5] = [0.3, 0.4, 1.3]
        places[first + 1 : first + 5] += 0.03 * np.cumsum(ways, axis=0)
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
