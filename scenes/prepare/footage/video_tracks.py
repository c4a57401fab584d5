"""Picture tracks of videos: opened and decoded, one, or one a lens of a 360° camera."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import av
from av.error import FFmpegError

from scenes.prepare.footage.capture import CaptureError

PAIRED = ("_00_", "_10_")
"""Part of a name that says which lens, of cameras that write one file a lens."""


@contextmanager
def open_video(file: Path) -> Generator[tuple[Any, Any]]:
    """Open a video; gives the container and its first picture track.

    Raises:
        CaptureError: it is no video.
    """
    try:
        container = av.open(str(file))
    except (FFmpegError, OSError) as error:
        todo = "it is damaged or not whole: copy it from the camera again"
        if file.suffix.lower() not in (".mp4", ".mov", ".m4v"):
            todo = f"export it as MP4, or, where others of its kind open, {todo}"
        raise CaptureError(
            f"{file}: no video that can be opened ({error.strerror or error}); {todo}"
        ) from None
    with container:
        if not container.streams.video:
            raise CaptureError(f"{file}: no picture track in it; give a video of the room")
        stream = container.streams.video[0]
        stream.thread_type = "AUTO"
        stream.codec_context.thread_count = 2
        yield container, stream


def decoded(file: Path, *, container: Any, stream: Any) -> Iterator[tuple[int, float, Any]]:
    """(number, seconds, frame) of every readable frame; a damaged end is a shorter video.

    Raises:
        CaptureError: it is damaged before its first frame.
    """
    index = 0
    try:
        for frame in container.decode(stream):
            yield index, float(frame.time or 0.0), frame
            index += 1
    except FFmpegError as error:
        if index == 0:
            raise CaptureError(
                f"{file}: damaged before its first picture ({error.strerror or error}); "
                "copy it from the camera again"
            ) from None


def decoded_lenses(
    file: Path, lenses: int, *, stack: ExitStack
) -> Iterator[tuple[int, float, tuple[Any, ...]]]:
    """(number, seconds, frames) of a video: a frame for all lenses, or one a track or file.

    Args:
        file: the video; of a pair of files the first.
        lenses: how many the camera has.
        stack: closes what is opened.

    Raises:
        CaptureError: it is no video, is damaged, or the other file of a pair is missing.
    """
    container, stream = stack.enter_context(open_video(file))
    tracks = [(file, container, stream)]
    count = len(container.streams.video)
    if count >= lenses > 1:
        for number in range(1, lenses):
            other, _ = stack.enter_context(open_video(file))
            tracks.append((file, other, other.streams.video[number]))
    elif lenses == len(PAIRED) and file.suffix.lower() == ".insv" and PAIRED[0] in file.name:
        beside = file.with_name(file.name.replace(*PAIRED))
        if not beside.exists():
            raise CaptureError(
                f"{file}: one lens only, and {beside.name} with the other one is missing; "
                "copy it beside the first"
            )
        tracks.append((beside, *stack.enter_context(open_video(beside))))
    shown = [decoded(of, container=held, stream=track) for of, held, track in tracks]
    for shots in zip(*shown, strict=False):
        yield shots[0][0], shots[0][1], tuple(frame for _, _, frame in shots)


def frame_count(container: Any, stream: Any) -> int:
    """Return how many frames a video says it has; 0 where it does not."""
    if stream.frames:
        return int(stream.frames)
    if container.duration and stream.average_rate:
        return int(container.duration / av.time_base * float(stream.average_rate))
    return 0
