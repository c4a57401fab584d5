"""Our renderer against other programs' on the same scene: CPU time over CPU time."""

from __future__ import annotations

import sys
import time

import numpy as np

from benchmarks.raster.open3d_peer import draw_with_open3d, why_not
from benchmarks.raster.splat_scenes import bench_object, bench_room, object_camera, room_camera
from scenes.cameras import Pinhole
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats, RenderOptions
from scenes.splats import SplatCloud
from studio.console.rows import Row, at_least

OPEN3D_BAR = 30.0
REPEATS = 9


def peer_rows(native: NativeRenderer, rng: np.random.Generator) -> list[Row]:
    """How many times Open3D's CPU time is ours; nothing where Open3D cannot draw."""
    reason = why_not()
    if reason is not None:
        print(f"bench raster: left out Open3D: {reason}", file=sys.stderr)
        return []
    scenes = {
        "room_640": (bench_room(300_000, rng), room_camera(640, 640)),
        "object_260": (bench_object(20_000, rng), object_camera(260)),
    }
    rows = []
    for name, (cloud, (camera, pose)) in scenes.items():
        print(f"bench raster: Open3D {name}", file=sys.stderr)
        peer = draw_with_open3d(cloud, camera, pose)
        ours_ms, rgb = _cpu_ms(native, cloud, camera, pose)
        apart = float(np.abs(peer.rgb / 255.0 - np.clip(rgb, 0.0, 1.0)).mean())
        ratio = peer.cpu_ms / ours_ms
        rows.append(at_least(f"raster.vs_open3d.{name}", ratio, "x", bar=OPEN3D_BAR))
        rows.append(Row(f"raster.vs_open3d.{name}.difference", apart, ""))
    return rows


def _cpu_ms(
    native: NativeRenderer, cloud: SplatCloud, camera: Pinhole, world_from_camera: Pose
) -> tuple[float, np.ndarray]:
    """Median CPU time of all our threads for one picture, and the picture."""
    objects = (PosedSplats(cloud, Pose.identity()),)
    options = RenderOptions(threads=2)
    drawn = native.render(objects, camera, world_from_camera, options)
    times = []
    for _ in range(REPEATS):
        started = time.process_time_ns()
        drawn = native.render(objects, camera, world_from_camera, options)
        times.append((time.process_time_ns() - started) / 1e6)
    return float(np.median(times)), drawn.rgb
