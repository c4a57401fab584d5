"""Recorded footage as frames of a 360° camera: a video, a camera's own file, pictures with times.

What all of it lacks is where the camera stood and what its lenses are: that is the camera file.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import av
import cv2
import numpy as np
from av.error import FFmpegError
from av.video.frame import VideoFrame
from av.video.reformatter import ColorRange, Colorspace
from numpy.typing import NDArray

from devices.messages import Frame
from devices.video import split_lenses
from devices.video_files import PAIRED, VIDEO_SUFFIXES
from scenes.cameras import Rig, rig_from_json
from scenes.pose import Pose

TIMES_FILE = "times.csv"
STREAM_ID = "footage"

AVCOL_SPC_BT470BG, AVCOL_SPC_SMPTE170M = 5, 6
"""The two numbers by which FFmpeg says that colour is BT.601."""

Pictures = tuple[NDArray[np.uint8], ...]


class FootageError(ValueError):
    """Footage or a camera file that cannot be used: names the file, what is wrong, what to do."""


@dataclass(frozen=True, slots=True, eq=False)
class FilmedBy:
    """The camera that took the footage.

    Attributes:
        rig: its lenses; the first is the first in the picture or file.
        world_from_rig: where it stood.
    """

    rig: Rig
    world_from_rig: Pose


def read_camera(path: Path) -> FilmedBy:
    """A camera file: JSON with `lenses`, `rig_from_lens` and `world_from_rig`.

    Raises:
        FootageError: it is no such file.
        OSError: it cannot be read.
    """
    try:
        values = json.loads(path.read_text(encoding="utf-8-sig"))
    except (UnicodeDecodeError, json.JSONDecodeError) as error:
        raise FootageError(f"{path}: not a camera file: no JSON ({error})") from None
    if not isinstance(values, dict):
        raise FootageError(f"{path}: not a camera file: {type(values).__name__}, wanted an object")
    fields = cast(dict[str, Any], values)
    missing = [key for key in ("lenses", "rig_from_lens", "world_from_rig") if key not in fields]
    if missing:
        raise FootageError(f"{path}: field {missing[0]!r} is missing in the camera file")
    try:
        pose = fields["world_from_rig"]
        where = Pose.from_quaternion(pose["wxyz"], pose["translation"])
        return FilmedBy(rig_from_json(fields), where)
    except KeyError as error:
        raise FootageError(f"{path}: field {error} is missing in a pose") from None
    except (ValueError, TypeError) as error:
        raise FootageError(f"{path}: {error}") from None


def read_footage(path: Path, camera: FilmedBy) -> Iterator[Frame]:
    """Its frames in order of time, decoded one at a time.

    Args:
        path: a video whose pictures hold all lenses side by side, or with one picture track a lens
            (`.insv` of two lenses, or a pair of files of one lens each); or a folder of pictures
            with a `times.csv`.
        camera: its lenses and where it stood.

    Raises:
        FootageError: it is nothing of the kind, is damaged, or does not suit the lenses.
        OSError: it cannot be read.
    """
    if path.is_dir():
        timed = _pictures_of_folder(path)
    elif not path.exists():
        raise FootageError(f"{path}: no such video or folder")
    elif path.suffix.lower() in VIDEO_SUFFIXES:
        timed = _pictures_of_video(path, len(camera.rig.lenses))
    else:
        raise FootageError(
            f"{path}: neither a video ({', '.join(sorted(VIDEO_SUFFIXES))}) nor a folder of "
            f"pictures with a {TIMES_FILE}"
        )
    before_ns = -1
    for seq, (t_ns, pictures) in enumerate(timed):
        if t_ns <= before_ns:
            raise FootageError(
                f"{path}: picture {seq} is of {t_ns} ns, not after the one before ({before_ns} ns)"
            )
        before_ns = t_ns
        images = _suited(path, seq, pictures, camera.rig)
        yield Frame(STREAM_ID, seq, t_ns, t_ns, images, camera.rig, camera.world_from_rig)


def duration_ns(path: Path) -> int:
    """How long footage is, 0 where that is not known without decoding it."""
    if path.is_dir() or not path.exists() or path.suffix.lower() not in VIDEO_SUFFIXES:
        return 0
    with _open(path) as container:
        return round(1e9 * (container.duration or 0) / av.time_base)


def lens_size_px(path: Path, lenses: int) -> int:
    """Return the side of a lens's picture in a video of square lens pictures.

    Raises:
        FootageError: it is no video, or its pictures are not square lens pictures.
    """
    tracks = _tracks(path, lenses)
    with _open(path) as container:
        stream = container.streams.video[0]
        width, height = int(stream.width), int(stream.height)
    if width != height * (lenses if len(tracks) == 1 else 1):
        raise FootageError(
            f"{path}: {len(tracks)} picture tracks of {width}×{height} px, wanted {lenses} square "
            "lens pictures, side by side or a track each"
        )
    return height


def _suited(path: Path, seq: int, pictures: Pictures, rig: Rig) -> Pictures:
    """One picture a lens, of that lens's size."""
    count = len(rig.lenses)
    if len(pictures) == 1 and count > 1:
        if pictures[0].shape[1] % count:
            raise FootageError(
                f"{path}: picture {seq} is {pictures[0].shape[1]} px wide: {count} lenses cannot "
                "share it; the camera file says how many there are"
            )
        pictures = split_lenses(pictures[0], count)
    if len(pictures) != count:
        raise FootageError(
            f"{path}: {len(pictures)} pictures at a time, the camera file has {count} lenses"
        )
    for index, (picture, lens) in enumerate(zip(pictures, rig.lenses, strict=True)):
        height, width = picture.shape[:2]
        if (width, height) != (lens.width_px, lens.height_px):
            raise FootageError(
                f"{path}: picture {seq} of lens {index} is {width}×{height} px, the camera file "
                f"says {lens.width_px}×{lens.height_px}; give the camera file of this resolution"
            )
    return pictures


