"""Open3D's splat renderer on the same file and camera, as a peer for the benchmark.

Runs in a process of its own: without a Vulkan driver Open3D aborts instead of raising.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Pinhole
from scenes.formats.registry import write_splats
from scenes.pose import Pose
from scenes.splats import SplatCloud

TIMEOUT_S = 240
REPEATS = 3
DRIVER_FOLDERS = (Path("/usr/share/vulkan/icd.d"), Path("/etc/vulkan/icd.d"))


@dataclass(frozen=True, slots=True, eq=False)
class PeerResult:
    """Time and memory that Open3D needed for one picture.

    Attributes:
        cpu_ms: median process CPU time, all its threads together.
        rgb: (H, W, 3) uint8, its picture.
    """

    cpu_ms: float
    rgb: NDArray[np.uint8]


def why_not() -> str | None:
    """Why Open3D cannot draw splats here, or None if it can."""
    if not any(folder.is_dir() and any(folder.iterdir()) for folder in DRIVER_FOLDERS):
        return "no Vulkan driver; on Debian: apt-get install mesa-vulkan-drivers libvulkan1"
    return None


def draw_with_open3d(cloud: SplatCloud, camera: Pinhole, world_from_camera: Pose) -> PeerResult:
    """Time Open3D 0.20's `gaussianSplat` shader on a cloud.

    Raises:
        RuntimeError: the process failed or did not answer.
    """
    with tempfile.TemporaryDirectory() as folder:
        scene, picture = Path(folder) / "scene.ply", Path(folder) / "picture.npy"
        write_splats(scene, cloud)
        job = {
            "scene": str(scene),
            "picture": str(picture),
            "size": [camera.width_px, camera.height_px],
            "intrinsics": [[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]],
            "camera_from_world": world_from_camera.inverse().matrix().tolist(),
        }
        try:
            done = subprocess.run(
                [sys.executable, "-m", "benchmarks.raster.open3d_peer"],
                input=json.dumps(job),
                capture_output=True,
                text=True,
                timeout=TIMEOUT_S,
                check=False,
            )
        except subprocess.TimeoutExpired:
            raise RuntimeError(f"Open3D gave no picture in {TIMEOUT_S} s") from None
        if done.returncode != 0 or not picture.exists():
            last = (done.stderr.strip().splitlines() or ["no message"])[-1]
            raise RuntimeError(f"Open3D failed (exit {done.returncode}): {last}")
        times = json.loads(done.stdout.strip().splitlines()[-1])
        return PeerResult(float(np.median(times)), np.load(picture))


def _draw(job: dict[str, Any]) -> list[float]:
    import open3d as o3d

    rendering = o3d.visualization.rendering
    width, height = job["size"]
    renderer = rendering.OffscreenRenderer(width, height)
    material = rendering.MaterialRecord()
    material.shader = "gaussianSplat"
    renderer.scene.set_background([0.0, 0.0, 0.0, 1.0])
    renderer.scene.add_geometry("splats", o3d.t.io.read_point_cloud(job["scene"]), material)
    renderer.setup_camera(
        np.array(job["intrinsics"]), np.array(job["camera_from_world"]), width, height
    )
    rgb = np.asarray(renderer.render_to_image())
    times = []
    for _ in range(REPEATS):
        started = time.process_time_ns()
        rgb = np.asarray(renderer.render_to_image())
        times.append((time.process_time_ns() - started) / 1e6)
    np.save(str(job["picture"]), rgb)
    return times


if __name__ == "__main__":
    print(json.dumps(_draw(json.load(sys.stdin))))
