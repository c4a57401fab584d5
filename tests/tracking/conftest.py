"""The table of the room `desk`, seen through one lens: meshes are filmed, splats are the models."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import cv2
import numpy as np
import pytest

from benchmarks.bake.bake import ScanImperfections, bake
from devices.messages import Frame
from scenes.cameras import Fisheye, Rig
from scenes.opening import open_scene
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.samples import sample_room
from tests.conftest import raycast_picture
from tracking.background.images import LensExposures, render_background
from tracking.background.layers import LayerCache
from tracking.evidence.evidence import Scene, gather, view_of
from tracking.follow.track import Task, new_track
from tracking.model.object_model import make_model
from tracking.model.support_planes import support_planes_in

LENS = Fisheye.from_fov(960, math.radians(200))
RIG = Rig((LENS,), (Pose.identity(),))
NOISE = 2.0
ROOM_SPLATS = 4000
"""Of the baked room, which nothing uses."""
GONE = Pose(np.eye(3), np.array([0.0, 0.0, -5.0]))


@dataclass(frozen=True)
class Table:
    """The room `desk`: what is filmed, and what the tracker knows of it."""

    physical: object
    scan: object
    renderer: NativeRenderer
    models: dict
    background: object
    support_planes: object

    @property
    def poses(self):
        """Poses at which the objects were scanned."""
        return {name: model.source.world_from_object for name, model in self.models.items()}

    def filmed(self, poses, *, seq=0, t_ns=0):
        """A frame with the objects at these poses, the others where they were scanned."""
        meshes = [(mesh, Pose.identity()) for mesh in self.physical.static]
        shade = [False] * len(meshes)
        for thing in self.physical.objects:
            pose = poses.get(thing.object_id, thing.world_from_object)
            meshes += [(mesh, pose) for mesh in thing.meshes]
            shade += [True] * len(thing.meshes)
        world_from_rig = self.physical.world_from_rig
        light = self.physical.light_direction
        rgb, _, _ = raycast_picture(
            meshes, LENS, world_from_rig, shade=shade, light_direction=light
        )
        noise = np.random.default_rng(seq).normal(0.0, NOISE, rgb.shape)
        blurred = cv2.GaussianBlur(rgb, (0, 0), 0.7) + noise
        image = np.clip(blurred, 0, 255).astype(np.uint8)
        return Frame("camera", seq, t_ns, t_ns, (image,), RIG, world_from_rig)

    def scene(self, poses=None, **stamp):
        """Such a frame before any object is looked at."""
        frame = self.filmed(poses or {}, **stamp)
        return Scene(
            frame=frame,
            world_from_rig=frame.world_from_rig,
            camera_sigma=np.full(6, 1e-3),
            background=self.background,
            exposures=LensExposures(frame.images, self.background),
            renderer=self.renderer,
            bounds_m=np.percentile(self.scan.room.means.astype(np.float64), [0.2, 99.8], axis=0),
            support_planes=self.support_planes,
            layers=LayerCache(),
        )

    def neighbours(self, name, without=()):
        """All other objects where they were scanned."""
        return tuple(
            (model, self.poses[other])
            for other, model in self.models.items()
            if other != name and other not in without
        )

    def task(self, scene, name, *, neighbours=None, **remembered):
        """One object in a frame; `remembered` of its track."""
        return Task(
            scene=scene,
            model=self.models[name],
            track=replace(new_track(self.models[name]), **remembered),
            neighbours=self.neighbours(name) if neighbours is None else neighbours,
            support_heights_m=self.support_planes.heights_m,
            is_turn=False,
            is_first=False,
            may_search=True,
            may_compare=True,
            use_texture=True,
            interval_ns=33_000_000,
        )

    def evidence(self, scene, name, world_from_object, neighbours=None):
        """An object's window, where it is believed to be."""
        model = self.models[name]
        beside = self.neighbours(name) if neighbours is None else neighbours
        return gather(scene, model, view_of(scene, model, world_from_object), beside)


@pytest.fixture(scope="session")
def table():
    """The room `desk` with its book, mug and box."""
    pytest.importorskip("open3d")
    physical, scan, renderer = sample_room("desk"), open_scene("desk"), NativeRenderer()
    # The scan's objects were filmed in traced light; those baked here, in the light cast here.
    flaws = ScanImperfections(scale_error=0.0)
    rng = np.random.default_rng(8)
    _, objects = bake(physical, rng=rng, room_splats=ROOM_SPLATS, imperfections=flaws)
    return Table(
        physical,
        scan,
        renderer,
        {item.object_id: make_model(item, renderer) for item in objects},
        render_background(renderer, scan.room, RIG, physical.world_from_rig),
        support_planes_in(scan.room, scan.objects),
    )


@pytest.fixture(scope="session")
def mug_elsewhere(table):
    """A frame in which the mug was put elsewhere and turned, and where it is now."""
    before = table.poses["mug-1"]
    now = Pose.from_yaw(before.yaw() + 1.0, before.translation + np.array([0.18, -0.1, 0.0]))
    return table.scene({"mug-1": now}), now


@pytest.fixture(scope="session")
def as_scanned(table):
    """A frame in which everything stands where it was scanned."""
    return table.scene()


@pytest.fixture(scope="session")
def no_mug(table):
    """A frame in which the mug is nowhere."""
    return table.scene({"mug-1": GONE})
