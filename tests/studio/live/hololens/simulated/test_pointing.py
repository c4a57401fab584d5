"""A remote person who points at legs."""

import time
from types import SimpleNamespace

import numpy as np

from devices.clock import WallClock
from devices.hub.contract import HubSettings
from devices.hub.protocol.wire import decode_body, encode_body
from devices.hub.server import Hub
from scenes.frames import WORLD_FROM_GLTF
from scenes.samples import sample_room
from studio.live.hololens.simulated.pointing import Pointer, body_at, leg_of


def test_a_leg_is_at_a_corner_of_the_chair_above_the_floor():
    chair = next(item for item in sample_room("lab").objects if item.kind == "chair")
    x, y, z = leg_of(chair)
    assert 0.12 < x < 0.24
    assert 0.12 < y < 0.24
    assert z == 0.2


def test_the_ray_ends_at_the_place():
    end = np.array([0.4, -0.3, 0.2])
    body = decode_body(encode_body(body_at(end, seq=3)))
    assert np.allclose(WORLD_FROM_GLTF @ body.ray[1], end, atol=1e-5)


def test_whoever_points_says_how_the_headset_is(monkeypatch):
    monkeypatch.setattr("studio.live.hololens.simulated.pointing.SAY_S", 0.1)
    hub, said = Hub(HubSettings(), {}, clock=WallClock()), []
    hub.start()
    nothing = SimpleNamespace(shown=lambda: ())
    simulator = SimpleNamespace(holograms=nothing, room_from_world=lambda: None)
    words = (hub.url, hub.invite().code)
    pointer = Pointer(words, {}, simulator=simulator, say=said.append)
    pointer.start()
    try:
        deadline = time.monotonic() + 120
        while not hub.headsets():
            assert time.monotonic() < deadline, said
            time.sleep(0.02)
        (headset,) = hub.headsets()
        assert (headset.person.name, headset.said.model) == ("Pointer", "Quest 3")
    finally:
        pointer.end()
        hub.close()
