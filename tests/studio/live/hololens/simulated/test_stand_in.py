"""The process of a simulated headset: its room is that of the simulated camera."""

import time
from types import SimpleNamespace

import numpy as np
import pytest

from devices.clock import WallClock
from scenes.pose import Pose
from scenes.samples import sample_room
from scenes.workers.task import Task
from sim.hololens.drawing.scenery import CAMERA, Scenery
from sim.wire.film.film import PictureTruth
from sim.wire.streaming.truth_file import PictureTime, TruthWriter
from studio.live.hololens.simulated.headset import SimulatedHeadset
from studio.live.hololens.simulated.stand_in import follow
from tests.studio.browser import until


@pytest.fixture
def followed(tmp_path):
    """A scenery that follows a file, which is not there yet."""
    path, scenery = tmp_path / "truth of a camera.jsonl", Scenery(sample_room("lab"))
    task = Task("follow", lambda task: follow(path, scenery, task=task)).start()
    yield path, scenery
    task.cancel()
    task.join(10)
    assert not task.is_running


def test_objects_and_the_camera_are_seen_where_the_cameras_truth_has_them(followed):
    path, scenery = followed
    at_first = scenery.poses()
    writer = TruthWriter(path)
    rig = at_first[CAMERA] @ Pose.from_yaw(0.02, (0.01, 0.0, 0.0))
    places = [Pose.from_yaw(0.4, (0.1 * number, -0.5, 0.0)) for number in range(5)]
    for number, place in enumerate(places):
        truth = PictureTruth(0, {"chair-1": place}, {"chair-1": 1.0}, rig)
        writer.taken(PictureTime(number, 0, 0, 0), truth)
    until(bool, lambda: np.allclose(scenery.poses()["chair-1"].matrix(), places[-1].matrix()))
    until(bool, lambda: np.allclose(scenery.poses()[CAMERA].matrix(), rig.matrix()))
    assert scenery.poses()["chair-2"] is at_first["chair-2"]

    # A picture of which the film knows nothing moves nothing; half a line waits for the rest.
    writer.taken(PictureTime(5, 0, 0, 0, is_on=False), None)
    writer.close()
    line = path.read_text().splitlines()[0] + "\n"
    with path.open("a") as file:
        file.write(line[:100])
        file.flush()
        time.sleep(0.1)
        assert np.allclose(scenery.poses()["chair-1"].matrix(), places[-1].matrix())
        file.write(line[100:])
    until(bool, lambda: np.allclose(scenery.poses()["chair-1"].matrix(), places[0].matrix()))


def test_the_session_says_which_truth(tmp_path):
    said = []
    headset = SimulatedHeadset("lab", seed=0, clock=WallClock(), say=print)
    headset._process = SimpleNamespace(say=said.append)
    headset.follow(tmp_path / "a b.jsonl")
    assert said == [f"follow {tmp_path / 'a b.jsonl'}"]
