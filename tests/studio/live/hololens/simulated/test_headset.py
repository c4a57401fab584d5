"""A simulated headset in a process of its own, worn."""

import time
from contextlib import ExitStack
from dataclasses import replace

import pytest

from devices.clock import WallClock
from scenes.opening import open_scene
from scenes.package import save_package
from studio.live.hololens.wearing import worn_for


def worn_in(scene, name, stack):
    """A simulated headset, worn in a room."""
    return worn_for(
        None,
        scene,
        scene_name=name,
        seed=0,
        clock=WallClock(),
        hub=lambda: None,
        stack=stack,
        say=print,
    )


def test_a_room_without_a_surface_is_one_line(scanned_package):
    with ExitStack() as stack, pytest.raises(ValueError, match="kitchen has no surface") as error:
        worn_in(replace(scanned_package, collision=None), "out/kitchen", stack)
    assert "prepare it of photos" in str(error.value)
    assert "\n" not in str(error.value)


def test_a_room_that_cannot_be_rehearsed_in_says_why(scanned_package, tmp_path):
    save_package(scanned_package, tmp_path / "kitchen")
    with ExitStack() as stack, pytest.raises(ValueError, match="its photos are needed") as error:
        worn_in(scanned_package, str(tmp_path / "kitchen"), stack)
    assert "\n" not in str(error.value)


def test_it_is_worn_in_a_prepared_room_and_sees_its_mesh(scanned_package, tmp_path):
    room = replace(scanned_package, objects=())
    save_package(room, tmp_path / "kitchen")
    with ExitStack() as stack:
        wearing = worn_in(room, str(tmp_path / "kitchen"), stack)
        wearing.worn.start()
        deadline = time.monotonic() + 120
        while wearing.worn.view() is None or not wearing.worn.headset.status().surfaces:
            assert time.monotonic() < deadline, wearing.worn.status()
            time.sleep(0.1)
        wearing.worn.close()


@pytest.mark.slow
def test_it_is_worn_anchored_and_drawn_on():
    scene = open_scene("lab")
    with ExitStack() as stack:
        wearing = worn_in(scene, "lab", stack)
        wearing.worn.start()
        deadline = time.monotonic() + 120
        while wearing.simulated.figures.origin_mm.percentile(50) is None:
            assert time.monotonic() < deadline, wearing.worn.status()
            time.sleep(0.1)
        wearing.worn.close()
        names = {row.name for row in wearing.rows()}
    assert {"hololens.video_ms.p95", "hololens.hands_ms.p95", "hololens.origin_mm"} <= names
