from dataclasses import replace

import numpy as np
import pytest

from devices.replay import ReplayCamera
from scenes.state import LiveSurface
from studio.app.timeline.pictures.live_pictures import LiveReplay
from studio.app.timeline.pictures.thread import PictureThread
from studio.app.timeline.recorded.index import Changes

WALL = np.array([[-0.5, 1.0, 1.6], [0.5, 1.0, 1.6], [0.5, 1.0, 1.0], [-0.5, 1.0, 1.0]])
FROM_NS = 200_000_000


@pytest.fixture(scope="module")
def with_wall(index):
    """The recording with a live surface from its third frame on."""
    surface = LiveSurface("wall", WALL, (40, 24), "camera-360")
    return replace(index, surfaces={"wall": Changes([FROM_NS], [surface])})


@pytest.fixture(scope="module")
def frames(recording):
    return list(ReplayCamera(recording).frames())


def test_a_surface_shows_what_the_camera_saw_at_that_instant(with_wall, tiny, frames):
    replay = LiveReplay(with_wall, tiny.scene)
    first = replay.at(frames[3].t_ns, frames[3].t_ns, frames[3].images)
    later = replay.at(frames[8].t_ns, frames[8].t_ns, frames[8].images)
    assert [item.surface.surface_id for item in (*first, *later)] == ["wall", "wall"]
    assert first[0].picture.shape == (24, 40, 3)
    assert not np.array_equal(first[0].picture, later[0].picture)


def test_there_is_none_before_it_was_made(with_wall, tiny, frames):
    replay = LiveReplay(with_wall, tiny.scene)
    assert replay.has_any
    assert replay.at(0, 0, frames[0].images) == ()


def test_going_back_begins_anew(with_wall, tiny, frames):
    def shown(replay, number):
        frame = frames[number]
        return replay.at(frame.t_ns, frame.t_ns, frame.images)[0].picture

    replay = LiveReplay(with_wall, tiny.scene)
    shown(replay, 9)
    assert np.array_equal(shown(replay, 4), shown(LiveReplay(with_wall, tiny.scene), 4))


def test_the_thread_gives_them_after_the_picture(with_wall, tiny, frames):
    thread = PictureThread(with_wall, tiny.scene)
    try:
        thread.ask(frames[5].t_ns)
        live = thread.live.take(timeout_s=30)
        assert thread.pictures.take().t_ns == frames[5].t_ns
        assert [item.surface.surface_id for item in live] == ["wall"]
    finally:
        thread.stop()
