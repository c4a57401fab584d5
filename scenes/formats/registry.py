"""Which splat formats there are, and reading and writing by content and file name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from scenes.formats.error import FormatError, refusal
from scenes.formats.ply import WORLD_COMMENT, ply_comments, read_ply, write_ply
from scenes.formats.sog import META, is_sog_folder, read_sog
from scenes.formats.splat import read_splat, write_splat
from scenes.formats.spz import read_spz, write_spz
from scenes.splats import SplatCloud


@dataclass(frozen=True, slots=True)
class SplatFormat:
    """A splat file format.

    Attributes:
        name: as people call it.
        suffixes: file name endings, lower case.
        magic: beginnings of such a file; empty if it has none.
        read: reads a file, axes x right, y down, z forward unless the file says otherwise.
        write: writes a file and returns its size in bytes, or None if the format is read only.
    """

    name: str
    suffixes: tuple[str, ...]
    magic: tuple[bytes, ...]
    read: Callable[[Path], SplatCloud]
    write: Callable[[Path, SplatCloud], int] | None


FORMATS = (
    SplatFormat("compressed PLY", (".compressed.ply",), (), read_ply, None),
    SplatFormat("PLY", (".ply",), (b"ply",), read_ply, write_ply),
    SplatFormat("SPZ", (".spz",), (b"NGSP", b"\x1f\x8b"), read_spz, write_spz),
    SplatFormat("SOG", (".sog",), (b"PK\x03\x04",), read_sog, None),
    SplatFormat("splat", (".splat",), (), read_splat, write_splat),
)
"""Longer suffixes come first."""


def read_splats(path: str | Path) -> SplatCloud:
    """Read a splat file of any known format, told apart by content before name.

    Args:
        path: a `.ply` (plain or compressed), `.splat`, `.spz` or `.sog` file, or a SOG folder.

    Returns:
        The cloud in the file's unit; axes as in PLY files (x right, y down, z forward), or the
        world frame if `is_in_world_frame(path)`.

    Raises:
        FormatError: no such file, or it is of no known format, truncated or damaged.
    """
    source = Path(path)
    try:
        return _format_of(source).read(source)
    except OSError as error:
        raise refusal(source, "", error.strerror or str(error), "check the path") from None


def write_splats(path: str | Path, cloud: SplatCloud) -> int:
    """Write a splat file; the ending of its name decides the format. Atomic.

    Returns:
        The size of the file in bytes.

    Raises:
        FormatError: the ending is unknown or of a read-only format, or the values do not fit it.
        WriteError: the disk is full or the folder is not writable; nothing is left behind.
    """
    target = Path(path)
    return require_writer(target)(target, cloud)


def require_writer(path: Path) -> Callable[[Path, SplatCloud], int]:
    """The writer for a file of this name.

    Raises:
        FormatError: the ending is unknown or of a read-only format.
    """
    named = _format_named(path)
    if named is None or named.write is None:
        writable = ", ".join(s for f in FORMATS if f.write for s in f.suffixes)
        what = "an unknown ending" if named is None else f"{named.name} is read only"
        raise refusal(path, "", what, f"choose a name that ends in one of {writable}")
    return named.write


def is_in_world_frame(path: str | Path) -> bool:
    """Whether a file says that its splats are in the world frame (Z up), as packages do."""
    source = Path(path)
    try:
        return _format_of(source).read is read_ply and WORLD_COMMENT in ply_comments(source)
    except (FormatError, OSError):
        return False


def _format_named(path: Path) -> SplatFormat | None:
    name = path.name.lower()
    return next((f for f in FORMATS if name.endswith(f.suffixes)), None)


def _format_of(path: Path) -> SplatFormat:
    if is_sog_folder(path) or path.name == META:
        return next(f for f in FORMATS if f.read is read_sog)
    if path.is_dir():
        raise refusal(path, "", "a folder that is neither a SOG nor a scene", "check the path")
    with path.open("rb") as file:
        head = file.read(16)
    for candidate in FORMATS:
        if candidate.magic and head.startswith(candidate.magic):
            return candidate
    named = _format_named(path)
    if named is None:
        known = ", ".join(s for f in FORMATS for s in f.suffixes)
        raise refusal(path, "byte 0", "not a splat file", f"give one of {known}")
    return named
