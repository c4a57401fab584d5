"""Filmed takes in the user's cache: every method sees the same frames, and the next run too.

A take is a folder with the recording (video, times, truth, the camera's true pose) and one picture
of body numbers per lens and frame, which the perfect detector cuts its masks out of. What the known
camera pose is off by is not part of a take: it is added when the take is played.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
import platformdirs

from devices.recording import read_session
from devices.session_info import SessionInfo
from scenes.package import DISTRIBUTION
from scenes.pose import Pose
from sim.truth import GroundTruth, IdMasks
from studio.session.pipeline import SessionMessage, recorded_messages

RECORDING, BODY_NUMBERS = "take.mcap", "body-numbers.zip"

PICTURE_SOURCES = (
    "devices/video.py",
    "scenes/cameras.py",
    "scenes/samples/*.py",
    "benchmarks/random_rooms/*.py",
    "scenes/samples/data/*",
    "sim/camera/*.py",
)
"""Code and data that decide what the simulated camera sees."""

CACHE_LIMIT_BYTES = 4 * 1024**3
"""What all takes together may occupy; the longest unused go first."""


@dataclass(frozen=True, slots=True)
class Take:
    """A filmed take.

    Attributes:
        folder: holds `RECORDING` and `BODY_NUMBERS`.
        body_ids: bodies by number, the first is number 1.
    """

    folder: Path
    body_ids: tuple[str, ...]

    def session(self) -> SessionInfo:
        """How it was filmed: lenses, seed, versions."""
        return read_session(self.folder / RECORDING)

    def play(
        self, known_world_from_rig: Pose, *, with_masks: bool = True
    ) -> Iterator[SessionMessage]:
        """Its frames in order, decoded.

        Args:
            known_world_from_rig: `world_from_rig` that the frames carry: what a marker says.
            with_masks: give the ground truth its masks, which take time to decode.

        Raises:
            RecordingError: the take is damaged.
        """
        path = self.folder / RECORDING
        numbers = {name: 1 + k for k, name in enumerate(self.body_ids)}
        with zipfile.ZipFile(self.folder / BODY_NUMBERS) as pictures:
            info = self.session()
            for recorded in recorded_messages(path, info):
                frame = replace(recorded.frame, world_from_rig=known_world_from_rig)
                message = recorded.with_frame(frame)
                if not with_masks or message.truth is None:
                    yield message
                    continue
                ids = [
                    _decoded(pictures.read(picture_name(message.frame.seq, lens)))
                    for lens in range(len(info.rig.lenses))
                ]
                truth = GroundTruth(message.truth.recorded, IdMasks(ids, numbers))
                yield replace(message, truth=truth)


class TakeCache:
    """Takes by the digest of everything that decides their pictures.

    Args:
        root: the folder; by default in the user's cache.
        limit_bytes: what all takes together may occupy.
    """

    def __init__(self, root: Path | None = None, *, limit_bytes: int = CACHE_LIMIT_BYTES) -> None:
        self._root = root or Path(platformdirs.user_cache_dir(DISTRIBUTION)) / "takes"
        self._limit_bytes = limit_bytes

    def find(self, key: str, body_ids: tuple[str, ...]) -> Take | None:
        """The take of this key, if it was filmed before."""
        folder = self._root / key
        if not (folder / RECORDING).is_file():
            return None
        os.utime(folder)
        return Take(folder, body_ids)

    @contextmanager
    def filming(self, key: str) -> Iterator[Path]:
        """A folder to film into; it becomes the take when the block ends well, else nothing stays.

        Raises:
            OSError: the cache cannot be written.
        """
        folder = self._root / key
        part = self._root / f"{key}.part-{os.getpid()}"
        shutil.rmtree(part, ignore_errors=True)
        part.mkdir(parents=True)
        try:
            yield part
            shutil.rmtree(folder, ignore_errors=True)
            part.replace(folder)
        finally:
            shutil.rmtree(part, ignore_errors=True)
        self._forget_oldest(keep=folder)

    def _forget_oldest(self, *, keep: Path) -> None:
        folders = sorted(
            (f for f in self._root.iterdir() if f.is_dir() and ".part-" not in f.name),
            key=lambda f: f.stat().st_mtime,
        )
        sizes = {f: sum(p.stat().st_size for p in f.iterdir()) for f in folders}
        total = sum(sizes.values())
        for folder in folders:
            if total <= self._limit_bytes:
                break
            if folder != keep:
                with suppress(OSError):
                    shutil.rmtree(folder)
                    total -= sizes[folder]


def picture_name(seq: int, lens: int) -> str:
    """Name of a lens's picture of body numbers within `BODY_NUMBERS`."""
    return f"{seq:06d}-{lens}.png"


def source_digest() -> bytes:
    """Changes with any code or data that decides what the simulated camera sees."""
    root = Path(__file__).parents[3]
    digest = hashlib.sha256()
    for pattern in PICTURE_SOURCES:
        for source in sorted(root.glob(pattern)):
            digest.update(source.name.encode())
            digest.update(source.read_bytes())
    return digest.digest()


def _decoded(png: bytes) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    picture = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_GRAYSCALE)
    return np.asarray(picture, dtype=np.uint8)
