"""A simulated phone films a physical room: photos or a video, and beside them the truth.

Like the 360° camera it draws meshes, never splats.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole, Rig
from scenes.mesh import PhysicalRoom
from scenes.pose import Pose
from sim.camera.sensor import Sensor, SensorOptions
from sim.phone.capture import (
    NANOSECONDS,
    Capture,
    Distortion,
    Shot,
    write_photos,
    write_truth,
    write_video,
)
from sim.phone.light import still_scene
from sim.phone.path import HandShake, Walk, walk_around, walk_by_objects, walk_looking_up
from sim.phone.raster import PinholeRasteriser

PATHS = {"walk": walk_around, "up": walk_looking_up, "objects": walk_by_objects}
FINE = 2
"""Grid points along a pixel's side."""
VIDEO_BITS_PER_PIXEL = 0.35
PHONE_SENSOR = SensorOptions(
    vignetting=0.10, exposure_drift=0.03, colour_drift=0.012, read_noise=1.0, shot_noise=1.8
)

Remap = tuple[NDArray[np.float32], NDArray[np.float32]]


@dataclass(frozen=True, slots=True)
class PhoneOptions:
    """How the phone films.

    Attributes:
        frames: photos, or frames of the video, evenly over the walk.
        width_px: of a photo.
        height_px: of a photo.
        fov_deg: across the width, before distortion.
        distortion: of the lens.
        path: "walk" for two laps of the room, "up" for one that looks at its ceiling, "objects" for
            close-ups of what may be moved.
        duration_s: how long the walk takes.
        exposure_s: how long the shutter is open.
        samples: pictures that are averaged while it is open.
        shake: how unsteady the hand is.
        sensor: noise, vignetting, drift of exposure and white balance.
        output: "photos" (JPEG) or "video" (H.264).
        jpeg_quality: 0..100.
        held_out_every: of so many frames, one is marked as not for training; 0 for none.

    Raises:
        ValueError: a count, a time or the path is out of range.
    """

    frames: int = 60
    width_px: int = 960
    height_px: int = 720
    fov_deg: float = 68.0
    distortion: Distortion = field(default_factory=Distortion)
    path: Literal["walk", "up", "objects"] = "walk"
    duration_s: float = 80.0
    exposure_s: float = 1 / 120
    samples: int = 4
    shake: HandShake = field(default_factory=HandShake)
    sensor: SensorOptions = PHONE_SENSOR
    output: Literal["photos", "video"] = "photos"
    jpeg_quality: int = 93
    held_out_every: int = 0

    def __post_init__(self) -> None:
        for name in ("frames", "samples", "width_px", "height_px"):
            if getattr(self, name) < 1:
                raise ValueError(f"PhoneOptions.{name}: {getattr(self, name)}, wanted at least 1")
        if not self.duration_s > self.exposure_s >= 0:
            raise ValueError(
                f"PhoneOptions: a walk of {self.duration_s} s with {self.exposure_s} s of exposure,"
                " wanted duration > exposure >= 0"
            )
        if self.path not in PATHS:
            raise ValueError(f"PhoneOptions.path: {self.path!r}, wanted one of {sorted(PATHS)}")


SAMPLE_CAPTURE = PhoneOptions()
"""60 photos, as somebody who wants a room prepared would take them."""
TRAINING_SET = PhoneOptions(frames=72, width_px=400, height_px=300, held_out_every=9)
"""64 small photos to train on and 8 held out."""


def film(
    room: PhysicalRoom,
    folder: Path,
    *,
    rng: np.random.Generator,
    options: PhoneOptions = SAMPLE_CAPTURE,
    progress: Callable[[float, str], None] = lambda done, note: None,
) -> Capture:
    """Film a room with its objects as they stand.

    Args:
        room: what is filmed.
        folder: made if it isn't there; gets `images/` or `video.mp4`, and `truth/`.
        rng: decides the walk, the shake and the sensor's noise.
        options: see `PhoneOptions`.
        progress: called with the share done and the frame's name before each frame.

    Returns:
        The truth, as `read_truth` finds it in the folder.

    Raises:
        ValueError: the room leaves no place to walk.
        OSError: the folder cannot be written.
    """
    walk = PATHS[options.path](room, options.duration_s, rng, shake=options.shake)
    camera = Pinhole.from_fov(options.width_px, options.height_px, math.radians(options.fov_deg))
    shots = tuple(_shot(walk, options, k) for k in range(options.frames))
    capture = Capture(room.name, camera, options.distortion, shots)
    pictures = _developed(room, walk, capture, options, rng=rng, progress=progress)
    if options.output == "video":
        fps = options.frames / options.duration_s
        bitrate = round(VIDEO_BITS_PER_PIXEL * fps * options.width_px * options.height_px)
        write_video(folder, shots, pictures, fps=fps, bitrate=bitrate)
    else:
        write_photos(folder, shots, pictures, quality=options.jpeg_quality)
    write_truth(folder, capture)
    return capture


