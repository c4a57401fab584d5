"""A crate on a floor that photos saw from one side, as a scene with one object."""

from __future__ import annotations

import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.package import ScenePackage
from scenes.package.records import ViewPoint
from scenes.pose import Pose
from scenes.splats import concatenate
from scenes.state import ObjectModel

SIZE_M = (0.4, 0.3, 0.5)
LENS = Pinhole(320, 240, 260.0, 260.0, 160.0, 120.0)


def view_of(eye, name="a.jpg", target=(0.0, 0.0, 0.25), camera=LENS):
    return ViewPoint(name, camera, look_at(np.array(eye, dtype=float), np.array(target)))


@pytest.fixture
def crate_seen_from(box_on_floor):
    """Makes the scene of a crate, seen from the eyes that are given, with more splats if wanted."""

    def made(*eyes, more=(), object_from_crate=None, views=None):
        floor, crate = box_on_floor(SIZE_M, floor_m=2.5, step_m=0.02)
        turn = object_from_crate or Pose.identity()
        item = ObjectModel(
            "crate", "Crate", "", crate.transformed(turn), SIZE_M, 0.0, turn.inverse()
        )
        seen = tuple(view_of(eye, f"{k}.jpg") for k, eye in enumerate(eyes))
        return ScenePackage(
            "r", concatenate([floor, *more]), (item,), (), Pose.identity(),
            np.array([[-2.5, -2.5], [2.5, 2.5]]), None, (), seen if views is None else views,
        )  # fmt: skip

    return made
