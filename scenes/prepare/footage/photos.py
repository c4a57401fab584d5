# pyright: standard
"""Photos as a capture: judged, turned upright, made smaller, their focal length read."""

from __future__ import annotations

import itertools
import math
import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import ExifTags, Image

from scenes.formats.storage.atomic import write_file
from scenes.prepare.footage.capture import (
    JPEG_QUALITY,
    Capture,
    CaptureKind,
    CaptureOptions,
    Frame,
    Rejected,
    too_few,
)
from scenes.prepare.footage.equirectangular import is_dual_fisheye, is_equirectangular
from scenes.prepare.footage.picture_files import read_upright, reads_heif
from scenes.prepare.footage.sharpness import Quality, Reason, judge, shrunk, verdict
from scenes.prepare.progress import Progress

FILM_DIAGONAL_MM = math.hypot(36.0, 24.0)
"""Diagonal of a 35 mm picture, of which EXIF gives equivalent focal lengths."""
THUMB_PX = 64
"""Size at which photos are compared for being the same."""
ALIKE_GREY_LEVELS = 1.5
"""Photos whose thumbnails differ by less on average are the same picture."""
JUDGING_SHARE = 0.5
"""Share of the progress that judging takes; copying takes the rest."""


@dataclass(frozen=True, slots=True)
class Lens:
    """A photo's metadata about its lens.

    Attributes:
        focal_per_longest: focal length over the picture's longest side; None if unknown.
        camera: maker, model and zoom, for grouping photos that share intrinsics.
    """

    focal_per_longest: float | None
    camera: str


def gather_photos(
    files: Sequence[Path],
    folder: Path,
    *,
    name: str,
    options: CaptureOptions,
    passed_over: Sequence[Rejected] = (),
    progress: Progress,
) -> Capture:
    """Judge photos and copy the usable ones into `folder`, upright JPEG.

    Args:
        files: the photos, in the order they were taken.
        folder: exists and is empty.
        name: what to call them in messages.
        options: limits.
        passed_over: what else lay with them and is not read.
        progress: called with the share done.

    Raises:
        CaptureError: too few are usable.
        OSError: a picture cannot be written.
    """
    kept_files, rejected = _judge(files, options, progress)
    rejected.extend(passed_over)
    if len(kept_files) < options.least_frames:
        raise too_few(name, len(kept_files), rejected, wanted=options.least_frames)
    if len(kept_files) > options.most_photos:
        even = np.linspace(0, len(kept_files) - 1, options.most_photos).round().astype(int)
        kept_files = [kept_files[i] for i in even]
    frames: list[Frame] = []
    names = _unique_names([file for file, _ in kept_files])
    for number, ((file, quality), stored) in enumerate(zip(kept_files, names, strict=True)):
        progress(
            JUDGING_SHARE + (1 - JUDGING_SHARE) * number / len(kept_files), f"copying {file.name}"
        )
        picture = read_upright(file)
        if picture is None:
            raise OSError(
                f"{file}: could be read a moment ago and no longer; is its disk still in?"
            )
        picture = fitted(picture, options.longest_px)
        write_jpeg(folder / stored, picture)
        lens = read_lens(file)
        height, width = picture.shape[:2]
        focal = lens.focal_per_longest
        frames.append(
            Frame(
                name=stored,
                source=file.name,
                blur=quality.blur,
                lens=f"{width}×{height} {lens.camera}",
                focal_px=focal * max(width, height) if focal else None,
            )
        )
    return Capture(CaptureKind.PHOTOS, name, folder, tuple(frames), tuple(rejected))


