"""Fixtures shared by all tests."""

from __future__ import annotations

import gc
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Generator, Sequence
from functools import lru_cache
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import settings

from scenes.cameras import Camera, pixel_centres
from scenes.memory import collect_due
from scenes.mesh import TexturedMesh
from scenes.pose import Pose

# Every module, and the hundreds of processes that tests start, would be compiled anew each time.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

settings.register_profile("ci", derandomize=True, deadline=None, max_examples=40, database=None)
settings.load_profile("ci")

LONGEST = (
    "tests/golden/",
    "tests/tracking/test_tracker.py",
    "tests/tracking/follow/test_redetection.py",
    "tests/studio/verbs/test_fork.py",
    "tests/studio/app/shell/",
    "tests/studio/app/live/",
)
"""Beginnings of names of the tests that take longest: half a minute a file and more."""
AMBIENT, KEY = 0.55, 0.5
TEMPORARY = ("TMPDIR", "TEMP", "TMP")
"""Variables that name the system's temporary folder."""


def pytest_configure(config: pytest.Config) -> None:
    """Give each of several test processes a screen of its own.

    On a screen that is shared, without a window manager, a window that opens in one process takes
    the keyboard from the window that a test of another is typing into.
    """
    if not hasattr(config, "workerinput") or shutil.which("Xvfb") is None:
        return
    reading, writing = os.pipe()
    screen = ["-displayfd", str(writing), "-screen", "0", "1600x1000x24", "-noreset"]
    # A test process that is killed cleans nothing up: the screen ends with it all the same.
    ends_with_us = ["setpriv", "--pdeathsig", "TERM"] if shutil.which("setpriv") else []
    server = subprocess.Popen(
        [*ends_with_us, "Xvfb", *screen],
        pass_fds=(writing,),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    os.close(writing)
    with os.fdopen(reading) as answer:
        display = answer.readline().strip()
    if not display:  # it could not start: the screen that is there does
        server.wait()
        return
    os.environ["DISPLAY"] = f":{display}"
    config.add_cleanup(server.wait)
    config.add_cleanup(server.terminate)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put the files that take longest first: of several test processes none ends long after."""
    items.sort(key=lambda item: not item.nodeid.startswith(LONGEST))


def pytest_collection_finish(session: pytest.Session) -> None:
    """Leave what stays to the end, modules and tests, out of what is looked through for garbage.

    With ten thousand tests that is most of what there is, and it is looked through at every window
    that a test closes.
    """
    gc.collect()
    gc.freeze()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(
    item: pytest.Item, nextitem: pytest.Item | None
) -> Generator[None, object, object]:
    """Collect what holds only itself between tests of windows, as the window does between events.

    Any thread may be the one whose objects make Python collect: widgets of earlier tests that it
    frees there, while the window is at work, end the process without a word.
    """
    if not has_windows(item):
        return (yield)
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()
        if nextitem is None or not has_windows(nextitem):
            gc.collect()
        else:
            collect_due()


def has_windows(item: pytest.Item) -> bool:
    """Whether a test may make widgets."""
    return "qapp" in getattr(item, "fixturenames", ()) or item.get_closest_marker("gui") is not None


@pytest.fixture(scope="session", autouse=True)
def nothing_left(tmp_path_factory):
    """Gives the tests and their processes a temporary folder, which they must leave empty."""
    own = tmp_path_factory.mktemp("temporary")
    before = {name: os.environ.get(name) for name in TEMPORARY}
    os.environ.update(dict.fromkeys(TEMPORARY, str(own)))
    tempfile.tempdir = None
    yield
    for name, value in before.items():
        if value is None:
            del os.environ[name]
        else:
            os.environ[name] = value
    tempfile.tempdir = None
    gc.collect()
    left = sorted(path.name for path in own.iterdir())
    assert not left, f"left in the temporary folder: {', '.join(left)}"


@pytest.fixture(scope="session")
def raycast():
    """A function that takes a picture of textured meshes by ray casting: no renderer involved.

    `raycast(meshes, camera, world_from_camera, *, shade, light_direction)`, `meshes` being pairs
    (TexturedMesh, world_from_mesh), returns rgb (H, W, 3) uint8, range (H, W) float32 in metres (0
    where nothing is hit) and index (H, W) int32 into `meshes` (-1 where nothing is hit). `shade`,
    one bool or one per mesh, multiplies the texture by `ambient + key · max(0, n·l)`: for objects,
    whose textures are albedo, not for static meshes, whose textures are lit.
    """
    return raycast_picture


def over(
    near: tuple[np.ndarray, np.ndarray, np.ndarray], far: tuple[np.ndarray, np.ndarray, np.ndarray]
) -> np.ndarray:
    """rgb of two pictures of one camera, cast apart: of each pixel what is nearer.

    What does not move needs to be cast once only.
    """
    (rgb, reach, _), (beneath, reach_beneath, _) = near, far
    is_nearer = (reach > 0) & ((reach_beneath == 0) | (reach < reach_beneath))
    return np.where(is_nearer[..., None], rgb, beneath)


def raycast_picture(
    meshes: Sequence[tuple[TexturedMesh, Pose]],
    camera: Camera,
    world_from_camera: Pose,
    *,
    shade: bool | Sequence[bool],
    light_direction: Sequence[float] | np.ndarray = (-0.8, 0.18, 0.57),
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    o3d: Any = pytest.importorskip("open3d")

    scene = o3d.t.geometry.RaycastingScene()
    for mesh, world_from_mesh in meshes:
        scene.add_triangles(
            (world_from_mesh @ mesh.vertices).astype(np.float32), mesh.faces.astype(np.uint32)
        )
    rays_in_camera, inside_lens = _rays(camera)
    rays = rays_in_camera @ world_from_camera.rotation.T
    origins = np.broadcast_to(world_from_camera.translation, rays.shape)
    hits = scene.cast_rays(
        o3d.core.Tensor(np.concatenate([origins, rays], axis=1).astype(np.float32))
    )
    distance = hits["t_hit"].numpy()
    geometry = hits["geometry_ids"].numpy()
    triangle = hits["primitive_ids"].numpy()
    barycentric = hits["primitive_uvs"].numpy()
    normals = hits["primitive_normals"].numpy()
    light = np.asarray(light_direction, dtype=np.float64)
    light = light / np.linalg.norm(light)
    shaded = [shade] * len(meshes) if isinstance(shade, bool) else list(shade)

    rgb = np.zeros((len(rays), 3), dtype=np.uint8)
    index = np.full(len(rays), -1, dtype=np.int32)
    for number, (mesh, _) in enumerate(meshes):
        here = np.flatnonzero((geometry == number) & np.isfinite(distance) & inside_lens)
        if not len(here):
            continue
        index[here] = number
        colour = _lookup(mesh, triangle[here], barycentric[here])
        if shaded[number]:
            lambert = np.abs(normals[here] @ light) * (
                np.sign(normals[here] @ light) == -np.sign((normals[here] * rays[here]).sum(axis=1))
            )
            colour = colour * (AMBIENT + KEY * lambert)[:, None]
        rgb[here] = np.clip(colour + 0.5, 0, 255).astype(np.uint8)
    shape = (camera.height_px, camera.width_px)
    reach = np.where(index >= 0, distance, 0.0).astype(np.float32)
    return rgb.reshape(*shape, 3), reach.reshape(shape), index.reshape(shape)


@lru_cache(maxsize=2)
def _rays(camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """Rays of all pixels in the camera's axes, and which of them its lens sees."""
    rays = camera.unproject(pixel_centres(camera))
    return rays, camera.project(rays)[1]


def _lookup(mesh: TexturedMesh, triangle: np.ndarray, barycentric: np.ndarray) -> np.ndarray:
    """Bilinear texture colours 0..255 at points of triangles."""
    b, c = barycentric[:, :1], barycentric[:, 1:]
    corners = mesh.uv[mesh.faces[triangle]]
    uv = (1 - b - c) * corners[:, 0] + b * corners[:, 1] + c * corners[:, 2]
    height, width = mesh.texture.shape[:2]
    x = (uv[:, 0] * width - 0.5).astype(np.float32)
    y = ((1 - uv[:, 1]) * height - 0.5).astype(np.float32)
    parts = [
        cv2.remap(
            mesh.texture,
            x[start : start + 30000, None],
            y[start : start + 30000, None],
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REPLICATE,
        ).reshape(-1, 3)
        for start in range(0, len(x), 30000)
    ]
    return np.concatenate(parts).astype(np.float32)
