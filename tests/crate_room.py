"""A room with a grey crate on its floor, as photos made it: nothing is cut out yet."""

import numpy as np

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.package import ScenePackage, load_package, save_package
from scenes.package.records import ViewPoint
from scenes.pose import Pose
from scenes.splats import SplatCloud

CAMERA = Pinhole(240, 180, 200.0, 200.0, 120.0, 90.0)
LOW, HIGH = np.array([-0.15, -0.1, 0.0]), np.array([0.15, 0.1, 0.25])


def splats_on(points, colour):
    n = len(points)
    sh = np.full((n, 1, 3), (np.asarray(colour) - 0.5) / 0.2820948)
    scales = np.full((n, 3), 0.012)
    scales[:, 2] = 0.002
    return SplatCloud(points, scales, np.tile([1.0, 0, 0, 0], (n, 1)), np.full(n, 0.9), sh)


def joined(*clouds):
    fields = ("means", "scales", "rotations", "opacities", "sh")
    return SplatCloud(*(np.concatenate([getattr(c, f) for c in clouds]) for f in fields))


def save_crate_room(folder):
    """The folder of a scene with one crate and three views of it, made in another."""
    rng = np.random.default_rng(1)
    floor = rng.uniform((-0.8, -0.8, 0), (0.8, 0.8, 0.001), (9000, 3))
    under = ((floor[:, :2] > LOW[:2]) & (floor[:, :2] < HIGH[:2])).all(axis=1)
    crate = rng.uniform(LOW, HIGH, (1800, 3))
    side = rng.integers(0, 3, len(crate))
    end = np.where(rng.random(len(crate)) < 0.5, LOW[side], HIGH[side])
    crate[np.arange(len(crate)), side] = end
    room = joined(splats_on(floor[~under], (0.75, 0.7, 0.6)), splats_on(crate, (0.2, 0.3, 0.5)))
    centre = 0.5 * (LOW + HIGH)
    views = tuple(
        ViewPoint(f"{k}.png", CAMERA, look_at(centre + eye, centre))
        for k, eye in enumerate([(0.9, 0.2, 0.6), (-0.5, 0.8, 0.6), (-0.4, -0.8, 0.7)])
    )
    package = ScenePackage(
        "crate", room, (), (), Pose.identity(), np.array([[-1.0, -1], [1, 1]]), None, (), views
    )
    save_package(package, folder / "crate.gnx")
    return folder / "crate.gnx"


def boxes_around_crate(scene, pad_px):
    """Name, first and last pixel of the crate in every view of a scene, and so many around it."""
    corners = np.array(np.meshgrid(*np.stack([LOW, HIGH], axis=1))).reshape(3, -1).T
    for view in load_package(scene).views:
        pixels, _ = view.camera.project(view.world_from_camera.inverse() @ corners)
        yield view.name, pixels.min(axis=0) - pad_px, pixels.max(axis=0) + pad_px
