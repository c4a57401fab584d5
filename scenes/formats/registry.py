"""Registry of splat formats: reading and writing by content and file name."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from scenes.formats.containers.glb import MAGIC as GLB_MAGIC
from scenes.formats.gltf import read_gltf_blocks, write_gltf_blocks
from scenes.formats.ply import WORLD_COMMENT, ply_comments, read_ply_blocks, write_ply_blocks
from scenes.formats.sog import META, is_sog_folder, read_sog_blocks
from scenes.formats.splat import read_splat_blocks, write_splat_blocks
from scenes.formats.spz import read_spz_blocks, write_spz_blocks
from scenes.formats.storage.bad_rows import in_words
from scenes.formats.storage.blocks import SplatBlocks, in_blocks, whole
from scenes.formats.storage.error import FormatError, refusal
from scenes.formats.usd import write_usd_blocks
from scenes.frames import WORLD_FROM_FORWARD_CAMERA
from scenes.harmonics import turned
from scenes.splats import SplatCloud

Read = Callable[[Path], SplatBlocks]
Write = Callable[[Path, SplatBlocks], int]


@dataclass(frozen=True, slots=True)
class SplatFormat:
    """A splat file format.

    Attributes:
        name: as people call it.
        suffixes: file name endings, lower case.
        magic: beginnings of such a file; empty if it has none.
        read: reads a file block by block, axes x right, y down, z forward unless the file says
            otherwise, or None if the format is written only.
        write: writes a file and returns its size in bytes, or None if the format is read only.
        max_sh_degree: of the spherical harmonics that it holds.
    """

    name: str
    suffixes: tuple[str, ...]
    magic: tuple[bytes, ...]
    read: Read | None
    write: Write | None
    max_sh_degree: int = 3


FORMATS = (
    SplatFormat("compressed PLY", (".compressed.ply",), (), read_ply_blocks, None),
    SplatFormat("PLY", (".ply",), (b"ply",), read_ply_blocks, write_ply_blocks),
    SplatFormat("SPZ", (".spz",), (b"NGSP", b"\x1f\x8b"), read_spz_blocks, write_spz_blocks),
    SplatFormat("SOG", (".sog",), (b"PK\x03\x04",), read_sog_blocks, None),
    SplatFormat("splat", (".splat",), (), read_splat_blocks, write_splat_blocks, 0),
    SplatFormat("glTF", (".glb",), (GLB_MAGIC,), read_gltf_blocks, write_gltf_blocks),
    SplatFormat("USD", (".usdc", ".usda", ".usd"), (b"PXR-USDC", b"#usda"), None, write_usd_blocks),
)
"""Longer suffixes come first."""

READABLE = ", ".join(suffix for entry in FORMATS if entry.read for suffix in entry.suffixes)
WRITABLE = ", ".join(suffix for entry in FORMATS if entry.write for suffix in entry.suffixes)


def read_splats(path: str | Path, *, on_bad: Callable[[str], None] | None = None) -> SplatCloud:
    """Read a splat file of any known format, recognised by content before name.

    Args:
        path: a file with one of the `READABLE` endings, or a SOG folder.

        on_bad: called once with what was left out, in words, if some splats are bad.

    Returns:
        The cloud in the file's unit; axes as in PLY files (x right, y down, z forward), or the
        world frame if `is_in_world_frame(path)`.

    Raises:
        FormatError: no such file, or it is of no known format, truncated or damaged, or most of
            its splats are bad.
    """
    splats = read_splat_file(path)
    cloud = whole(splats)
    if splats.bad.count and on_bad is not None:
        on_bad(in_words(splats.bad, splats.count))
    return cloud


def read_splat_file(path: str | Path) -> SplatBlocks:
    """As `read_splats`, block by block; damage is found where its block is read."""
    source = Path(path)
    try:
        found = _format_of(source)
        if found.read is None:
            raise refusal(source, "", f"{found.name} is written only", f"give one of {READABLE}")
        splats = found.read(source)
    except OSError as error:
        raise _unreadable(source, error) from None
    return replace(splats, blocks=_readable(source, splats.blocks))


def write_splats(path: str | Path, cloud: SplatCloud) -> int:
    """Write a splat file; the ending of its name decides the format. Atomic.

    Returns:
        The size of the file in bytes.

    Raises:
        FormatError: the ending is unknown or of a read-only format, or the values do not fit it.
        WriteError: the disk is full or the folder is not writable; nothing is left behind.
    """
    target = Path(path)
    return require_writer(target)[1](target, in_blocks(cloud))


def require_writer(path: Path) -> tuple[SplatFormat, Write]:
    """The format of a file of this name, and its writer.

    Raises:
        FormatError: the ending is unknown or of a read-only format.
    """
    named = _format_named(path)
    if named is None or named.write is None:
        what = "an unknown ending" if named is None else f"{named.name} is read only"
        raise refusal(path, "", what, f"choose a name that ends in one of {WRITABLE}")
    return named, named.write


def require_world_writer(path: Path) -> tuple[SplatFormat, Write]:
    """As `require_writer`, for splats in the world frame (Z up), as packages have them.

    The writer turns them to the axes of the format; a PLY file says instead that they are as they
    are.

    Raises:
        FormatError: the ending is unknown or of a read-only format.
    """
    named, write = require_writer(path)
    if write is write_ply_blocks:
        return named, partial(write_ply_blocks, comments=[WORLD_COMMENT])

    def write_turned(target: Path, splats: SplatBlocks) -> int:
        file_from_world = WORLD_FROM_FORWARD_CAMERA.inverse()
        return write(target, splats.changed(lambda cloud: turned(cloud, file_from_world)))

    return named, write_turned


def is_in_world_frame(path: str | Path) -> bool:
    """Whether a file says that its splats are in the world frame (Z up), as packages do."""
    source = Path(path)
    try:
        return _format_of(source).read is read_ply_blocks and WORLD_COMMENT in ply_comments(source)
    except (FormatError, OSError):
        return False


def _format_named(path: Path) -> SplatFormat | None:
    name = path.name.lower()
    return next((f for f in FORMATS if name.endswith(f.suffixes)), None)


def _format_of(path: Path) -> SplatFormat:
    if is_sog_folder(path) or path.name == META:
        return next(f for f in FORMATS if f.read is read_sog_blocks)
    if path.is_dir():
        raise refusal(path, "", "a folder that is neither a SOG nor a scene", "check the path")
    with path.open("rb") as file:
        head = file.read(16)
    for candidate in FORMATS:
        if candidate.magic and head.startswith(candidate.magic):
            return candidate
    named = _format_named(path)
    if named is None:
        raise refusal(path, "byte 0", "not a splat file", f"give one of {READABLE}")
    return named


def _readable(path: Path, blocks: Iterator[SplatCloud]) -> Iterator[SplatCloud]:
    try:
        yield from blocks
    except OSError as error:
        raise _unreadable(path, error) from None


def _unreadable(path: Path, error: OSError) -> FormatError:
    return refusal(path, "", error.strerror or str(error), "check the path")
