"""Films of a headset whose wearer walks about a physical room, with exact truth."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from devices.video import H264Decoder, H264Encoder
from scenes.cameras import Fisheye, Pinhole, Rig
from scenes.mesh import PhysicalRoom
from scenes.pose import Pose, rotation_from_vector
from sim.camera.sensor import Sensor
from sim.phone.light import still_scene
from sim.phone.path import HandShake, walk_around
from sim.phone.phone import PHONE_SENSOR
from sim.phone.raster import PinholeRasteriser

WIDTH_PX, HEIGHT_PX = 760, 428
"""Size of the video that is asked of a headset."""

FOV_RAD = math.radians(64.7)
"""Across the width: 600 px of focal length at 760 px, as headsets report it."""

FINE, SAMPLES, EXPOSURE_S = 2, 2, 1 / 100
"""Grid points along a pixel's side, pictures that are averaged while the shutter is open, and for
how long it is, indoors."""

FPS = 8.0
"""Pictures a second in which codes are looked for."""

BITS_PER_PICTURE = WIDTH_PX * HEIGHT_PX * 12 / 75
"""As a headset's own encoder is asked for: 52 kbit."""

HEAD_SHIFT_M, HEAD_TURN_RAD, HEAD_TAU_S = 0.0015, math.radians(0.04), 0.5
"""A headset's own error from moment to moment: standard deviations along and about each axis, and
the time for which it lasts."""

DRIFT_M, DRIFT_RAD = 0.001 / math.sqrt(3.0), math.radians(0.01)
"""Drift of its world in the room in a second, a random walk along each axis and about the
vertical: in 100 s a centimetre in all, and 0.1°."""

HEAD_SHAKE = HandShake(position_m=0.006, turn_rad=0.012)
"""Of a head that walks, beside its way."""


@dataclass(frozen=True, slots=True, eq=False)
class WalkedPicture:
    """One picture of a walk.

    Attributes:
        t_ns: when it was taken.
        grey: (H, W) its luminance, as decoded.
        camera: of it.
        device_from_camera: where the headset says that it was taken from, in its own world.
        device_from_world: where the room truly is in that world.
        world_from_camera: where it was truly taken from.
    """

    t_ns: int
    grey: NDArray[np.uint8]
    camera: Pinhole
    device_from_camera: Pose
    device_from_world: Pose
    world_from_camera: Pose


def walk(room: PhysicalRoom, *, seed: int, seconds: float) -> Iterator[WalkedPicture]:
    """Film a walk: two laps, the first across the room, the second along the walls.

    Args:
        room: what is filmed.
        seed: of the way, the noise and the headset's errors.
        seconds: how long it takes.
    """
    rng = np.random.default_rng(seed)
    way = walk_around(room, seconds, rng, shake=HEAD_SHAKE)
    camera = Pinhole.from_fov(WIDTH_PX, HEIGHT_PX, FOV_RAD)
    fine = Pinhole(
        FINE * WIDTH_PX, FINE * HEIGHT_PX, FINE * camera.fx, FINE * camera.fy,
        FINE * camera.cx, FINE * camera.cy,
    )  # fmt: skip
    rasteriser = PinholeRasteriser(still_scene(room), fine.width_px, fine.height_px)
    reach = 1.02 * math.hypot(WIDTH_PX, HEIGHT_PX) / 2
    circle = Fisheye(WIDTH_PX, HEIGHT_PX, reach, camera.cx, camera.cy, 1.0)
    sensor = Sensor(Rig((circle,), (Pose.identity(),)), rng, options=PHONE_SENSOR)
    bitrate = round(FPS * BITS_PER_PICTURE)
    encoder = H264Encoder(WIDTH_PX, HEIGHT_PX, FPS, bitrate, stream_id="headset")
    decoder = H264Decoder()
    errors = _errors(rng)
    try:
        for number in range(int(seconds * FPS)):
            t_s = number / FPS
            total = np.zeros((fine.height_px, fine.width_px, 3), np.float32)
            for k in range(SAMPLES):
                at = min(t_s + ((k + 0.5) / SAMPLES - 0.5) * EXPOSURE_S, seconds)
                shift = (0.5 * k - 0.25, 0.25 - 0.5 * k)
                total += rasteriser.draw(fine, way.world_from_camera(max(at, 0.0)), shift_px=shift)
            small = cv2.resize(total / SAMPLES, (WIDTH_PX, HEIGHT_PX), interpolation=cv2.INTER_AREA)
            clean = np.clip(np.rint(small), 0, 255).astype(np.uint8)
            taken = sensor.expose([clean], 1.0 / FPS)[0]
            t_ns = round(t_s * 1e9)
            shown = None
            for packet in encoder.encode(taken, number, t_ns):
                shown = decoder.decode(packet)
            device_from_world, off = next(errors)
            if shown is None:
                continue
            pose = way.world_from_camera(t_s)
            yield WalkedPicture(
                t_ns,
                np.asarray(cv2.cvtColor(shown, cv2.COLOR_RGB2GRAY), dtype=np.uint8),
                camera,
                device_from_world @ pose @ off,
                device_from_world,
                pose,
            )
    finally:
        rasteriser.close()


def _errors(rng: np.random.Generator) -> Iterator[tuple[Pose, Pose]]:
    """Yield where the room is in the headset's world, and its error of the moment, per picture."""
    sigma = np.repeat((HEAD_TURN_RAD, HEAD_SHIFT_M), 3)
    keep = math.exp(-1.0 / (FPS * HEAD_TAU_S))
    error = rng.normal(0.0, sigma)
    begun = Pose.from_yaw(rng.uniform(-math.pi, math.pi), rng.uniform(-3.0, 3.0, 3))
    shift, yaw = np.zeros(3), 0.0
    while True:
        drift = Pose.from_yaw(yaw, shift)
        yield begun @ drift, Pose(rotation_from_vector(error[:3]), error[3:])
        error = keep * error + math.sqrt(1.0 - keep**2) * rng.normal(0.0, sigma)
        shift = shift + rng.normal(0.0, DRIFT_M / math.sqrt(FPS), 3)
        yaw += float(rng.normal(0.0, DRIFT_RAD / math.sqrt(FPS)))
