"""A striped floor that was photographed and prepared, coarsely, with six small photos beside it."""

from pathlib import Path

import cv2
import numpy as np

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.package import ScenePackage, save_package
from scenes.package.records import ViewPoint
from scenes.pose import Pose
from scenes.prepare.pipeline import POINTS_FOLDER
from scenes.prepare.reconstruction import Reconstruction, View, save_reconstruction
from scenes.render.native import NativeRenderer
from scenes.render.reduction import merged
from scenes.render.renderer import PosedSplats, RenderOptions
from scenes.splats import SplatCloud

CAMERA = Pinhole.from_fov(96, 72, 0.9)


def make_prepared_floor(folder: Path) -> Path:
    """Write the photos, the work folder and the scene; returns the scene's folder."""
    rng = np.random.default_rng(5)
    means = rng.uniform((-1, -1, 0), (1, 1, 0.002), (3000, 3))
    sh = 1.2 * np.sin(9 * means[:, :1, None] + np.array([0.0, 1.0, 2.0]))
    fine = SplatCloud(
        means,
        np.tile([0.04, 0.04, 0.002], (3000, 1)),
        np.tile([1.0, 0, 0, 0], (3000, 1)),
        np.full(3000, 0.95),
        sh.astype(np.float32),
    )
    views = []
    for k in range(6):
        turn = k * np.pi / 3
        pose = look_at(np.array([1.5 * np.cos(turn), 1.5 * np.sin(turn), 1.4]), np.zeros(3))
        posed = [PosedSplats(fine, Pose.identity())]
        drawn = NativeRenderer().render(posed, CAMERA, pose, RenderOptions())
        path = folder / f"{k}.png"
        cv2.imwrite(str(path), np.round(255 * np.clip(drawn.rgb, 0, 1))[..., ::-1])
        views.append(View(path.name, path, CAMERA, pose))
    scene, work = folder / "floor.gnx", folder / "floor.gnx.prepare"
    (work / "training").mkdir(parents=True)
    (work / "outdoor points").mkdir()
    nothing = np.zeros((0, 3))
    kept = Reconstruction(
        tuple(views), nothing, nothing.astype(np.uint8), np.zeros(0, dtype=np.float32)
    )
    save_reconstruction(kept, work / "outdoor points" / POINTS_FOLDER)
    points = tuple(ViewPoint(v.name, v.camera, v.world_from_camera) for v in views)
    corners = np.array([[-1.0, -1.0], [1.0, 1.0]])
    room = merged(fine, 0.15)
    save_package(
        ScenePackage("floor", room, (), (), Pose.identity(), corners, None, views=points), scene
    )
    return scene
