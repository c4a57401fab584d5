"""Pictures out of a film, spread evenly over it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import av
from av.error import FFmpegError
from PIL import Image

WIDTH_PX = 1200
"""Of the pictures, chosen: sharp in print on half a page."""

JPEG_QUALITY = 84


def write_stills(film: Path, folder: Path, count: int) -> list[tuple[float, Path]]:
    """Write JPEG files `1.jpg`, `2.jpg`, ... and give the second of the film that each shows.

    Args:
        film: a video file.
        folder: made if it is missing.
        count: how many; fewer where the film has fewer pictures.

    Raises:
        ValueError: the film cannot be decoded.
        OSError: a file cannot be read or written.
    """
    folder.mkdir(exist_ok=True)
    found: list[tuple[float, Path]] = []
    try:
        for number, (t_s, picture) in enumerate(_pictures(film, count), start=1):
            height = max(1, round(picture.height * WIDTH_PX / picture.width))
            path = folder / f"{number}.jpg"
            smaller = picture.resize((WIDTH_PX, height), Image.Resampling.LANCZOS)
            smaller.save(path, "JPEG", quality=JPEG_QUALITY)
            found.append((t_s, path))
    except FFmpegError as error:
        raise ValueError(f"{film}: damaged film: {error}; make it again by rehearsing") from None
    return found


def _pictures(film: Path, count: int) -> Iterator[tuple[float, Image.Image]]:
    """In the middle of `count` equal spans; the film is gone to there, not read through."""
    with av.open(str(film)) as container:
        if not container.streams.video:
            raise ValueError(f"{film}: holds no video; make it again by rehearsing")
        stream = container.streams.video[0]
        span_s = float((container.duration or 0) / av.time_base)
        last = -1.0
        for index in range(count):
            wanted_s = span_s * (index + 0.5) / count
            container.seek(int(wanted_s * av.time_base))
            for frame in container.decode(stream):
                at_s = frame.time or 0.0
                if at_s + 1e-3 >= wanted_s:
                    if at_s > last:
                        yield at_s, frame.to_image()
                        last = at_s
                    break