def _shot(walk: Walk, options: PhoneOptions, number: int) -> Shot:
    t_s = (number + 0.5) / options.frames * walk.duration_s
    every = options.held_out_every
    return Shot(
        f"{number:05d}.jpg",
        round(t_s * NANOSECONDS),
        walk.world_from_camera(t_s),
        held_out=every > 0 and number % every == every // 2,
    )


def _developed(
    room: PhysicalRoom,
    walk: Walk,
    capture: Capture,
    options: PhoneOptions,
    *,
    rng: np.random.Generator,
    progress: Callable[[float, str], None],
) -> Iterator[NDArray[np.uint8]]:
    """The photos one after the other: drawn, blurred by motion, bent by the lens, exposed."""
    camera = capture.camera
    fine, bend = drawn_camera(camera, capture.distortion)
    rasteriser = PinholeRasteriser(still_scene(room), fine.width_px, fine.height_px)
    # The sensor knows lens circles; one around the whole picture leaves its corners alone.
    reach = 1.02 * math.hypot(camera.width_px, camera.height_px) / 2
    circle = Fisheye(camera.width_px, camera.height_px, reach, camera.cx, camera.cy, 1.0)
    sensor = Sensor(Rig((circle,), (Pose.identity(),)), rng, options=options.sensor)
    between_s = walk.duration_s / options.frames
    try:
        for number, shot in enumerate(capture.shots):
            progress(number / len(capture.shots), shot.name)
            total = np.zeros((fine.height_px, fine.width_px, 3), np.float32)
            for k in range(options.samples):
                share = (k + 0.5) / options.samples - 0.5
                t_s = shot.t_ns / NANOSECONDS + share * options.exposure_s
                total += rasteriser.draw(fine, walk.world_from_camera(t_s), shift_px=_jitter(k))
            mean = total / options.samples
            if bend is not None:
                mean = cv2.remap(mean, *bend, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
            size = (camera.width_px, camera.height_px)
            small = cv2.resize(mean, size, interpolation=cv2.INTER_AREA)
            clean = np.clip(np.rint(small), 0, 255).astype(np.uint8)
            yield sensor.expose([clean], between_s)[0]
    finally:
        rasteriser.close()


def drawn_camera(camera: Pinhole, distortion: Distortion) -> tuple[Pinhole, Remap | None]:
    """The camera on the fine grid, grown to all that a bent picture shows, and what bends it.

    Returns:
        The pinhole that is drawn, and `cv2.remap`'s columns and rows from its picture to the bent
        one on the fine grid; None if nothing is bent.
    """
    w, h = FINE * camera.width_px, FINE * camera.height_px
    f, cx, cy = FINE * camera.fx, FINE * camera.cx, FINE * camera.cy
    if distortion == Distortion():
        return Pinhole(w, h, f, f, cx, cy), None
    y, x = np.mgrid[0:h, 0:w] + 0.5
    bent = np.stack([(x - cx) / f, (y - cy) / f], axis=-1).reshape(-1, 1, 2)
    terms = np.array([distortion.k1, distortion.k2, 0.0, 0.0])
    criteria = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 40, 1e-10)
    straight = f * cv2.undistortPoints(bent, np.eye(3), terms, criteria=criteria)
    straight = straight.reshape(h, w, 2)
    half = np.ceil(np.abs(straight).max(axis=(0, 1)) + 2).astype(int)
    grown = Pinhole(2 * int(half[0]), 2 * int(half[1]), f, f, float(half[0]), float(half[1]))
    # cv2.remap samples at whole numbers.
    columns, rows = np.moveaxis(straight + half - 0.5, 2, 0).astype(np.float32)
    return grown, (np.ascontiguousarray(columns), np.ascontiguousarray(rows))


def _jitter(k: int) -> tuple[float, float]:
    """The k-th sample's place within a fine pixel (a two-dimensional golden sequence)."""
    return (0.5 + 0.7548776662466927 * k) % 1.0 - 0.5, (0.5 + 0.5698402909980532 * k) % 1.0 - 0.5
