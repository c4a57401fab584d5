"""A room small enough for a browser without a graphics card, its hub, and a second person."""

import importlib.util
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
from scenes.state import ObjectModel
from studio.web.live_page import live_page

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
