"""The table's room as two lenses see it from anywhere, filmed from its meshes; and its map."""

import math
from dataclasses import replace

import numpy as np
import pytest

from devices.messages import Frame
from scenes.cameras import Fisheye, Rig
from scenes.frames import FRONT_FROM_BACK_LENS, WORLD_FROM_FORWARD_CAMERA
from scenes.pose import Pose, rotation_from_vector
from scenes.render.renderer import PosedSplats
from tests.conftest import raycast_picture
from tracking.camera.locating.room_map import map_of

LENS = Fisheye.from_fov(480, math.radians(200))
BACK = Pose(FRONT_FROM_BACK_LENS.rotation, np.array([0.0, 0.0, -0.03]))
RIG = Rig((LENS, LENS), (Pose.identity(), BACK))
GONE = "mug-1"
"""Of the scanned objects, the one that is not in the picture."""


def standing(place, yaw_deg, tilt_deg=0.0):
    """A camera at a place, turned about the vertical and tilted about world x."""
    tilt = rotation_from_vector(np.array([math.radians(tilt_deg), 0.0, 0.0]))
    level = Pose.from_yaw(math.radians(yaw_deg)).rotation @ WORLD_FROM_FORWARD_CAMERA.rotation
    return Pose(tilt @ level, np.array(place))


@pytest.fixture(scope="session")
def seen(table):
    """A function: what the camera sees from a pose, its focal length 1 % off, its pose unknown."""
    physical = table.physical
    meshes = [(mesh, Pose.identity()) for mesh in physical.static]
    for item in physical.objects:
        if item.object_id != GONE:
            meshes += [(mesh, item.world_from_object) for mesh in item.meshes]

    def film(world_from_rig):
        images = tuple(
            np.asarray(raycast_picture(meshes, LENS, world_from_rig @ pose, shade=False)[0])
            for pose in RIG.rig_from_lens
        )
        # Another exposure, and noise.
        noise = np.random.default_rng(0).normal(0.0, 2.0, images[0].shape)
        images = tuple(np.clip(0.8 * i + noise, 0, 255).astype(np.uint8) for i in images)
        known = replace(LENS, f_px=1.01 * LENS.f_px)
        return Frame("camera", 0, 0, 0, images, Rig((known, known), RIG.rig_from_lens), None)

    return film


@pytest.fixture(scope="session")
def there():
    """Pose of the camera in most tests."""
    return standing((0.55, -0.75, 1.35), 130.0, 6.0)


@pytest.fixture(scope="session")
def frame(seen, there):
    """Its pictures there."""
    return seen(there)


@pytest.fixture(scope="session")
def objects(table):
    """The scanned objects where they were scanned."""
    return tuple(PosedSplats(m.source.splats, table.poses[n]) for n, m in table.models.items())


@pytest.fixture(scope="session")
def room_map(table, objects):
    """The room from everywhere."""
    rng = np.random.default_rng(0)
    return map_of(
        table.scan.room, table.renderer, objects=objects, rng=rng, advance=lambda _share: True
    )
