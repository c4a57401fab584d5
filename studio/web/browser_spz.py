"""Splats as browsers read them: SPZ version 3, whose attributes are those of version 4.

Spark 2.2 reads versions 1 to 3, one gzip stream; `scenes.formats.spz` writes version 4, a zstd
stream an attribute. The bytes within are the same, so nothing is rounded a second time.
"""

from __future__ import annotations

import gzip
import struct
from collections.abc import Iterator
from pathlib import Path

from scenes.formats.containers.spz_container import MAGIC, open_spz, unpacked
from scenes.formats.spz import write_spz
from scenes.formats.storage.blocks import ROWS_PER_BLOCK
from scenes.frames import WORLD_FROM_FORWARD_CAMERA
from scenes.harmonics import turned
from scenes.splats import SplatCloud

VERSION = 3
GZIP_LEVEL = 9

_HEADER = struct.Struct("<4sIIBBBB")


def write_browser_spz(path: Path, cloud: SplatCloud) -> int:
    """Write a cloud whose up is Z; the file's up is Y, as in any SPZ file.

    `scenes.frames.WORLD_FROM_GLTF` turns what is read from it back to Z up.

    Args:
        path: the file to make; a sibling is used and deleted meanwhile.
        cloud: axes x right, y forward, z up, metres.

    Returns:
        The size of the file in bytes.

    Raises:
        FormatError: a position is too far away.
        OSError: the disk is full or the folder is not writable.
    """
    newer = path.with_name(f"{path.name}.v4")
    try:
        write_spz(newer, turned(cloud, WORLD_FROM_FORWARD_CAMERA.inverse()))
        # Without a time and a name in the stream, the same splats are the same bytes.
        with (
            path.open("wb") as file,
            gzip.GzipFile("", "wb", compresslevel=GZIP_LEVEL, fileobj=file, mtime=0) as stream,
        ):
            for block in _older(newer):
                stream.write(block)
    finally:
        newer.unlink(missing_ok=True)
    return path.stat().st_size


def _older(path: Path) -> Iterator[bytes]:
    """The plain bytes of a version 3 file: header, then all of one attribute after the other."""
    file = open_spz(path)
    yield _HEADER.pack(
        MAGIC, VERSION, file.count, file.degree, file.fractional_bits, file.flags & 1, 0
    )
    for attribute in range(len(file.widths())):
        for _start, parts in unpacked(file, ROWS_PER_BLOCK):
            yield parts[attribute].tobytes()
