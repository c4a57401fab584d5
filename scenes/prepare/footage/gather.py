"""From a video, a folder or a list of photos to the chosen pictures."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from scenes.cameras import rig_to_json
from scenes.prepare.footage.capture import (
    CAPTURE_FILE,
    PICTURE_SUFFIXES,
    VIDEO_SUFFIXES,
    Capture,
    CaptureError,
    CaptureOptions,
    Rejected,
    load_capture,
    save_capture,
)
from scenes.prepare.footage.photos import gather_photos
from scenes.prepare.footage.picture_files import reads_heif
from scenes.prepare.footage.sharpness import Reason
from scenes.prepare.footage.video_frames import gather_video
from scenes.prepare.progress import Progress, silent

FRAMES_FOLDER = "frames"
SYSTEM_FILES = frozenset({"Thumbs.db", "desktop.ini"})
"""Files that systems leave in folders of pictures, which nobody brought."""


def gather(
    source: Path | Sequence[Path],
    work_dir: Path,
    *,
    options: CaptureOptions | None = None,
    progress: Progress = silent,
) -> Capture:
    """Choose the pictures that a room is made from.

    The originals are only read. Chosen pictures go to `work_dir/frames`; a second call with the
    same input and options finds them there.

    Args:
        source: a video file, a folder of photos, or photos.
        work_dir: folder for what the preparation makes; made if missing.
        options: how frames are chosen.
        progress: called with the share done.

    Raises:
        CaptureError: nothing usable, or too little; says what to film instead.
        OSError: the disk is full or a folder is not accessible.
        Cancelled: from `progress`.
    """
    chosen = options or CaptureOptions()
    files, name = _files(source)
    key = _key(files, chosen)
    folder = work_dir / FRAMES_FOLDER
    done = load_capture(folder, key)
    if done is not None:
        progress(1.0, done.summary())
        return done
    _clear(folder)
    if len(files) == 1 and files[0].suffix.lower() in VIDEO_SUFFIXES:
        capture = gather_video(files[0], folder, options=chosen, progress=progress)
    else:
        passed_over = _passed_over(source, files) if isinstance(source, Path) else ()
        capture = gather_photos(
            files,
            folder,
            name=name,
            options=chosen,
            passed_over=passed_over,
            progress=progress,
        )
    save_capture(capture, key)
    progress(1.0, capture.summary())
    return capture


def capture_key(source: Path | Sequence[Path], options: CaptureOptions) -> dict[str, Any]:
    """Return all that `gather` depends on, as plain values: other files give another key.

    Raises:
        CaptureError: there is nothing to choose from.
    """
    files, _ = _files(source)
    return _key(files, options)


def _files(source: Path | Sequence[Path]) -> tuple[list[Path], str]:
    """The files that are meant, and what to call them."""
    if not isinstance(source, Path):
        files = list(source)
        if not files:
            raise CaptureError("no photos given, wanted a video, a folder or photos")
        return files, f"{len(files)} photos"
    if source.is_dir():
        files = sorted(f for f in source.iterdir() if f.suffix.lower() in PICTURE_SUFFIXES)
        videos = sorted(f for f in source.iterdir() if f.suffix.lower() in VIDEO_SUFFIXES)
        if not files and len(videos) == 1:
            return videos, videos[0].name
        if not files:
            raise CaptureError(
                f"{source}: a folder without photos ({', '.join(sorted(PICTURE_SUFFIXES))}); "
                "give the folder that holds the photos, or one video file"
            )
        return files, source.name
    if not source.is_file():
        raise CaptureError(f"{source}: there is no such file or folder; check the name")
    if source.suffix.lower() not in VIDEO_SUFFIXES | PICTURE_SUFFIXES:
        raise CaptureError(
            f"{source}: neither a video ({', '.join(sorted(VIDEO_SUFFIXES))}) nor a folder of "
            "photos; export it as MP4 or JPEG"
        )
    return [source], source.name


def _passed_over(source: Path, files: Sequence[Path]) -> tuple[Rejected, ...]:
    """List the other files of the folder: their owner may think that they are read."""
    if not source.is_dir():
        return ()
    taken = set(files)
    others = [
        file
        for file in sorted(source.iterdir())
        if file not in taken and not file.name.startswith(".") and file.name not in SYSTEM_FILES
    ]
    return tuple(
        Rejected(file.name + ("/" if file.is_dir() else ""), Reason.FOREIGN)
        for file in others
        if file.is_file() or any(f.suffix.lower() in PICTURE_SUFFIXES for f in file.iterdir())
    )


def _key(files: Sequence[Path], options: CaptureOptions) -> dict[str, Any]:
    """Return all that the choice depends on, as plain values."""
    values = {
        "files": [_stamp(file) for file in files],
        "reads_heif": reads_heif(),
        "options": asdict(replace(options, rig=None)),
        "rig": rig_to_json(options.rig) if options.rig else None,
    }
    return json.loads(json.dumps(values))


def _stamp(file: Path) -> list[str | int]:
    try:
        status = file.stat()
    except OSError as error:
        raise CaptureError(f"{file}: cannot be opened ({error.strerror}); check the name") from None
    return [str(file.resolve()), status.st_size, status.st_mtime_ns]


def _clear(folder: Path) -> None:
    """An empty folder for the pictures; only what an earlier call chose is removed."""
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.glob("*.jpg"):
        old.unlink()
    (folder / CAPTURE_FILE).unlink(missing_ok=True)
