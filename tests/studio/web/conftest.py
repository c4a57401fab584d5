"""A room small enough for a browser without a graphics card, its hub, and a second person."""

import importlib.util
import time
from pathlib import Path

import numpy as np
import pytest

from devices.clock import WallClock
from devices.hub.contract import HubSettings
from devices.hub.server import Hub
from scenes.package import ScenePackage
from scenes.pose import Pose
from scenes.quad import QrCode
from scenes.splats import SplatCloud
from scenes.state import ObjectModel, SceneState, TrackedObject, TrackState, reduce_state
from studio.web.live_page import live_page

READY = "document.documentElement?.dataset.state === 'ready'"
JOINING = "document.documentElement?.dataset.state === 'join'"
PER_WALL = 300
CODES = ((0.5, 1.5, 1.2), (2.0, -0.5, 1.3), (-1.0, 1.5, 1.4))
"""Middles of the printed codes on the walls."""


def load_guest():
    """The module beside this file: tests are no package."""
    spec = importlib.util.spec_from_file_location("guest", Path(__file__).parent / "guest.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def cloud_of(rng, low, high, count, colour, *, thick=0.13):
    means = rng.uniform(low, high, (count, 3))
    sh = np.tile((np.array(colour) - 0.5) / 0.2820948, (count, 1))[:, None, :]
    flat = np.minimum(thick, np.maximum(np.array(high) - np.array(low), 0.01))
    return SplatCloud(
        means.astype(np.float32),
        np.tile(flat, (count, 1)).astype(np.float32),
        np.tile(np.array([1, 0, 0, 0], np.float32), (count, 1)),
        np.full(count, 0.95, np.float32),
        sh.astype(np.float32),
    )


def joined(*clouds):
    fields = ("means", "scales", "rotations", "opacities", "sh")
    return SplatCloud(*(np.concatenate([getattr(c, f) for c in clouds]) for f in fields))


@pytest.fixture(scope="session")
def box_room():
    """A floor of 4 m × 3 m, two walls, and a box that moves, of 1,500 splats."""
    rng = np.random.default_rng(3)
    floor = cloud_of(rng, (-2, -1.5, -0.01), (2, 1.5, 0.0), 2 * PER_WALL, (0.55, 0.42, 0.3))
    back = cloud_of(rng, (-2, 1.5, 0), (2, 1.51, 2.4), PER_WALL, (0.6, 0.65, 0.62))
    side = cloud_of(rng, (2, -1.5, 0), (2.01, 1.5, 2.4), PER_WALL, (0.5, 0.55, 0.6))
    box = ObjectModel(
        "box-1",
        "Box 1",
        "box",
        cloud_of(rng, (-0.2, -0.2, 0), (0.2, 0.2, 0.4), 300, (0.85, 0.3, 0.2), thick=0.03),
        (0.4, 0.4, 0.4),
        0.0,
        Pose.from_yaw(0.0, (0.3, 0.2, 0.0)),
    )
    return ScenePackage(
        name="Box room",
        room=joined(floor, back, side),
        objects=(box,),
        codes=tuple(
            QrCode(f"box:{number}", 0.2, Pose.from_yaw(0.0, place))
            for number, place in enumerate(CODES, start=1)
        ),
        world_from_rig=Pose.identity(),
        footprint_m=np.array([[-2.0, -1.5], [2.0, 1.5]]),
        physical=None,
    )


@pytest.fixture(scope="session")
def assets(box_room, modules, tmp_path_factory):
    """Files of the box room's page."""
    return live_page(box_room, tmp_path_factory.mktemp("live"), modules=modules)


@pytest.fixture
def hub(assets):
    """A hub at work; what it refuses is in `said`."""
    hub = Hub(HubSettings(), assets, clock=WallClock())
    hub.start()
    yield hub
    hub.close()


@pytest.fixture
def page(chromium, hub):
    """A tab that has forgotten earlier visits."""
    chromium.visit(f"{hub.url}check")
    chromium.wait_for("document.readyState === 'complete'")
    chromium.evaluate("sessionStorage.clear(); localStorage.clear()")
    chromium.requests.clear()
    chromium.messages.clear()
    yield chromium
    chromium.visit("about:blank")


@pytest.fixture
def invite_guest(hub):
    """A function that lets a second person in, by name."""
    guests = []
    guest_module = load_guest()

    def invite(name):
        guests.append(guest_module.Guest(hub.url, hub.invite().code, name))
        return guests[-1]

    invite.tools = guest_module
    yield invite
    for guest in guests:
        guest.close()


@pytest.fixture(scope="session")
def iwer_source(node_file):
    """The emulated headset, as a script that a page runs before its own."""
    return node_file("iwer", "build", "iwer.min.js").read_text(encoding="utf-8")


class Echo:
    """A session's part: what people send enters the state, which goes back to them."""

    def __init__(self, hub, state):
        self.hub, self.state = hub, state
        hub.publish(state)

    def until(self, wanted, seconds=90.0):
        """Take what comes until the state is as wanted; return what was wanted of it."""
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            arrived = self.hub.take()
            for change in (*arrived.surfaces, *arrived.lines, *arrived.placed):
                self.state = reduce_state(self.state, change, 0)
            self.hub.publish(self.state)
            if found := wanted(self.state):
                return found
            time.sleep(0.02)
        raise TimeoutError("the state is not as wanted")

    def place(self, x, y=0.2, yaw=0.0):
        """Let the tracked object be somewhere."""
        now = time.monotonic_ns()
        pose = Pose.from_yaw(yaw, (x, y, 0.0))
        box = TrackedObject("box-1", now, pose, np.zeros((4, 4)), 1.0, TrackState.TRACKED, 1.0, 0)
        self.state = reduce_state(self.state, box, now)
        self.hub.publish(self.state)


@pytest.fixture
def echo(hub):
    found = Echo(hub, SceneState())
    found.place(0.3)
    return found


def join_as_ada(page, hub, *, width, height):
    """Join the hub's room and wait until all of it is there."""
    page.visit(hub.invite().url, width=width, height=height)
    page.wait_for(JOINING)
    page.evaluate("document.getElementById('name').value = 'Ada'")
    page.evaluate("document.getElementById('join-button').click()")
    page.wait_for(READY)
    page.wait_for("live.isWhole()")


@pytest.fixture
def inside(page, hub, echo):
    """The page in the room, looking down on it from the front."""
    join_as_ada(page, hub, width=1000, height=640)
    page.evaluate(
        "document.getElementById('panel').hidden = true; dispatchEvent(new Event('resize'))"
    )
    page.evaluate(
        "live.control.camera.position.set(0, -2.6, 2.2);"
        "live.control.lookAt(live.room.camera.position.clone().set(0, 0.6, 0.5))"
    )
    return page


def seen_at(page, x, y, z):
    """Where a place of the room (headset axes) is in the picture, as one looks now.

    The camera's matrices are brought up to date first, which else the next picture does.
    """
    return page.evaluate(
        "(live.room.camera.updateMatrixWorld(),"
        " ((p) => [(1 + p.x) / 2 * innerWidth, (1 - p.y) / 2 * innerHeight])"
        f"(live.room.upright.localToWorld(live.room.camera.position.clone().set({x}, {y}, {z}))"
        ".project(live.room.camera)))"
    )


def drag(page, *places):
    mouse = {"button": "left", "buttons": 1, "clickCount": 1}
    for kind, (x, y) in zip(
        ["mousePressed", *["mouseMoved"] * (len(places) - 2), "mouseReleased"], places, strict=True
    ):
        page.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, **mouse)
        time.sleep(0.05)  # the page looks for a surface at most every 15 ms


def choose(page, tool):
    page.evaluate(f"document.getElementById('tool-{tool}').click()")


def only(items):
    return next(iter(items.values())) if len(items) == 1 else None
