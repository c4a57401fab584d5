"""A simulated headset in a process of its own, worn."""

import time
from contextlib import ExitStack

import pytest

from devices.clock import WallClock
from scenes.opening import open_scene
from studio.live.hololens.simulated.headset import SimulatedHeadset
from studio.live.hololens.wearing import worn_for


def test_only_built_in_rooms_can_be_seen_by_it():
    with pytest.raises(ValueError, match="built-in"):
        SimulatedHeadset("/tmp/room", seed=0, clock=WallClock(), say=print)


@pytest.mark.slow
def test_it_is_worn_anchored_and_drawn_on():
    scene, clock = open_scene("lab"), WallClock()
    with ExitStack() as stack:
        wearing = worn_for(
            None,
            scene,
            scene_name="lab",
            seed=0,
            clock=clock,
            hub=lambda: None,
            stack=stack,
            say=print,
        )
        wearing.worn.start()
        deadline = time.monotonic() + 60.0
        while wearing.simulated.figures.origin_mm.percentile(50) is None:
            assert time.monotonic() < deadline, wearing.worn.status()
            time.sleep(0.1)
        wearing.worn.close()
        names = {row.name for row in wearing.rows()}
    assert {"hololens.video_ms.p95", "hololens.hands_ms.p95", "hololens.origin_mm"} <= names
