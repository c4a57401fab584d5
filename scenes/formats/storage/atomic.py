"""Files and folders that appear whole or not at all."""

from __future__ import annotations

import errno
import os
import re
import secrets
import shutil
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path


class WriteError(OSError):
    """Something could not be written; nothing of it is left behind."""


def write_whole(
    path: Path,
    content: str | Iterable[bytes | memoryview],
    *,
    makes_folder: bool = False,
    is_private: bool = False,
) -> int:
    """Write a file by a temporary sibling that is synced and renamed; return its size in bytes.

    Args:
        path: the file to make or replace.
        content: its text, or its bytes in blocks, in order. They may be produced lazily.
        makes_folder: whether its folder is made where there is none.
        is_private: whether the user alone may read it, from its first byte on.

    Raises:
        OSError: as the system gives it. `path` is as it was, and nothing is left beside it.
    """
    if makes_folder:
        path.parent.mkdir(parents=True, exist_ok=True)
    part = _sibling(path, "part")
    try:
        blocks = [content.encode()] if isinstance(content, str) else content
        size = _write_synced(part, blocks, is_private=is_private)
        part.replace(path)
        _sync_folder(path.parent)
    finally:
        with suppress(OSError):
            part.unlink()
    return size


def name_when_whole(name: str) -> str:
    """Return the name that a temporary sibling gets once it is whole; any other name as it is."""
    found = re.fullmatch(r"\.(.+)\.[0-9a-f]{8}\.(?:part|old)", name)
    return name if found is None else found[1]


def write_file(path: Path, blocks: Iterable[bytes | memoryview]) -> int:
    """Write a file as `write_whole`, and say what to do where that fails.

    Args:
        path: the file to make or replace.
        blocks: its contents, in order. They may be produced lazily.

    Returns:
        The number of bytes written.

    Raises:
        WriteError: the disk is full, the folder is missing or not writable. `path` is as it was.
    """
    try:
        return write_whole(path, blocks)
    except OSError as error:
        raise _write_error(path, error) from error


def write_folder(folder: Path, fill: Callable[[Path], None], *, replace: bool) -> None:
    """Fill a temporary sibling folder, sync it and rename it to `folder`.

    An existing folder is moved aside before the rename and deleted after it, so a crash in between
    leaves it under a hidden name ending in `.old`.

    Args:
        folder: the folder to make or replace.
        fill: writes the contents into the folder it is given.
        replace: whether an existing folder may be replaced. If not, and one appears while this one
            is being filled (another process was faster), that one stays and this one is dropped.

    Raises:
        WriteError: the disk is full or a folder is not writable. `folder` is as it was.
    """
    target = folder.resolve()
    part, old = _sibling(target, "part"), _sibling(target, "old")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        part.mkdir()
        fill(part)
        _sync_tree(part)
        if replace and target.exists():
            target.rename(old)
        try:
            part.rename(target)
        except OSError:
            if old.exists():
                old.rename(target)
            elif not replace and target.is_dir():
                return
            raise
        _sync_folder(target.parent)
    except WriteError as error:
        raise WriteError(str(error).replace(str(part), str(folder))) from error
    except OSError as error:
        raise _write_error(folder, error) from error
    finally:
        shutil.rmtree(part, ignore_errors=True)
        shutil.rmtree(old, ignore_errors=True)


def _sibling(path: Path, suffix: str) -> Path:
    return path.with_name(f".{path.name}.{secrets.token_hex(4)}.{suffix}")


def _write_synced(
    path: Path, blocks: Iterable[bytes | memoryview], *, is_private: bool = False
) -> int:
    size = 0
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)
    with os.fdopen(os.open(path, flags, 0o600 if is_private else 0o666), "wb") as file:
        for block in blocks:
            size += file.write(block)
        file.flush()
        os.fsync(file.fileno())
    return size


def _sync_tree(folder: Path) -> None:
    for inner in folder.rglob("*"):
        if inner.is_dir():
            _sync_folder(inner)
    _sync_folder(folder)


def _sync_folder(folder: Path) -> None:
    # Windows has no handle for folders; the rename is durable there without it.
    with suppress(PermissionError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def _write_error(path: Path, error: OSError) -> WriteError:
    remedy = {
        errno.ENOENT: f"make the folder {path.parent} first",
        errno.ENOTDIR: f"{path.parent} is a file, choose a folder",
        errno.EACCES: "choose a folder that you may write to",
        errno.EROFS: "choose a folder that you may write to",
    }.get(error.errno or 0, "free some space there or choose another folder")
    reason = error.strerror or str(error)
    return WriteError(f"{path}: cannot write: {reason}; nothing was left behind; {remedy}")
