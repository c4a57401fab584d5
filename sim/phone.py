"""A simulated phone films a physical room: photos or a video, and beside them the truth.

Like the 360° camera it draws meshes, never splats.
"""

from __future__ import annotations

import io
import json
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any, Literal

import av
import cv2
import numpy as np
from numpy.typing import NDArray

from devices.video import H264Encoder
from scenes.cameras import Fisheye, Pinhole, Rig, camera_to_json
from scenes.frames import OPENGL_FROM_OPENCV
from scenes.mesh import PhysicalRoom
from scenes.pose import Pose
from sim.phone_light import still_scene
from sim.phone_path import HandShake, Walk, walk_around, walk_by_objects
from sim.phone_raster import PinholeRasteriser
from sim.sensor import Sensor, SensorOptions

IMAGES, VIDEO, TRUTH = "images", "video.mp4", "truth"
PATHS: dict[str, Callable[..., Walk]] = {"walk": walk_around, "objects": walk_by_objects}
FINE = 2
"""Grid points along a pixel's side."""
VIDEO_BITS_PER_PIXEL = 0.35
NANOSECONDS = 1_000_000_000


@dataclass(frozen=True, slots=True)
class Lens:
    """A phone's lens: field of view and what is left of its distortion (Brown's k1, k2).

    Attributes:
        fov_deg: across the picture's width.
        k1: r² term of the radial distortion, on z = 1.
        k2: r⁴ term.
    """

    fov_deg: float = 68.0
    k1: float = 0.0
    k2: float = 0.0


@dataclass(frozen=True, slots=True)
class PhoneOptions:
    """How the phone films.

    Attributes:
        frames: photos, or frames of the video, evenly over the walk.
        width_px: of a photo.
        height_px: of a photo.
        lens: see `Lens`.
        path: "walk" for two laps of the room, "objects" for close-ups of what may be moved.
        duration_s: how long the walk takes.
        exposure_s: how long the shutter is open.
        samples: pictures that are averaged while it is open.
        shake: see `HandShake`.
        sensor: see `SensorOptions`.
        output: "photos" (JPEG) or "video" (H.264).
        jpeg_quality: 0..100.
        held_out_every: every so many frames, one is marked as not for training; 0 for none.
    """

    frames: int = 60
    width_px: int = 960
    height_px: int = 720
    lens: Lens = Lens()
    path: Literal["walk", "objects"] = "walk"
    duration_s: float = 80.0
    exposure_s: float = 1 / 120
    samples: int = 4
    shake: HandShake = HandShake()
    sensor: SensorOptions = field(
        default_factory=lambda: SensorOptions(
            vignetting=0.10, exposure_drift=0.03, colour_drift=0.012, read_noise=1.0, shot_noise=1.8
        )
    )
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


@dataclass(frozen=True, slots=True)
class Shot:
    """One frame as it truly was.

    Attributes:
        name: of the photo's file; "00012.jpg" too for frame 12 of a video.
        t_ns: middle of the exposure, from the start of the walk.
        world_from_camera: the phone's pose at that time.
        held_out: whether training must not see it.
    """

    name: str
    t_ns: int
    world_from_camera: Pose
    held_out: bool


@dataclass(frozen=True, slots=True)
class Capture:
    """What was filmed and where it lies.

    Attributes:
        folder: holds `images/` or `video.mp4`, and `truth/`.
        camera: the lens without its distortion.
        lens: with the distortion.
        shots: in the order of the walk.
    """

    folder: Path
    camera: Pinhole
    lens: Lens
    shots: tuple[Shot, ...]


