"""`nexus bench raster`: how exact and how fast the native splat renderer is on this machine."""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.render.reference import ReferenceRenderer
from scenes.render.renderer import PosedSplats, RenderOptions
from studio.bench.raster_gradients import gradient_rows
from studio.bench.raster_peers import peer_rows
from studio.bench.splat_scenes import (
    bench_object,
    bench_room,
    dual_fisheye,
    object_camera,
    random_cloud,
    room_camera,
)
from studio.rows import Row, as_json, as_table, at_most, exit_code

View = tuple[Pinhole | Fisheye, Pose]

ERROR_BAR = 2e-4
SEED = 1
ROOM_SPLATS = 300_000
OBJECT_SPLATS = 20_000
REPEATS, QUICK_REPEATS = 15, 5
WARM_UPS = 2


@dataclass(frozen=True, slots=True)
class _Scene:
    """Pictures that are timed together, and the name of their figures."""

    name: str
    objects: tuple[PosedSplats, ...]
    views: tuple[View, ...]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Flags of the verb."""
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    parser.add_argument(
        "--quick", action="store_true", help="only the error and the object, few repeats"
    )


def run(args: argparse.Namespace) -> int:
    """Measure and print; 1 if a figure missed its bar."""
    rows = measure(args)
    if args.json:
        print(json.dumps(as_json("bench raster", rows, SEED), indent=2))
    else:
        print(as_table(rows))
    return exit_code(rows)


def measure(args: argparse.Namespace) -> list[Row]:
    """All figures: first the error against the reference, then times (medians, quartile ranges)."""
    native = NativeRenderer()
    rng = np.random.default_rng(SEED)
    rows = [_error_row(native, seeds=2 if args.quick else 6), _reference_row(native, rng)]
    repeats = QUICK_REPEATS if args.quick else REPEATS
    for scene in _scenes(rng, quick=args.quick):
        print(f"bench raster: {scene.name}", file=sys.stderr)
        rows += _time_rows(native, scene, repeats)
    if not args.quick:
        rows += peer_rows(native, rng)
    print("bench raster: gradients", file=sys.stderr)
    return rows + gradient_rows(native, SEED, repeats=repeats, quick=args.quick)


def _scenes(rng: np.random.Generator, *, quick: bool) -> list[_Scene]:
    chair = (PosedSplats(bench_object(OBJECT_SPLATS, rng), Pose.identity()),)
    scenes = [_Scene("object_20k", chair, (object_camera(260),))]
    if not quick:
        room = (PosedSplats(bench_room(ROOM_SPLATS, rng), Pose.identity()),)
        scenes += [
            _Scene("room_300k_640", room, (room_camera(640, 640),)),
            _Scene("room_300k_720p", room, (room_camera(1280, 720),)),
            _Scene("dual_720", room, dual_fisheye(720)),
        ]
    return scenes


def _time_rows(native: NativeRenderer, scene: _Scene, repeats: int) -> list[Row]:
    medians = []
    rows = []
    for threads in (1, 2):
        options = RenderOptions(threads=threads)

        def draw(options: RenderOptions = options) -> None:
            for camera, pose in scene.views:
                native.render(scene.objects, camera, pose, options)

        median, spread = _time_ms(draw, repeats)
        medians.append(median)
        rows.append(Row(f"raster.{scene.name}.{threads}t.ms", median, "ms", spread=spread))
    if scene.name == "room_300k_640":
        rows.append(Row("raster.speedup_2t", medians[0] / medians[1], "x"))
    return rows


def _time_ms(work: Callable[[], object], repeats: int) -> tuple[float, float]:
    """Median and quartile range of the wall time of `work`, milliseconds."""
    for _ in range(WARM_UPS):
        work()
    times = []
    for _ in range(repeats):
        start = time.perf_counter_ns()
        work()
        times.append((time.perf_counter_ns() - start) / 1e6)
    low, median, high = np.percentile(times, [25, 50, 75])
    return float(median), float(high - low)


def _reference_row(native: NativeRenderer, rng: np.random.Generator) -> Row:
    """How many times faster the native renderer draws a small object than the reference."""
    objects = (PosedSplats(bench_object(2_000, rng), Pose.identity()),)
    camera, pose = object_camera(160)
    options = RenderOptions(threads=1)
    slow, _ = _time_ms(lambda: ReferenceRenderer().render(objects, camera, pose, options), 1)
    fast, _ = _time_ms(lambda: native.render(objects, camera, pose, options), REPEATS)
    return Row("raster.vs_reference", slow / fast, "x")


def _error_row(native: NativeRenderer, *, seeds: int) -> Row:
    """Largest difference from the float64 reference at any pixel, over rgb and alpha (0..1)."""
    reference = ReferenceRenderer()
    errors = []
    for seed in range(seeds):
        objects = _error_scene(np.random.default_rng([SEED, seed]))
        pose = Pose.from_yaw(0.5 * seed, (0.0, 0.1, -0.4))
        for camera in _error_cameras():
            for antialias in (False, True):
                options = RenderOptions(sh_degree=seed % 4, antialias=antialias)
                wanted = reference.render(objects, camera, pose, options)
                got = native.render(objects, camera, pose, options)
                for name in ("rgb", "alpha"):
                    errors.append(np.abs(getattr(got, name) - getattr(wanted, name)).max())
    # np.max keeps a NaN, which then misses the bar.
    return at_most("raster.error.max", float(np.max(errors)), "", bar=ERROR_BAR)


def _error_scene(rng: np.random.Generator) -> Sequence[PosedSplats]:
    """Overlapping posed objects of all sizes, some of them around the camera."""
    return (
        PosedSplats(random_cloud(300, rng), Pose.from_yaw(0.3, (0.1, 0.2, 1.5))),
        PosedSplats(
            random_cloud(200, rng, sh_degree=1),
            Pose.from_quaternion(np.array([0.5, 0.5, -0.5, 0.5]), (0.5, 0.0, 0.5)),
        ),
        PosedSplats(random_cloud(100, rng, spread_m=0.15), Pose.identity()),
    )


def _error_cameras() -> tuple[Pinhole | Fisheye, ...]:
    return (
        Pinhole.from_fov(160, 120, np.radians(70.0)),
        Fisheye.from_fov(160, np.radians(200.0)),
        Fisheye.from_fov(150, np.radians(250.0)),
    )
