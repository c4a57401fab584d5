# pyright: standard
"""Files of a simulated phone: photos or a video as a user has them, and the truth.

The truth lies in a folder of its own, `truth/`, so that nothing that is given the capture finds it
by accident: `truth.json`, and `transforms.json` in nerfstudio's form.
"""

from __future__ import annotations

import io
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np
from numpy.typing import NDArray

from devices.video import H264Encoder
from scenes.cameras import Pinhole, camera_from_json, camera_to_json
from scenes.frames import OPENGL_FROM_OPENCV
from scenes.pose import Pose

IMAGES, VIDEO, TRUTH = "images", "video.mp4", Path("truth")
NANOSECONDS = 1_000_000_000


@dataclass(frozen=True, slots=True)
class Distortion:
    """Rest of a lens's distortion: Brown's radial terms on z = 1."""

    k1: float = 0.0
    k2: float = 0.0


@dataclass(frozen=True, slots=True)
class Shot:
    """One frame as it truly was.

    Attributes:
        name: of the photo's file; a video's frames have such names too.
        t_ns: middle of the exposure, from the start of the walk.
        world_from_camera: the phone's pose at that time.
        held_out: whether training must not see it.
    """

    name: str
    t_ns: int
    world_from_camera: Pose
    held_out: bool = False


@dataclass(frozen=True, slots=True)
class Capture:
    """The truth of a capture.

    Attributes:
        room: name of the room that was filmed.
        camera: the lens without its distortion.
        distortion: of the lens.
        shots: in the order of the walk.
    """

    room: str
    camera: Pinhole
    distortion: Distortion
    shots: tuple[Shot, ...]


def write_photos(
    folder: Path, shots: Sequence[Shot], pictures: Iterable[NDArray[np.uint8]], *, quality: int
) -> None:
    """JPEG files in `folder/images`, one for every shot; pictures are (H, W, 3) RGB."""
    images = folder / IMAGES
    images.mkdir(parents=True, exist_ok=True)
    for shot, rgb in zip(shots, pictures, strict=True):
        bgr = cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR)
        _, data = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, quality])
        (images / shot.name).write_bytes(data.tobytes())


def write_video(
    folder: Path,
    shots: Sequence[Shot],
    pictures: Iterable[NDArray[np.uint8]],
    *,
    fps: float,
    bitrate: int,
) -> None:
    """`folder/video.mp4`, H.264, one frame for every shot at its time.

    Raises:
        ValueError: a picture's side is odd.
    """
    stream, encoder = io.BytesIO(), None
    for number, (shot, rgb) in enumerate(zip(shots, pictures, strict=True)):
        if encoder is None:
            height, width = rgb.shape[:2]
            encoder = H264Encoder(width, height, fps, bitrate, stream_id="phone")
        for packet in encoder.encode(rgb, number, shot.t_ns):
            stream.write(packet.data)
    stream.seek(0)
    folder.mkdir(parents=True, exist_ok=True)
    with (
        av.open(stream, "r", format="h264") as source,
        av.open(str(folder / VIDEO), "w") as target,
    ):
        track = target.add_stream_from_template(source.streams.video[0])
        packets = (packet for packet in source.demux(video=0) if packet.size)
        for packet, shot in zip(packets, shots, strict=True):
            packet.stream = track
            packet.time_base = Fraction(1, NANOSECONDS)
            packet.pts = packet.dts = shot.t_ns - shots[0].t_ns
            target.mux(packet)


def write_truth(folder: Path, capture: Capture) -> None:
    """`truth/truth.json`, which `read_truth` reads, and `truth/transforms.json`."""
    (folder / TRUTH).mkdir(parents=True, exist_ok=True)
    own = {
        "room": capture.room,
        "camera": camera_to_json(capture.camera),
        "distortion": {"k1": capture.distortion.k1, "k2": capture.distortion.k2},
        "frames": [
            {
                "name": shot.name,
                "t_ns": shot.t_ns,
                "held_out": shot.held_out,
                "world_from_camera": {
                    "wxyz": shot.world_from_camera.quaternion().tolist(),
                    "translation": shot.world_from_camera.translation.tolist(),
                },
            }
            for shot in capture.shots
        ],
    }
    for name, values in (("truth.json", own), ("transforms.json", _transforms(capture))):
        text = json.dumps(values, indent=1) + "\n"
        (folder / TRUTH / name).write_text(text, encoding="utf-8")


def read_truth(folder: Path) -> Capture:
    """The truth of a capture folder.

    Raises:
        ValueError: there is none, or it is damaged.
    """
    path = folder / TRUTH / "truth.json"
    try:
        values = json.loads(path.read_text(encoding="utf-8-sig"))
        shots = tuple(
            Shot(
                frame["name"],
                int(frame["t_ns"]),
                Pose.from_quaternion(**frame["world_from_camera"]),
                bool(frame["held_out"]),
            )
            for frame in values["frames"]
        )
        camera = camera_from_json(values["camera"])
        room, distortion = str(values["room"]), Distortion(**values["distortion"])
    except (OSError, KeyError, TypeError, ValueError) as error:
        raise ValueError(f"{path}: no truth of a simulated capture ({error}); film again") from None
    if not isinstance(camera, Pinhole):
        raise ValueError(  # noqa: TRY004 - the file is wrong, not the call
            f"{path}: camera {values['camera']}, wanted a pinhole; film again"
        )
    return Capture(room, camera, distortion, shots)


def _transforms(capture: Capture) -> dict[str, Any]:
    """Camera-to-world matrices in OpenGL axes, as nerfstudio wants them."""
    camera, distortion = capture.camera, capture.distortion
    path = {shot.name: f"../{IMAGES}/{shot.name}" for shot in capture.shots}
    return {
        "camera_model": "OPENCV",
        "w": camera.width_px,
        "h": camera.height_px,
        "fl_x": camera.fx,
        "fl_y": camera.fy,
        "cx": camera.cx,
        "cy": camera.cy,
        "k1": distortion.k1,
        "k2": distortion.k2,
        "p1": 0.0,
        "p2": 0.0,
        "frames": [
            {
                "file_path": path[shot.name],
                "transform_matrix": (shot.world_from_camera @ OPENGL_FROM_OPENCV).matrix().tolist(),
            }
            for shot in capture.shots
        ],
        "train_filenames": [path[s.name] for s in capture.shots if not s.held_out],
        "test_filenames": [path[s.name] for s in capture.shots if s.held_out],
    }
