import time
from threading import Lock

import pytest

from devices.clock import WallClock
from devices.video import H264Encoder
from sim.wire.faults import FaultSchedule, read_fault
from sim.wire.film.film import FilmFormat
from sim.wire.film.film_file import FilmWriter, read_film
from sim.wire.streaming.camera import CameraPlan, FilmCamera
from tests.pushed_camera import numbered_pictures

FPS = 25


@pytest.fixture(scope="session")
def film(tmp_path_factory):
    """Two seconds of numbered pictures, a keyframe every fifth."""
    folder = tmp_path_factory.mktemp("film")
    writer = FilmWriter(folder, "numbers", FilmFormat(320, 160, FPS, "side_by_side"))
    encoder = H264Encoder(320, 160, FPS, 1_000_000, keyframe_interval=5)
    for k, picture in enumerate(numbered_pictures((320, 160), FPS, count=2 * FPS)):
        packet = encoder.encode(picture.rgb, k, picture.t_ns)[0]
        writer.add_unit(packet.data, t_ns=picture.t_ns, keyframe=packet.keyframe, shows=k)
    writer.finish(2_000_000_000)
    return read_film(folder)


class EventLog:
    """Events of a camera, in order."""

    def __init__(self):
        self._lock = Lock()
        self.events = []

    def __call__(self, event):
        with self._lock:
            self.events.append(event)

    def named(self, name):
        with self._lock:
            return [event for event in self.events if event.name == name]


@pytest.fixture
def event_log():
    return EventLog()


@pytest.fixture
def make_camera(film, event_log):
    """Makes cameras of the film that are closed in the end."""
    made = []

    def make(*faults, seconds=None, truth=None):
        schedule = FaultSchedule(map(read_fault, faults))
        camera = FilmCamera(
            CameraPlan(film, schedule, seconds),
            WallClock(),
            wall_ns=time.time_ns,
            say=event_log,
            truth=truth,
        )
        made.append(camera)
        return camera

    yield make
    for camera in made:
        camera.close()
