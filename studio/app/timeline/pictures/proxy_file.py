"""Reduced pictures of a recording in a file of the user's cache: written once, read while it grows.

After `MAGIC` comes a record a picture: number of its packet, capture time, size and CRC-32 of the
JPEG that follows. The last record, `END`, has no JPEG; its time is the file's size. An all-intra
MP4 of the same pictures is two thirds as large and found as soon (0.9 against 0.7 ms), but takes
three times as long to write, and a reader that has opened one does not see it grow.
"""

from __future__ import annotations

import os
import shutil
import struct
import time
import zlib
from contextlib import suppress
from pathlib import Path
from typing import IO

import cv2
import numpy as np
import platformdirs
from numpy.typing import NDArray

MAGIC = b"GNPROX1\n"
SUFFIX = ".proxies"
END = 0xFFFFFFFF
_HEAD = struct.Struct("<IqII")

MAX_JPEG_BYTES = 1 << 22
"""A larger record is damage: the reduced picture without any compression has 0.7 MB."""

MAX_BYTES = 2 << 30
"""Of all files together, chosen: five minutes of noise at ten pictures a second, the worst there is
to compress, take 0.35 GB. The files that were used longest ago are removed first."""

KEPT_FREE_BYTES = 1 << 30
"""Of the disk, chosen: a recording needs it more."""

ABANDONED_S = 3600.0
"""After so long without a new picture, an unfinished file belongs to a process that is gone."""

QUALITY = 80
"""Of the JPEG, of 100, chosen: blocks are not seen at the size at which it is shown."""


def proxy_folder() -> Path:
    """Return the folder of the files: in NEXUS_HOME where that is set, else in the user's cache."""
    named = os.environ.get("NEXUS_HOME")
    home = Path(named) if named else Path(platformdirs.user_cache_dir("gaussiannexus-studio"))
    return home / "timeline-pictures"


def make_room(folder: Path, *, keep: Path | None, most_bytes: int = MAX_BYTES) -> None:
    """Remove what nobody will finish, and the files used longest ago until the rest fits.

    Args:
        folder: of the files.
        keep: one that stays whatever its size.
        most_bytes: of all.
    """
    found: list[tuple[float, int, Path]] = []
    for path in folder.glob(f"*{SUFFIX}"):
        with suppress(OSError):
            status = path.stat()
            found.append((status.st_mtime, status.st_size, path))
    total = sum(size for _, size, _ in found)
    for used_s, size, path in sorted(found):
        is_left = time.time() - used_s > ABANDONED_S and not is_whole(path)
        if path != keep and (total > most_bytes or is_left):
            with suppress(OSError):
                path.unlink()
                total -= size


def is_whole(path: Path) -> bool:
    """Whether a file was written to its end."""
    try:
        size = path.stat().st_size
        with path.open("rb") as file:
            file.seek(max(0, size - _HEAD.size))
            return file.read() == _HEAD.pack(END, size, 0, 0)
    except OSError:
        return False


class ProxyWriter:
    """Writes one file; whoever gives up removes it.

    Args:
        path: of a new or empty file.

    Raises:
        OSError: it cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.size_bytes = len(MAGIC)
        self._file = path.open("wb", buffering=0)
        self._file.write(MAGIC)

    def add(self, number: int, t_ns: int, picture: NDArray[np.uint8]) -> None:
        """Append a picture.

        Args:
            number: of its packet, from 0.
            t_ns: when it was taken.
            picture: (H, W, 3) RGB.

        Raises:
            OSError: the disk is as good as full.
        """
        if shutil.disk_usage(self.path.parent).free < KEPT_FREE_BYTES:
            raise OSError(f"{self.path.parent}: less than {KEPT_FREE_BYTES >> 20} MB are free")
        bgr = cv2.cvtColor(picture, cv2.COLOR_RGB2BGR)
        _, jpeg = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
        data = jpeg.tobytes()
        self._write(_HEAD.pack(number, t_ns, len(data), zlib.crc32(data)) + data)

    def finish(self) -> None:
        """Say that nothing is missing.

        Raises:
            OSError: the disk is full.
        """
        self._write(_HEAD.pack(END, self.size_bytes + _HEAD.size, 0, 0))
        self.close()

    def close(self) -> None:
        """Leave it as it is."""
        self._file.close()

    def _write(self, data: bytes) -> None:
        if self._file.write(data) != len(data):
            raise OSError(f"{self.path}: the disk is full")
        self.size_bytes += len(data)


class ProxyFile:
    """Reads a file that may still grow; one thread's.

    Args:
        path: of the file.

    Attributes:
        is_damaged: whether it holds something else than pictures: nothing is taken from it then.

    Raises:
        OSError: it cannot be opened.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.is_damaged = False
        self._file: IO[bytes] = path.open("rb")
        self._end = 0
        self._places: dict[int, tuple[int, int, int, int]] = {}
        """Capture time, place, size and CRC-32 of each picture, by its packet's number."""

    def __len__(self) -> int:
        """Pictures that are known to be there."""
        return len(self._places)

    def find(self, number: int, t_ns: int) -> NDArray[np.uint8] | None:
        """The picture (H, W, 3), RGB, of a packet; None if it is not there or not whole.

        Args:
            number: of the packet.
            t_ns: when it was taken.
        """
        try:
            if number not in self._places:
                self._read_on()
            if self.is_damaged or number not in self._places:
                return None
            taken_ns, place, size, crc = self._places[number]
            self._file.seek(place)
            data = self._file.read(size)
        except OSError:
            self.is_damaged = True
            return None
        if taken_ns != t_ns or zlib.crc32(data) != crc:
            self.is_damaged = True
            return None
        bgr = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
        if bgr is None:
            self.is_damaged = True
            return None
        return np.asarray(cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB), np.uint8)

    def _read_on(self) -> None:
        """Take the records that have come since."""
        size = os.fstat(self._file.fileno()).st_size
        if not self._end:
            if size < len(MAGIC):
                return
            self._file.seek(0)
            self.is_damaged = self._file.read(len(MAGIC)) != MAGIC
            self._end = len(MAGIC)
        while not self.is_damaged and self._end + _HEAD.size <= size:
            self._file.seek(self._end)
            number, t_ns, length, crc = _HEAD.unpack(self._file.read(_HEAD.size))
            place = self._end + _HEAD.size
            if number == END:
                return
            if not 0 < length <= MAX_JPEG_BYTES:
                self.is_damaged = True
            if place + length > size:
                return
            self._places[number] = (t_ns, place, length, crc)
            self._end = place + length

    def close(self) -> None:
        """Close it."""
        self._file.close()
