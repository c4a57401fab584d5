"""Figures of a live camera of which nobody says where it stands, or what lenses it has.

Both are found from pictures of the simulated camera at random places, with people about and objects
elsewhere than they were scanned (`benchmarks.evaluate.filmed.camera_places`).
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from benchmarks.evaluate.filmed.asked import Asked
from benchmarks.evaluate.filmed.camera_places import CameraPlace, film_place
from scenes.cameras import Fisheye, Rig
from scenes.mesh import PhysicalRoom
from scenes.opening import open_scene
from scenes.package import ScenePackage
from scenes.pose import Pose, rotation_angle
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats
from scenes.samples import sample_room
from sim.camera.camera360 import default_rig
from sim.rehearsal import off_by
from studio.console.rows import Row, at_least, at_most
from tracking.camera.lens_fit import calibrate_lenses
from tracking.camera.lens_shape import rms_px
from tracking.camera.locating.locate import locate_camera

SCENES = ("lab", "desk")
PLACES = 2
"""Places of the camera in each room and seed."""

RIGHT_DEG, RIGHT_CM = 1.0, 5.0
"""A pose is right within these."""

MIN_LOCATED_PERCENT = 95.0
LONGEST_S = 30.0
"""Bars: how many poses are right and trusted, and how long that takes at most, the map included."""

OFF_CENTRE = 0.005
"""By which the principal points of lenses that are calibrated are off the middle, of the picture's
side."""

TOO_LONG = 1.05
"""Focal length from which their calibration starts, over the true one."""

START_DEG, START_CM = 2.0, 2.0
"""Error of the pose from which it starts."""

BAR_PX = 0.3
"""Bar of the mean distance between found and true pixels, px of a 640-px lens."""

BAR_LENS_PX = 640.0


def located(asked: Asked) -> Iterator[Row]:
    """How many places of a camera are found, how exactly, how fast, and wrong ones trusted."""
    right: list[bool] = []
    wrong_trusted = 0
    errors: list[tuple[float, float]] = []
    seconds: list[float] = []
    for room, scene, renderer, rng in _cases(asked, "locating a camera", stream=1):
        place = film_place(room, asked.conditions, rng)
        began = time.perf_counter()
        result = locate_camera(
            place.frame, scene.room, renderer, objects=_as_scanned(scene), rng=rng
        )
        seconds.append(time.perf_counter() - began)
        degrees, centimetres = _apart(result.world_from_rig, place)
        is_right = degrees < RIGHT_DEG and centimetres < RIGHT_CM
        right.append(is_right and result.trusted)
        wrong_trusted += result.trusted and not is_right
        if right[-1]:
            errors.append((degrees, centimetres))
    asked.progress.finish(f"{sum(right)} of {len(right)} places found")
    yield at_least(
        "live.located_percent", 100.0 * float(np.mean(right)), "%", bar=MIN_LOCATED_PERCENT
    )
    yield at_most("live.located.wrong_trusted", wrong_trusted, "", bar=0.0)
    yield Row("live.located.seconds.p50", float(np.median(seconds)), "s")
    yield at_most("live.located.seconds.p95", float(np.quantile(seconds, 0.95)), "s", bar=LONGEST_S)
    degrees, centimetres = np.reshape(errors or [(math.nan, math.nan)], (-1, 2)).T
    yield Row("live.located.deg", float(np.median(degrees)), "deg")
    yield Row("live.located.deg.max", float(np.max(degrees)), "deg")
    yield Row("live.located.cm", float(np.median(centimetres)), "cm")
    yield Row("live.located.cm.max", float(np.max(centimetres)), "cm")


def calibrated(asked: Asked) -> Iterator[Row]:
    """Return the remaining error of lenses and pose when both are found together."""
    left: list[tuple[float, float, float]] = []
    refused = 0
    size = asked.conditions.lens_size_px
    true = _sold_rig(size)
    for room, scene, renderer, rng in _cases(asked, "calibrating lenses", stream=2):
        place = film_place(room, asked.conditions, rng, rig=true)
        frame = replace(place.frame, rig=_believed_rig(true))
        start = off_by(place.world_from_rig, rng, START_DEG, START_CM)
        result = calibrate_lenses([frame], start, scene.room, renderer, objects=_as_scanned(scene))
        refused += not result.trusted
        degrees, centimetres = _apart(result.world_from_rig, place)
        turned = place.world_from_rig.inverse() @ result.world_from_rig
        for found, lens, pose in zip(
            result.rig.lenses, true.lenses, true.rig_from_lens, strict=True
        ):
            in_lens = pose.inverse() @ turned @ pose
            px = rms_px(found, lens, max_angle=lens.max_angle, b_from_a=in_lens)
            left.append((px * BAR_LENS_PX / size, degrees, 10.0 * centimetres))
    asked.progress.finish(f"{len(left)} lenses calibrated")
    px, degrees, millimetres = np.array(left).T
    yield at_most("live.calibration.px", float(px.mean()), "px", bar=BAR_PX)
    yield Row("live.calibration.px.max", float(px.max()), "px")
    yield Row("live.calibration.deg", float(degrees.mean()), "deg")
    yield Row("live.calibration.deg.max", float(degrees.max()), "deg")
    yield Row("live.calibration.mm", float(millimetres.mean()), "mm")
    yield Row("live.calibration.mm.max", float(millimetres.max()), "mm")
    yield at_most("live.calibration.refused", refused, "", bar=0.0)


Case = tuple[PhysicalRoom, ScenePackage, NativeRenderer, np.random.Generator]


def _cases(asked: Asked, task: str, *, stream: int) -> Iterator[Case]:
    """Rooms as they are and as they were scanned, with a random generator for each place."""
    renderer = NativeRenderer()
    count, done = len(SCENES) * len(asked.seeds) * PLACES, 0
    asked.progress.begin(task)
    for number, name in enumerate(SCENES):
        room, scene = sample_room(name), open_scene(name)
        for seed in asked.seeds:
            for place in range(PLACES):
                asked.progress.advance(done / count, f"{name}, seed {seed}")
                done += 1
                rng = np.random.default_rng([seed, 360, stream, number, place])
                yield room, scene, renderer, rng


def _as_scanned(scene: ScenePackage) -> tuple[PosedSplats, ...]:
    return tuple(PosedSplats(item.splats, item.world_from_object) for item in scene.objects)


def _apart(world_from_rig: Pose, place: CameraPlace) -> tuple[float, float]:
    """Degrees and centimetres from where the camera truly stood."""
    step = place.world_from_rig.inverse() @ world_from_rig
    return math.degrees(rotation_angle(step.rotation)), 100 * float(
        np.linalg.norm(step.translation)
    )


def _sold_rig(size_px: int) -> Rig:
    """Two lenses that are not in the middle of their pictures, as none that is sold is."""
    plain = default_rig(size_px)
    lenses: list[Fisheye] = []
    for lens, side in zip(plain.lenses, (1.0, -1.0), strict=True):
        off = side * OFF_CENTRE * size_px
        # The circle stays inside the picture.
        shrunk = 1.0 - 2.0 * OFF_CENTRE
        lenses.append(replace(lens, cx=lens.cx + off, cy=lens.cy - off, f_px=shrunk * lens.f_px))
    return Rig(tuple(lenses), plain.rig_from_lens)


def _believed_rig(true: Rig) -> Rig:
    """Return the rig that a circle in the picture tells of, its lenses 5 % too long."""
    lenses = tuple(
        Fisheye(
            lens.width_px,
            lens.height_px,
            TOO_LONG * lens.circle_px / lens.max_angle,
            0.5 * lens.width_px,
            0.5 * lens.height_px,
            lens.max_angle,
        )
        for lens in true.lenses
    )
    return Rig(lenses, true.rig_from_lens)
