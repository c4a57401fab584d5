"""Both built-in rooms can be judged: every object has photos to mark it in, and one may fail."""

import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.evaluate.cutouts import photos_of, score_cutouts
from scenes.cameras import Pinhole
from scenes.package import ScenePackage
from scenes.pose import Pose
from scenes.prepare.reconstruction import View
from scenes.render.native import NativeRenderer
from scenes.samples import SAMPLE_NAMES, sample_room
from scenes.splats import SplatCloud
from sim.phone.path import HandShake, walk_around
from sim.phone.phone import SAMPLE_CAPTURE
from studio.console.progress import Progress

CAMERA = Pinhole.from_fov(96, 72, math.radians(SAMPLE_CAPTURE.fov_deg))


def views_of(room, count=SAMPLE_CAPTURE.frames):
    """Where the sample capture's phone is, with a coarse camera and without photos."""
    walk = walk_around(room, 80.0, np.random.default_rng(0), shake=HandShake(0.0, 0.0))
    return tuple(
        View(f"{k}.jpg", Path(f"{k}.jpg"), CAMERA, walk.world_from_camera((k + 0.5) / count * 80.0))
        for k in range(count)
    )


@pytest.mark.parametrize("name", SAMPLE_NAMES)
def test_the_sample_walk_shows_every_object_of_a_built_in_room(name):
    room = sample_room(name)
    views = views_of(room)
    for item in room.objects:
        shown = photos_of(item, room, views)
        assert shown, f"{name}: no photo shows {item.object_id} whole"
        assert all(outline.any() for _, outline in shown)


def test_an_object_that_no_photo_shows_does_not_end_the_table(tmp_path, caplog):
    room = sample_room("desk")
    n = 50
    rotations = np.tile(np.array([1, 0, 0, 0], np.float32), (n, 1))
    cloud = SplatCloud(
        np.random.default_rng(0).uniform(-1, 1, (n, 3)).astype(np.float32),
        np.full((n, 3), 0.02, np.float32),
        rotations,
        np.full(n, 0.9, np.float32),
        np.zeros((n, 1, 3), np.float32),
    )
    package = ScenePackage("desk", cloud, (), (), Pose.identity(), room.footprint_m, "desk")
    scores = score_cutouts(
        package,
        room,
        SimpleNamespace(reconstruction=SimpleNamespace(views=())),
        renderer=NativeRenderer(),
        folder=tmp_path,
        progress=Progress(lambda line, last: None),
    )
    assert [score.object_id for score in scores] == [item.object_id for item in room.objects]
    assert all((score.iou, score.exact) == (0.0, True) for score in scores)
    largest = [100 * max(item.box_m) for item in room.objects]
    assert [score.box_error_cm for score in scores] == pytest.approx(largest)
    assert "book-1 was not cut out: no view with a mask" in caplog.text
