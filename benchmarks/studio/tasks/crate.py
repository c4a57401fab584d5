"""A scan of a floor with a crate on it, and boxes around the crate in its views."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.package import ScenePackage
from scenes.package.records import ViewPoint
from scenes.pose import Pose
from scenes.splats import SplatCloud
from studio.app.preparation.cut_job import Mark

CAMERA = Pinhole(240, 180, 200.0, 200.0, 120.0, 90.0)
LOW, HIGH = np.array([-0.15, -0.1, 0.0]), np.array([0.15, 0.1, 0.25])
"""Corners of the crate, metres."""

EYES = ((0.9, 0.2, 0.6), (-0.5, 0.8, 0.6), (-0.4, -0.8, 0.7))
"""Where it is seen from, metres from its middle."""

MARGIN_PX = 5.0


def crate_scene() -> ScenePackage:
    """Nine thousand splats of floor, eighteen hundred of crate, three views."""
    rng = np.random.default_rng(1)
    floor = rng.uniform((-0.8, -0.8, 0), (0.8, 0.8, 0.001), (9000, 3))
    under = ((floor[:, :2] > LOW[:2]) & (floor[:, :2] < HIGH[:2])).all(axis=1)
    crate = rng.uniform(LOW, HIGH, (1800, 3))
    side = rng.integers(0, 3, len(crate))
    end = np.where(rng.random(len(crate)) < 0.5, LOW[side], HIGH[side])
    crate[np.arange(len(crate)), side] = end
    clouds = (_splats(floor[~under], (0.75, 0.7, 0.6)), _splats(crate, (0.2, 0.3, 0.5)))
    room = SplatCloud(
        *(
            np.concatenate([getattr(cloud, field) for cloud in clouds])
            for field in ("means", "scales", "rotations", "opacities", "sh")
        )
    )
    centre = 0.5 * (LOW + HIGH)
    views = tuple(
        ViewPoint(f"{number}.png", CAMERA, look_at(centre + eye, centre))
        for number, eye in enumerate(EYES)
    )
    footprint_m = np.array([[-1.0, -1.0], [1.0, 1.0]])
    return ScenePackage("crate", room, (), (), Pose.identity(), footprint_m, None, (), views)


def crate_marks(scene: ScenePackage) -> Sequence[Mark]:
    """A box around the crate in every view."""
    corners = np.array(np.meshgrid(*np.stack([LOW, HIGH], axis=1))).reshape(3, -1).T
    found = []
    for view in scene.views:
        pixels, _ = view.camera.project(view.world_from_camera.inverse() @ corners)
        low, high = pixels.min(axis=0) - MARGIN_PX, pixels.max(axis=0) + MARGIN_PX
        found.append(Mark(view.name, (low[0], low[1], high[0], high[1])))
    return found


def _splats(points: NDArray[np.float64], colour: Sequence[float]) -> SplatCloud:
    n = len(points)
    sh = np.full((n, 1, 3), (np.asarray(colour) - 0.5) / 0.2820948, np.float32)
    scales = np.full((n, 3), 0.012, np.float32)
    scales[:, 2] = 0.002
    turns = np.tile(np.array([1, 0, 0, 0], np.float32), (n, 1))
    return SplatCloud(points.astype(np.float32), scales, turns, np.full(n, 0.9, np.float32), sh)
