"""`nexus bench raster`: how exact and how fast the native splat renderer is on this machine."""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.raster.gradients import gradient_rows
from benchmarks.raster.peers import peer_rows
from benchmarks.raster.reference.renderer import ReferenceRenderer
from benchmarks.raster.splat_scenes import (
    bench_object,
    bench_room,
    dual_fisheye,
    object_camera,
    random_cloud,
    room_camera,
    shrunk,
)
from benchmarks.raster.stage_rows import blend_rows, stage_rows
from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats, RenderOptions
from scenes.render.still import StillView
from studio.console.rows import Row, as_json, as_table, at_least, at_most, exit_code

View = tuple[Pinhole | Fisheye, Pose]

ERROR_BAR = 2e-4

SEED = 1

SPEEDUP_BAR = 1.75

MOVED_BAR_MS = 15.0

ROOM_SPLATS = 300_000

OBJECT_SPLATS = 20_000

BLEND_SCENE = "room_300k_640"

REPEATS, QUICK_REPEATS = 15, 5

WARM_UPS = 2


@dataclass(frozen=True, slots=True)
class _Scene:
    """Pictures timed together, the name of their figures, and the limit for two threads."""

    name: str
    objects: tuple[PosedSplats, ...]
    views: tuple[View, ...]
    bar_2t_ms: float | None


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
    scenes = _scenes(rng, quick=args.quick)
    for scene in scenes:
        print(f"bench raster: {scene.name}", file=sys.stderr)
        rows += _time_rows(native, scene, repeats)
        rows += stage_rows(native, scene.name, scene.objects, scene.views, repeats)
        if scene.name == BLEND_SCENE:
            rows += blend_rows(native, scene.objects, scene.views[0], repeats)
    if not args.quick:
        rows.append(_moved_row(native, scenes[-1], rng, repeats))
        rows += peer_rows(native, rng)
    print("bench raster: gradients", file=sys.stderr)
    return rows + gradient_rows(native, SEED, repeats=repeats, quick=args.quick)


def _scenes(rng: np.random.Generator, *, quick: bool) -> list[_Scene]:
    chair = (PosedSplats(bench_object(OBJECT_SPLATS, rng), Pose.identity()),)
    # Too few repeats to hold a time against.
    bar = None if quick else 3.0
    scenes = [_Scene("object_20k", chair, (object_camera(260),), bar)]
    if not quick:
        room = (PosedSplats(bench_room(ROOM_SPLATS, rng), Pose.identity()),)
        scenes += [
            _Scene(BLEND_SCENE, room, (room_camera(640, 640),), 20.0),
            _Scene("room_300k_720p", room, (room_camera(1280, 720),), 35.0),
            _Scene("dual_720", room, dual_fisheye(720), 55.0),
            _Scene("dual_1440", room, dual_fisheye(1440), 120.0),
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
        bar = scene.bar_2t_ms if threads == 2 else None
        name = f"raster.{scene.name}.{threads}t.ms"
        rows.append(at_most(name, median, "ms", bar=bar, spread=spread))
    if scene.name == BLEND_SCENE:
        ratio = medians[0] / medians[1]
        rows.append(at_least("raster.speedup_2t", ratio, "x", bar=SPEEDUP_BAR))
    return rows


def _moved_row(
    native: NativeRenderer, scene: _Scene, rng: np.random.Generator, repeats: int
) -> Row:
    """Time to refresh still pictures of a room when one object 0.4 m high moved in front of them.

    The object passes the first camera at 1.5 m; the other camera looks the other way.
    """
    cloud = shrunk(bench_object(OBJECT_SPLATS, rng), 0.4 / 0.9)
    options = RenderOptions(threads=2)
    stills = [
        StillView(native, camera, world_from_camera=pose, options=options)
        for camera, pose in scene.views
    ]

    def steps() -> Iterator[tuple[PosedSplats, ...]]:
        for step in range(WARM_UPS + repeats):
            pose = Pose.from_yaw(0.2 * step, (1.7, 0.02 * step - 0.3, 1.1))
            yield (*scene.objects, PosedSplats(cloud, pose))

    upcoming = steps()

    def refresh() -> None:
        objects = next(upcoming)
        for still in stills:
            still.update(objects)

    median, spread = _time_ms(refresh, repeats)
    name = f"raster.{scene.name}_moved.2t.ms"
    return at_most(name, median, "ms", bar=MOVED_BAR_MS, spread=spread)


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
