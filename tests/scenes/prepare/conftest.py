"""A small textured room and a painted ball, photographed from known places."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.mesh import TexturedMesh
from scenes.pose import Pose
from scenes.prepare.footage.capture import CaptureOptions
from scenes.prepare.footage.gather import gather
from scenes.prepare.poses.sfm.job import SfmOptions
from scenes.prepare.poses.sfm.run import reconstruct
from scenes.prepare.reconstruction import Reconstruction, View
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats, RenderOptions
from scenes.splats import SH_C0, SplatCloud

PHOTOS = Path(__file__).parents[3].parent / "shared" / "data" / "photos_lund" / "images"
CAMERA = Pinhole.from_fov(480, 360, 1.2)


@dataclass(frozen=True)
class Photographed:
    folder: Path
    camera: Pinhole
    world_from_camera: dict[str, Pose]


def speckles(rng: np.random.Generator, size: int = 512) -> np.ndarray:
    """A picture full of corners of all sizes."""
    canvas = np.full((size, size, 3), 128, dtype=np.uint8)
    for k in range(700):
        at = rng.integers(0, size, 2)
        reach = rng.integers(3, 8 + 60 // (1 + k // 80), 2)
        colour = tuple(int(v) for v in rng.integers(20, 236, 3))
        low, high = at - reach, at + reach
        cv2.rectangle(canvas, tuple(map(int, low)), tuple(map(int, high)), colour, -1)
    return canvas


@pytest.fixture(scope="session")
def speckled():
    return speckles


@pytest.fixture(scope="session")
def photographed(raycast, tmp_path_factory) -> Photographed:
    """Twelve photos of a speckled corner with a crate in it, on an arc around it."""
    poses = {}
    for k, angle in enumerate(np.linspace(0.1, 0.8, 12)):
        eye = 3.4 * np.array([np.sin(angle), -np.cos(angle), 0.0]) + [
            0.6,
            3.4,
            1.4 + 0.04 * (k % 3),
        ]
        poses[f"{k:02d}.jpg"] = look_at(eye, np.array([1.1, 2.6, 0.9]))
    return take_photos(raycast, tmp_path_factory.mktemp("photographed"), poses)


def take_photos(raycast, folder: Path, poses: dict[str, Pose]) -> Photographed:
    """Photos of the corner from given places."""
    rng = np.random.default_rng(5)
    meshes = [
        (plane(rng, (0, 0, 0), (4, 0, 0), (0, 4, 0)), Pose.identity()),
        (plane(rng, (0, 4, 0), (4, 0, 0), (0, 0, 3)), Pose.identity()),
        (plane(rng, (0, 0, 0), (0, 4, 0), (0, 0, 3)), Pose.identity()),
        (plane(rng, (1, 2.0, 0.9), (0.9, 0.3, 0), (-0.3, 0.9, 0)), Pose.identity()),
        (plane(rng, (1, 2.0, 0), (0.9, 0.3, 0), (0, 0, 0.9)), Pose.identity()),
    ]
    for name, world_from_camera in poses.items():
        picture, _, _ = raycast(meshes, CAMERA, world_from_camera, shade=False)
        cv2.imwrite(str(folder / name), picture[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 95])
    return Photographed(folder, CAMERA, poses)


@pytest.fixture(scope="session")
def captured(photographed, tmp_path_factory):
    """The photographed room as a `Capture`, and the folder for what is made of it."""
    work = tmp_path_factory.mktemp("sfm")
    options = CaptureOptions(frames=12, least_frames=3)
    return gather(photographed.folder, work, options=options), work


@pytest.fixture(scope="session")
def reconstructed(captured):
    """What structure from motion made of it in that folder, and the progress it told."""
    capture, work = captured
    told = []
    options = SfmOptions(features=1500, finest=False, threads=2)
    reconstruction, report = reconstruct(
        capture, work, options=options, progress=lambda done, note: told.append((done, note))
    )
    return reconstruction, report, told


def plane(rng, origin, across, up) -> TexturedMesh:
    o, a, b = (np.array(v, dtype=np.float64) for v in (origin, across, up))
    corners = np.stack([o, o + a, o + a + b, o + b])
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.float32)
    faces = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)
    return TexturedMesh(corners, faces, uv, speckles(rng))


@pytest.fixture(scope="session")
def real_photos() -> Path:
    """A folder of real photos, which are not part of the repository."""
    if not PHOTOS.is_dir():
        pytest.skip(f"real photos are not at {PHOTOS}")
    return PHOTOS


def painted_ball(n=1500, seed=0):
    """Splats on a ball of 1 m radius, in soft stripes."""
    rng = np.random.default_rng(seed)
    means = rng.normal(size=(n, 3))
    means /= np.linalg.norm(means, axis=1, keepdims=True)
    colours = 0.5 + 0.4 * np.sin(means @ rng.normal(0, 3, (3, 3)))
    return SplatCloud(
        means.astype(np.float32),
        np.full((n, 3), 0.05, dtype=np.float32),
        np.tile(np.array([1, 0, 0, 0], dtype=np.float32), (n, 1)),
        np.full(n, 0.95, dtype=np.float32),
        ((colours - 0.5) / SH_C0)[:, None].astype(np.float32),
    )


@pytest.fixture(scope="session")
def filmed_ball(tmp_path_factory):
    """A reconstruction of the ball from sixteen photos of 96×72 px."""
    folder = tmp_path_factory.mktemp("photos")
    cloud = painted_ball()
    camera = Pinhole.from_fov(96, 72, np.radians(50))
    views = []
    for k in range(16):
        angle = 2 * np.pi * k / 16
        eye = np.array([3 * np.cos(angle), 3 * np.sin(angle), 0.8 * np.sin(3 * angle)])
        pose = look_at(eye, np.zeros(3))
        posed = PosedSplats(cloud, Pose.identity())
        drawn = NativeRenderer().render([posed], camera, pose, RenderOptions())
        picture = np.round(255 * np.clip(drawn.rgb, 0, 1)).astype(np.uint8)
        path = folder / f"{k:02d}.png"
        cv2.imwrite(str(path), picture[..., ::-1])
        views.append(View(path.name, path, camera, pose))
    chosen = np.random.default_rng(1).choice(len(cloud), 400, replace=False)
    return Reconstruction(
        tuple(views),
        cloud.means[chosen].astype(np.float64),
        np.round(255 * np.clip(cloud.colours()[chosen], 0, 1)).astype(np.uint8),
        np.zeros(400, dtype=np.float32),
    )