def film(
    room: PhysicalRoom,
    folder: Path,
    *,
    rng: np.random.Generator,
    options: PhoneOptions = PhoneOptions(),
    progress: Callable[[float, str], None] = lambda done, note: None,
) -> Capture:
    """Film a room with its objects as they stand.

    Writes `images/NAME.jpg` or `video.mp4`, `truth/truth.json`, and `truth/transforms.json` in
    nerfstudio's form. The truth is in a folder of its own, so that `folder` is what a user has.

    Args:
        room: what is filmed.
        folder: made if it isn't there.
        rng: decides the walk, the shake and the sensor's noise.
        options: see `PhoneOptions`.
        progress: called with the share done and a note after each frame.

    Raises:
        ValueError: the room leaves no place to walk.
        OSError: the folder cannot be written.
    """
    walk = PATHS[options.path](room, options.duration_s, rng, shake=options.shake)
    lens = options.lens
    camera = Pinhole.from_fov(options.width_px, options.height_px, math.radians(lens.fov_deg))
    shots = tuple(_shot(walk, options, k) for k in range(options.frames))
    capture = Capture(folder, camera, lens, shots)
    (folder / TRUTH).mkdir(parents=True, exist_ok=True)
    pictures = _developed(room, walk, capture, options, rng)
    if options.output == "video":
        _write_video(capture, pictures, options, progress)
    else:
        _write_photos(capture, pictures, options, progress)
    _write_json(folder / TRUTH / "truth.json", _truth(capture, room))
    _write_json(folder / TRUTH / "transforms.json", _transforms(capture))
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
    rng: np.random.Generator,
) -> Iterator[NDArray[np.uint8]]:
    """The photos one after the other: drawn, blurred by motion, bent by the lens, exposed."""
    camera = capture.camera
    fine, bend = _drawn_camera(camera, capture.lens)
    rasteriser = PinholeRasteriser(still_scene(room), fine.width_px, fine.height_px)
    # The sensor knows lens circles; one around the whole picture leaves its corners alone.
    reach = 1.02 * math.hypot(camera.width_px, camera.height_px) / 2
    circle = Fisheye(camera.width_px, camera.height_px, reach, camera.cx, camera.cy, 1.0)
    sensor = Sensor(Rig((circle,), (Pose.identity(),)), rng, options=options.sensor)
    between_s = walk.duration_s / options.frames
    try:
        for shot in capture.shots:
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


def _drawn_camera(
    camera: Pinhole, lens: Lens
) -> tuple[Pinhole, tuple[NDArray[np.float32], NDArray[np.float32]] | None]:
    """The camera on the fine grid, grown to what a bent picture shows, and the remap that bends."""
    w, h = camera.width_px, camera.height_px
    f, cx, cy = FINE * camera.fx, FINE * camera.cx, FINE * camera.cy
    if lens.k1 == 0.0 and lens.k2 == 0.0:
        return Pinhole(FINE * w, FINE * h, f, f, cx, cy), None
    y, x = np.mgrid[0 : FINE * h, 0 : FINE * w] + 0.5
    bent = np.stack([(x - cx) / f, (y - cy) / f], axis=-1).reshape(-1, 1, 2)
    matrix, k = np.eye(3), np.array([lens.k1, lens.k2, 0.0, 0.0])
    criteria = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 40, 1e-10)
    ideal = cv2.undistortPoints(bent, matrix, k, criteria=criteria)
    ideal = ideal.reshape(FINE * h, FINE * w, 2) * f
    half = np.ceil(np.abs(ideal).max(axis=(0, 1)) + 2).astype(int)
    grown = Pinhole(2 * int(half[0]), 2 * int(half[1]), f, f, float(half[0]), float(half[1]))
    bend = (ideal + half - 0.5).astype(np.float32)
    return grown, (np.ascontiguousarray(bend[..., 0]), np.ascontiguousarray(bend[..., 1]))


def _jitter(k: int) -> tuple[float, float]:
    """The k-th sample's place within a fine pixel (a two-dimensional golden sequence)."""
    return (0.5 + 0.7548776662466927 * k) % 1.0 - 0.5, (0.5 + 0.5698402909980532 * k) % 1.0 - 0.5


def _write_photos(
    capture: Capture,
    pictures: Iterator[NDArray[np.uint8]],
    options: PhoneOptions,
    progress: Callable[[float, str], None],
) -> None:
    images = capture.folder / IMAGES
    images.mkdir(exist_ok=True)
    quality = [cv2.IMWRITE_JPEG_QUALITY, options.jpeg_quality]
    for number, (shot, rgb) in enumerate(zip(capture.shots, pictures, strict=True), start=1):
        _, data = cv2.imencode(".jpg", cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR), quality)
        (images / shot.name).write_bytes(data.tobytes())
        progress(number / len(capture.shots), shot.name)


