# pyright: standard
"""A video as a capture: looked through once to choose, once more to take the chosen frames."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.prepare.footage.capture import (
    Capture,
    CaptureError,
    CaptureKind,
    CaptureOptions,
    Frame,
    Gap,
    Rejected,
    too_few,
)
from scenes.prepare.footage.equirectangular import (
    FlatView,
    cut,
    flat_views,
    has_spherical_metadata,
    is_dual_fisheye,
    is_equirectangular,
    is_two_to_one,
)
from scenes.prepare.footage.frame_choice import choose_frames
from scenes.prepare.footage.hdr import bgr_picture, hdr_kind
from scenes.prepare.footage.panorama_views import PanoramaView, panorama_views, view_pictures
from scenes.prepare.footage.photos import fitted, write_jpeg
from scenes.prepare.footage.sharpness import (
    LOOK_PX,
    Quality,
    Reason,
    displacement,
    judge,
    verdict,
)
from scenes.prepare.footage.video_tracks import decoded, decoded_lenses, frame_count, open_video
from scenes.prepare.progress import Progress

KIND_LOOKS, KIND_STRIDE = 5, 6
"""Frames by which the projection is recognised, and how far they are apart."""
LOOKS_PER_FRAME = 8
"""Frames that are judged for each one that is taken."""
SHORT_S = 20.0
"""A shorter video shows no room from all sides at the pace of a walk, seconds: docs/preparation.md
asks for one to two minutes."""
LOOKING_SHARE = 0.7
"""Share of the progress that looking through a video takes."""
LITTLE_OVERLAP = 0.35
"""Motion between chosen frames, in pictures, from which on their overlap is small."""
MAX_SMEAR = 8
"""Looks for which a smeared passage is bridged."""
FEWER_PANORAMAS = 3
"""A 360° picture shows the whole room, so fewer places are enough."""


@dataclass(frozen=True, slots=True)
class Look:
    """A judged frame.

    Attributes:
        index: its number in the video.
        t_s: its time.
        quality: of the single picture.
        moved: since the last look at a sharp frame, as a fraction of the width; 0 for a smeared
            one, in which nothing can be followed.
    """

    index: int
    t_s: float
    quality: Quality
    moved: float


def gather_video(
    file: Path, folder: Path, *, options: CaptureOptions, progress: Progress
) -> Capture:
    """Choose frames of a video and write them into `folder`, upright JPEG.

    Raises:
        CaptureError: it is no video, or too few frames are usable.
        OSError: a picture cannot be written.
    """
    if file.suffix.lower() == ".insv" and options.rig is None:
        raise CaptureError(
            f"{file}: a 360° video needs the calibration of its lenses; give the camera's rig "
            "file, or export a flat video from the camera's own program"
        )
    film = _film(file, options)
    looks = _looks(file, options, progress)
    typical = float(np.median([look.quality.blur for look in looks])) if looks else 0.0
    reasons = [verdict(look.quality, typical, options.quality) for look in looks]
    chosen = choose_frames(
        np.array([look.moved for look in looks]),
        np.array([look.quality.blur for look in looks]),
        np.array([reason is None for reason in reasons], dtype=np.bool_),
        wanted=options.frames // (FEWER_PANORAMAS if film.is_panorama else 1),
        steps=options.steps,
    )
    taken = {int(i) for i in chosen}
    rejected = [
        Rejected(f"{file.name} at {clock(look.t_s)}", reasons[i] or Reason.ALIKE, look.t_s)
        for i, look in enumerate(looks)
        if i not in taken
    ]
    if len(taken) < options.least_frames:
        raise _too_few_frames(file, looks[-1].t_s, len(taken), rejected, options.least_frames)
    frames = _write(file, folder, [looks[i] for i in chosen], options, film, progress)
    return Capture(
        CaptureKind.PANORAMA if film.is_panorama else CaptureKind.VIDEO,
        file.name,
        folder,
        frames,
        tuple(rejected),
        _gaps(frames, looks, chosen),
        film.notes(),
    )


@dataclass(frozen=True, slots=True)
class _Film:
    """Kind of pictures that a video holds.

    Attributes:
        rig_views: views to cut where the lenses are calibrated.
        flat_views: views to cut where the pictures are equirectangular.
        hdr: such as HLG; empty for standard range.
    """

    rig_views: tuple[PanoramaView, ...]
    flat_views: tuple[FlatView, ...]
    hdr: str

    @property
    def is_panorama(self) -> bool:
        """Whether one picture shows the whole room."""
        return bool(self.rig_views or self.flat_views)

    def notes(self) -> tuple[str, ...]:
        """Changes made to the pictures, in whole sentences."""
        notes: list[str] = []
        if self.flat_views:
            notes.append(
                "The video is a 360° film in the equirectangular projection: "
                f"{len(self.flat_views)} flat views were cut from each of its pictures."
            )
        if self.hdr:
            notes.append(
                f"The video is in high dynamic range ({self.hdr}): its pictures were tone-mapped "
                "to Rec. 709, and what is brighter than white is white."
            )
        return tuple(notes)


def _film(file: Path, options: CaptureOptions) -> _Film:
    """Find out what kind of pictures a video holds, from a few of the first and its metadata.

    Raises:
        CaptureError: it is no video, or of a projection that is not read.
    """
    greys: list[NDArray[np.uint8]] = []
    hdr, size = "", (0, 0)
    with open_video(file) as (container, stream):
        for index, _, frame in decoded(file, container=container, stream=stream):
            hdr, size = hdr_kind(frame), (frame.width, frame.height)
            if options.rig is not None or not is_two_to_one(*size):
                break
            if index % KIND_STRIDE == 0:
                greys.append(_grey(frame))
            if len(greys) == KIND_LOOKS:
                break
    if options.rig is not None:
        return _Film(panorama_views(options.rig), (), hdr)
    if is_equirectangular(greys) or (greys and has_spherical_metadata(file)):
        return _Film((), flat_views(*size), hdr)
    if is_dual_fisheye(greys) or has_spherical_metadata(file):
        raise CaptureError(
            f"{file}: a 360° film that is not equirectangular ({size[0]}×{size[1]} px), such as "
            "two fisheye pictures side by side; give the lenses' calibration with --rig, or export "
            "an equirectangular or a flat video from the camera's own program"
        )
    return _Film((), (), hdr)


def clock(t_s: float) -> str:
    """A time in a video as people say it, such as 1:07.4."""
    return f"{int(t_s // 60)}:{t_s % 60:04.1f}"


def _too_few_frames(
    file: Path, length_s: float, kept: int, rejected: Sequence[Rejected], wanted: int
) -> CaptureError:
    """The error for a video that leaves too few; of a short one, it says that, too."""
    if length_s >= SHORT_S:
        return too_few(file.name, kept, rejected, wanted=wanted)
    short = (
        f"the video ends at {length_s:.1f} s: film for one to two minutes, walking slowly around"
    )
    if not rejected:
        return too_few(file.name, kept, rejected, wanted=wanted, advice=short)
    return CaptureError(f"{too_few(file.name, kept, rejected, wanted=wanted)}; {short}")


def _looks(file: Path, options: CaptureOptions, progress: Progress) -> list[Look]:
    looks: list[Look] = []
    before: NDArray[np.uint8] | None = None
    sharp_blur, passed_over = 0.0, 0
    with open_video(file) as (container, stream):
        total = frame_count(container, stream)
        stride = max(1, total // (LOOKS_PER_FRAME * options.frames)) if total else 3
        for index, t_s, frame in decoded(file, container=container, stream=stream):
            if index % stride:
                continue
            grey = _grey(frame)
            quality = judge(grey)
            smeared = quality.blur > sharp_blur + options.quality.blur_over_typical
            if before is not None and smeared and passed_over < MAX_SMEAR:
                looks.append(Look(index, t_s, quality, 0.0))
                passed_over += 1
            else:
                moved = displacement(before, grey) if before is not None else 0.0
                looks.append(Look(index, t_s, quality, moved))
                before, sharp_blur, passed_over = grey, quality.blur, 0
            if len(looks) % 8 == 1:
                done = min(1.0, index / total) if total else 0.5
                progress(LOOKING_SHARE * done, f"looking through {file.name}, {clock(t_s)}")
    if not looks:
        raise CaptureError(f"{file}: a video without a single readable picture; copy it again")
    return looks


def _write(
    file: Path,
    folder: Path,
    looks: list[Look],
    options: CaptureOptions,
    film: _Film,
    progress: Progress,
) -> tuple[Frame, ...]:
    wanted = {look.index: look for look in looks}
    frames: list[Frame] = []
    taken = 0
    lenses = 1 if options.rig is None else len(options.rig.lenses)
    with ExitStack() as stack:
        for index, t_s, shots in decoded_lenses(file, lenses, stack=stack):
            look = wanted.pop(index, None)
            if look is None:
                continue
            picture = _beside(file, [_upright(bgr_picture(shot), shot) for shot in shots])
            taken += 1
            for label, part, focal_px in _pictures(picture, options, film):
                name = f"{taken - 1:04d}{label}.jpg"
                write_jpeg(folder / name, part)
                height, width = part.shape[:2]
                frames.append(
                    Frame(
                        name=name,
                        source=f"{file.name} at {clock(t_s)}",
                        blur=look.quality.blur,
                        lens=f"{width}×{height} video",
                        focal_px=focal_px,
                        t_s=t_s,
                    )
                )
            done = taken / len(looks)
            progress(LOOKING_SHARE + (1 - LOOKING_SHARE) * done, f"taking frame {clock(t_s)}")
            if not wanted:
                break
    return tuple(frames)


def _pictures(
    picture: NDArray[np.uint8], options: CaptureOptions, film: _Film
) -> list[tuple[str, NDArray[np.uint8], float | None]]:
    """Pictures to store of one frame: label, picture and focal length if it is known."""
    if film.flat_views:
        return [(f"_{v.label}", cut(picture, v), v.focal_px) for v in film.flat_views]
    if options.rig is None:
        return [("", fitted(picture, options.longest_px), None)]
    views = film.rig_views
    parts = view_pictures(picture, options.rig, views)
    return [
        (f"_{view.label}", part, view.camera.fx) for view, part in zip(views, parts, strict=True)
    ]


def _gaps(
    frames: tuple[Frame, ...], looks: list[Look], chosen: NDArray[np.int64]
) -> tuple[Gap, ...]:
    path = np.cumsum([look.moved for look in looks])
    moved = np.diff(path[chosen])
    each = len(frames) // len(chosen)
    return tuple(
        Gap(frames[each * i].name, frames[each * (i + 1)].name, float(moved[i]))
        for i in np.flatnonzero(moved > LITTLE_OVERLAP)
    )


def _beside(file: Path, pictures: list[NDArray[np.uint8]]) -> NDArray[np.uint8]:
    """Join the pictures of the lenses, the front one left; one picture is taken as it is.

    Raises:
        CaptureError: they are of different heights.
    """
    if len({picture.shape[0] for picture in pictures}) > 1:
        sizes = " and ".join(f"{p.shape[1]}×{p.shape[0]}" for p in pictures)
        raise CaptureError(
            f"{file}: lens pictures of {sizes} px, wanted one size; copy it from the camera again"
        )
    return pictures[0] if len(pictures) == 1 else np.hstack(pictures)


def _grey(frame: Any) -> NDArray[np.uint8]:
    """The picture small and grey, upright."""
    scale = min(1.0, LOOK_PX / max(frame.width, frame.height))
    size = max(2, round(frame.width * scale)), max(2, round(frame.height * scale))
    small = bgr_picture(frame, size)
    return np.asarray(cv2.cvtColor(_upright(small, frame), cv2.COLOR_BGR2GRAY), dtype=np.uint8)


def _upright(picture: NDArray[np.uint8], frame: Any) -> NDArray[np.uint8]:
    """Turned as the video's display matrix says; `rotation` is in degrees, anticlockwise."""
    turns = round(frame.rotation / 90) % 4
    return np.ascontiguousarray(np.rot90(picture, turns)) if turns else picture
