"""The splats that paint a box, whatever hangs in the air around it."""

import numpy as np

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.package.records import ViewPoint
from scenes.prepare.cutout.votes.room_views import painting
from scenes.render.native import NativeRenderer
from scenes.splats import concatenate

CAMERA = Pinhole(160, 120, 140.0, 140.0, 80.0, 60.0)
SIZE = np.array([0.3, 0.2, 0.4])


def test_a_tenth_that_was_missed_paints_the_silhouettes_of_the_rest(box_on_floor):
    floor, box = box_on_floor(SIZE, floor_m=1.0, step_m=0.02)
    cloud, own = concatenate([floor, box]), np.arange(len(floor) + len(box)) >= len(floor)
    middle = np.array([0.0, 0.0, 0.2])
    views = [
        ViewPoint(
            f"{turn:.1f}",
            CAMERA,
            look_at(np.array([1.2 * np.cos(turn), 1.2 * np.sin(turn), 0.8]), middle),
        )
        for turn in np.linspace(0.1, 2 * np.pi + 0.1, 12, endpoint=False)
    ]
    guess = own & (np.random.default_rng(0).random(len(cloud)) > 0.1)
    found = painting(cloud, guess, views, renderer=NativeRenderer())
    seen = np.abs(cloud.means[:, 2]) > 0.002
    assert found[own & seen].mean() > 0.97
    framed = np.linalg.norm(cloud.means[:, :2], axis=1) < 0.6
    beside = framed & (np.abs(cloud.means[:, :2]) > 0.5 * SIZE[:2] + 0.05).any(axis=1)
    assert found[~own & beside].mean() < 0.01
