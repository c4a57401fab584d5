"""A live session in the tiny room with a real camera on a real socket, and a tracker at no cost."""

from __future__ import annotations

import threading
from types import SimpleNamespace

import numpy as np
import pytest

from devices.camera.address import parse_address
from devices.camera.lenses.layout import Arrangement, LensLayout
from devices.clock import WallClock
from studio.live.live import LiveSession
from studio.live.setup import LiveSetup, Place
from studio.session import opening
from tests.pushed_camera import FedPicture, RtmpPush, StreamOptions

LAYOUT = LensLayout(Arrangement.SIDE_BY_SIDE, (0, 0))
FPS = 20
LENS_PX = 128
"""Side of a lens in the pictures that are pushed."""


def textured(count=None, size=(2 * LENS_PX, LENS_PX)):
    """Pictures with a texture that moves, at 20 Hz; bright enough for the light to pass."""
    generator = np.random.default_rng(3)
    ground = np.kron(generator.integers(60, 220, (16, 32, 3)), np.ones((8, 8, 1))).astype(np.uint8)
    number = 0
    while count is None or number < count:
        picture = np.roll(ground, 4 * number, axis=1)
        yield FedPicture(round(number * 1e9 / FPS), picture[: size[1], : size[0]].copy())
        number += 1


@pytest.fixture
def live(tiny, tmp_path, monkeypatch):
    """Makes sessions that end with the test; `push` streams to one, `run` plays it in a thread."""
    monkeypatch.setattr(opening, "make_method", lambda name, scene, *_, **__: tiny.tracker(0.0))
    clock = WallClock()
    made, pushes = [], []

    def session(*, layout=LAYOUT, record=True, asks=False, locate=None, people=None, **options):
        setup = LiveSetup(
            parse_address("rtmp://127.0.0.1:0/live/room"),
            layout=layout,
            **{"place": Place.SCAN, "calibrates": False, **options},
        )
        one = LiveSession(
            "tiny",
            tiny.scene,
            setup,
            clock=clock,
            renderer=None,
            locate=locate,
            record_to=tmp_path / "live.mcap" if record else None,
            asks=asks,
            people=people,
        )
        made.append(one)
        return one

    def push(one, pictures=None):
        until(lambda: one.status().listening_at)
        options = StreamOptions(fps=FPS, bitrate=2_000_000, keyframe_interval=5)
        stream = RtmpPush(one.status().listening_at, pictures or textured(), clock, options=options)
        pushes.append(stream)
        return stream

    def run(one, watch=lambda output: None):
        played = SimpleNamespace(result=None, error=None)

        def play():
            try:
                played.result = one.run(watch)
            except Exception as error:  # noqa: BLE001 - the test looks at it
                played.error = error

        played.thread = threading.Thread(target=play, daemon=True)
        played.thread.start()
        return played

    def until(condition, seconds=120.0):
        waiter = threading.Event()
        for _ in range(round(seconds / 0.02)):
            if condition():
                return
            waiter.wait(0.02)
        raise AssertionError("not reached in time")

    yield SimpleNamespace(
        session=session, push=push, run=run, until=until, clock=clock, folder=tmp_path
    )
    for stream in pushes:
        stream.close()
    for one in made:
        one.end()