def read_lens(file: Path) -> Lens:
    """Focal length and camera from EXIF; nothing if there is none.

    The focal length for 35 mm film refers to its diagonal (CIPA DC-008). Without it, the focal
    length in millimetres needs the sensor's resolution.
    """
    reads_heif()
    try:
        with Image.open(file) as picture:
            width, height = picture.size
            main = picture.getexif()
            details = main.get_ifd(ExifTags.IFD.Exif)
    except (OSError, ValueError, SyntaxError):
        return Lens(None, "")
    camera = " ".join(
        str(main.get(tag, "")).strip("\0 ") for tag in (ExifTags.Base.Make, ExifTags.Base.Model)
    )
    film_mm = _positive(details.get(ExifTags.Base.FocalLengthIn35mmFilm))
    real_mm = _positive(details.get(ExifTags.Base.FocalLength))
    per_longest = None
    if film_mm:
        per_longest = film_mm / FILM_DIAGONAL_MM * math.hypot(width, height) / max(width, height)
    elif real_mm:
        density = _positive(details.get(ExifTags.Base.FocalPlaneXResolution))
        unit_mm = {2: 25.4, 3: 10.0, 4: 1.0}.get(
            int(details.get(ExifTags.Base.FocalPlaneResolutionUnit, 2)), 25.4
        )
        if density:
            per_longest = real_mm * density / unit_mm / max(width, height)
    zoom = f"{film_mm or real_mm or 0:g} mm"
    plausible = per_longest if per_longest and 0.2 < per_longest < 10 else None
    return Lens(plausible, f"{camera.strip()} {zoom}".strip())


def fitted(picture: NDArray[np.uint8], longest_px: int) -> NDArray[np.uint8]:
    """The picture with its longest side at most `longest_px`."""
    height, width = picture.shape[:2]
    scale = longest_px / max(height, width)
    if scale >= 1:
        return picture
    size = (round(width * scale), round(height * scale))
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)


def write_jpeg(path: Path, bgr: NDArray[np.uint8]) -> None:
    """Write a picture whole or not at all.

    Raises:
        OSError: the disk is full or the folder is not writable.
    """
    quality = [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY]
    done, data = cv2.imencode(".jpg", bgr, quality)
    if not done:
        raise OSError(f"{path}: a picture of {bgr.shape} could not be encoded")
    write_file(path, [data.tobytes()])


def _judge(
    files: Sequence[Path], options: CaptureOptions, progress: Progress
) -> tuple[list[tuple[Path, Quality]], list[Rejected]]:
    judged: list[tuple[Path, Quality]] = []
    thumbs: list[NDArray[np.uint8]] = []
    rejected: list[Rejected] = []
    for number, file in enumerate(files):
        progress(JUDGING_SHARE * number / len(files), f"looking at {file.name}")
        picture = read_upright(file)
        if picture is None:
            rejected.append(Rejected(file.name, Reason.UNREADABLE))
            continue
        grey = np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
        if is_equirectangular([grey]) or is_dual_fisheye([grey]):
            rejected.append(Rejected(file.name, Reason.SPHERICAL))
            continue
        judged.append((file, judge(grey)))
        thumbs.append(shrunk(grey, THUMB_PX))
    typical = float(np.median([quality.blur for _, quality in judged])) if judged else 0.0
    kept: list[tuple[Path, Quality]] = []
    kept_thumbs: list[NDArray[np.uint8]] = []
    for (file, quality), thumb in zip(judged, thumbs, strict=True):
        reason = verdict(quality, typical, options.quality)
        if reason is None and any(_same_picture(thumb, other) for other in kept_thumbs):
            reason = Reason.ALIKE
        if reason is not None:
            rejected.append(Rejected(file.name, reason))
            continue
        kept.append((file, quality))
        kept_thumbs.append(thumb)
    return kept, rejected


def _same_picture(a: NDArray[np.uint8], b: NDArray[np.uint8]) -> bool:
    if a.shape != b.shape:
        return False
    return float(np.abs(a.astype(np.int16) - b).mean()) < ALIKE_GREY_LEVELS


def _unique_names(files: Sequence[Path]) -> list[str]:
    """One JPEG name per photo: its own where no other has it, on any disk.

    Numbers are added where names fall together without their suffix, and never ones that another
    photo has.
    """
    stems = ["_".join(file.stem.split()) or "photo" for file in files]
    shared = Counter(stem.casefold() for stem in stems)
    taken = {stem for stem, count in shared.items() if count == 1}
    names: list[str] = []
    for number, stem in enumerate(stems):
        name = stem
        if shared[stem.casefold()] > 1:
            numbers = itertools.count(number)
            while name.casefold() in taken or name == stem:
                name = f"{stem}_{next(numbers):04d}"
            taken.add(name.casefold())
        names.append(f"{name}.jpg")
    return names


def _positive(value: object) -> float | None:
    try:
        number = float(os.fspath(value) if isinstance(value, os.PathLike) else value)  # type: ignore[arg-type]
    except (TypeError, ValueError, ZeroDivisionError):
        return None
    return number if math.isfinite(number) and number > 0 else None