def _pictures_of_folder(folder: Path) -> Iterator[tuple[int, Pictures]]:
    """Each line of `times.csv`: `t_ns`, then one file, or one a lens."""
    times = folder / TIMES_FILE
    if not times.is_file():
        raise FootageError(
            f"{folder}: no {TIMES_FILE} in it; it has the columns t_ns and file, or t_ns, file_0, "
            "file_1 for one picture a lens"
        )
    with times.open(encoding="utf-8-sig", newline="") as opened:
        rows = csv.DictReader(opened)
        columns = [name for name in rows.fieldnames or () if name.startswith("file")]
        if "t_ns" not in (rows.fieldnames or ()) or not columns:
            raise FootageError(
                f"{times}: columns {rows.fieldnames}, wanted t_ns and file (or file_0, file_1)"
            )
        for line, row in enumerate(rows, 2):
            try:
                t_ns = int(row["t_ns"])
            except (TypeError, ValueError):
                raise FootageError(
                    f"{times}, line {line}: t_ns is {row['t_ns']!r}, wanted whole nanoseconds"
                ) from None
            yield t_ns, tuple(_picture(folder, row[name], times, line) for name in columns)


def _picture(folder: Path, name: str | None, times: Path, line: int) -> NDArray[np.uint8]:
    if not name:
        raise FootageError(f"{times}, line {line}: names no picture")
    path = folder / name
    try:
        data = np.fromfile(path, np.uint8)
    except OSError as error:
        raise FootageError(f"{times}, line {line}: {path}: {error.strerror or error}") from None
    # As stored: the lenses are calibrated in those pixels, whatever EXIF says.
    stored = cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION
    picture = cv2.imdecode(data, stored) if data.size else None
    if picture is None:
        raise FootageError(f"{path}: no picture that can be read")
    return np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB), dtype=np.uint8)


def _pictures_of_video(path: Path, lenses: int) -> Iterator[tuple[int, Pictures]]:
    """One picture with all lenses, or one a track, or one a file of a pair."""
    tracks = _tracks(path, lenses)
    with ExitStack() as stack:
        decoded = [_decode(stack.enter_context(_open(file)), file, k) for file, k in tracks]
        for frames in zip(*decoded, strict=False):
            yield round(1e9 * float(frames[0].time or 0.0)), tuple(_rgb(frame) for frame in frames)


def _tracks(path: Path, lenses: int) -> list[tuple[Path, int]]:
    """Return the files and picture tracks that hold the lenses."""
    with _open(path) as container:
        count = len(container.streams.video)
    if count >= lenses > 1:
        return [(path, k) for k in range(lenses)]
    if path.suffix.lower() == ".insv" and lenses == len(PAIRED) and PAIRED[0] in path.name:
        other = path.with_name(path.name.replace(*PAIRED))
        if not other.exists():
            raise FootageError(
                f"{path}: one lens only, and {other.name} with the other one is missing"
            )
        return [(path, 0), (other, 0)]
    return [(path, 0)]


def _open(path: Path) -> Any:
    try:
        container = av.open(str(path))
    except (FFmpegError, OSError) as error:
        reason = getattr(error, "strerror", None) or error
        raise FootageError(f"{path}: no video that can be opened ({reason})") from None
    if not container.streams.video:
        container.close()
        raise FootageError(f"{path}: no picture track in it")
    return container


def _decode(container: Any, path: Path, track: int) -> Iterable[VideoFrame]:
    """Every readable picture; a damaged end is a shorter video."""
    read = False
    try:
        for frame in container.decode(container.streams.video[track]):
            read = True
            yield frame
    except FFmpegError as error:
        if not read:
            raise FootageError(
                f"{path}: damaged before its first picture ({error.strerror or error}); "
                "copy it from the camera again"
            ) from None
    if not read:
        raise FootageError(f"{path}: a video without a single readable picture")


def _rgb(frame: VideoFrame) -> NDArray[np.uint8]:
    """BT.709 where the file does not say otherwise: what cameras of this kind write."""
    said = frame.colorspace in (AVCOL_SPC_BT470BG, AVCOL_SPC_SMPTE170M)
    full = frame.color_range == ColorRange.JPEG
    picture = frame.reformat(
        format="rgb24",
        src_colorspace=Colorspace.ITU601 if said else Colorspace.ITU709,
        src_color_range=ColorRange.JPEG if full else ColorRange.MPEG,
    ).to_ndarray()
    return np.asarray(picture, dtype=np.uint8)