def _write_video(
    capture: Capture,
    pictures: Iterator[NDArray[np.uint8]],
    options: PhoneOptions,
    progress: Callable[[float, str], None],
) -> None:
    fps = options.frames / options.duration_s
    bitrate = round(VIDEO_BITS_PER_PIXEL * fps * options.width_px * options.height_px)
    encoder = H264Encoder(
        options.width_px, options.height_px, fps, bitrate, stream_id="phone"
    )
    stream = io.BytesIO()
    for number, (shot, rgb) in enumerate(zip(capture.shots, pictures, strict=True)):
        for packet in encoder.encode(rgb, number, shot.t_ns):
            stream.write(packet.data)
        progress((number + 1) / len(capture.shots), shot.name)
    stream.seek(0)
    _packaged(stream, capture.folder / VIDEO, [shot.t_ns for shot in capture.shots])


def _packaged(stream: io.BytesIO, path: Path, times_ns: Sequence[int]) -> None:
    """Raw H.264 pictures into an MP4 file with the times given."""
    with av.open(stream, format="h264") as source, av.open(str(path), "w") as target:
        track = target.add_stream_from_template(source.streams.video[0])
        pictures = (packet for packet in source.demux(video=0) if packet.size)
        for packet, t_ns in zip(pictures, times_ns, strict=True):
            packet.stream = track
            packet.time_base = Fraction(1, NANOSECONDS)
            packet.pts = packet.dts = t_ns - times_ns[0]
            target.mux(packet)


def _truth(capture: Capture, room: PhysicalRoom) -> dict[str, Any]:
    return {
        "room": room.name,
        "camera": camera_to_json(capture.camera),
        "distortion": {"k1": capture.lens.k1, "k2": capture.lens.k2},
        "frames": [
            {
                "name": shot.name,
                "t_ns": shot.t_ns,
                "held_out": shot.held_out,
                "world_from_camera": _pose_json(shot.world_from_camera),
            }
            for shot in capture.shots
        ],
        "codes": [
            {
                "payload": code.payload,
                "side_m": code.side_m,
                "world_from_code": _pose_json(code.world_from_code),
            }
            for code in room.codes
        ],
        "objects": [
            {"object_id": o.object_id, "world_from_object": _pose_json(o.world_from_object)}
            for o in room.objects
        ],
    }


def _transforms(capture: Capture) -> dict[str, Any]:
    """nerfstudio's `transforms.json`: camera-to-world matrices in OpenGL axes."""
    camera, lens = capture.camera, capture.lens
    path = {shot.name: f"../{IMAGES}/{shot.name}" for shot in capture.shots}
    frames = [
        {
            "file_path": path[shot.name],
            "transform_matrix": (shot.world_from_camera @ OPENGL_FROM_OPENCV).matrix().tolist(),
        }
        for shot in capture.shots
    ]
    return {
        "camera_model": "OPENCV",
        "w": camera.width_px,
        "h": camera.height_px,
        "fl_x": camera.fx,
        "fl_y": camera.fy,
        "cx": camera.cx,
        "cy": camera.cy,
        "k1": lens.k1,
        "k2": lens.k2,
        "p1": 0.0,
        "p2": 0.0,
        "frames": frames,
        "train_filenames": [path[s.name] for s in capture.shots if not s.held_out],
        "test_filenames": [path[s.name] for s in capture.shots if s.held_out],
    }


def _pose_json(pose_of_a_from_b: Pose) -> dict[str, list[float]]:
    return {
        "wxyz": pose_of_a_from_b.quaternion().tolist(),
        "translation": pose_of_a_from_b.translation.tolist(),
    }


def _write_json(path: Path, values: dict[str, Any]) -> None:
    path.write_text(json.dumps(values, indent=1) + "\n", encoding="utf-8")
