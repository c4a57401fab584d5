# pyright: standard
"""The files of a scene package: JSON, sizes, checksums, and names that stay inside."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path, PurePosixPath
from typing import Any

from scenes.formats.storage.atomic import write_file

MAX_JSON_BYTES = 64 * 2**20
"""Limit of a JSON file that is read."""
MAX_NUMBER = 1e6
"""No number in a package is larger: rooms are measured in metres."""


class PackageError(ValueError):
    """A scene is missing, foreign, damaged or made by a newer program."""


def verify_files(listing: Path, files: object, required: set[str]) -> None:
    """Check that every listed file is inside the package, of the right size and content.

    Args:
        listing: the file that holds the list; its folder is the package.
        files: the list as read: `{"bytes", "sha256"}` by POSIX name.
        required: names that must be listed.

    Raises:
        PackageError: names the first file that fails, and how.
    """
    if not isinstance(files, dict):
        raise PackageError(f"{listing}: no list of files; restore the folder from a copy")
    missing = required - files.keys()
    if missing:
        raise PackageError(
            f"{listing}: does not list {', '.join(sorted(missing))}; restore the folder from a copy"
        )
    for name, wanted in files.items():
        path = inside(listing, name)
        if not path.is_file():
            raise PackageError(f"{path}: missing; restore the folder from a copy")
        size = path.stat().st_size
        if not isinstance(wanted, dict) or size != wanted.get("bytes"):
            raise PackageError(
                f"{path}: {size} bytes, {listing.name} says {wanted!r:.120}; "
                "the file is truncated or was changed, restore the folder from a copy"
            )
        if fingerprint(path)["sha256"] != wanted.get("sha256"):
            raise PackageError(
                f"{path}: checksum differs from {listing.name}; "
                "the file is damaged or was changed, restore the folder from a copy"
            )


def inside(listing: Path, name: str) -> Path:
    """The file `name` beside `listing`.

    Raises:
        PackageError: the name, or a link on the way, leads out of the folder.
    """
    pure = PurePosixPath(name)
    plain = not pure.is_absolute() and ".." not in pure.parts and not set(name) & set("\\:\0")
    if not plain or not (listing.parent / pure).resolve().is_relative_to(listing.parent.resolve()):
        raise PackageError(
            f"{listing}: file name {name!r} leads out of the folder; do not trust this package"
        )
    return listing.parent / pure


def fingerprint(path: Path) -> dict[str, Any]:
    """Size in bytes and SHA-256 of a file."""
    with path.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    return {"bytes": path.stat().st_size, "sha256": digest}


def read_json(path: Path) -> dict[str, Any]:
    """The JSON object in a file.

    Raises:
        PackageError: the file is missing, too large, or no JSON object.
    """
    try:
        if path.stat().st_size > MAX_JSON_BYTES:
            raise PackageError(
                f"{path}: {path.stat().st_size} bytes, limit {MAX_JSON_BYTES}; not a scene package"
            )
        values = json.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, UnicodeDecodeError, json.JSONDecodeError, RecursionError) as error:
        raise PackageError(f"{path}: {error}; restore the folder from a copy") from None
    if not isinstance(values, dict):
        raise PackageError(f"{path}: wanted a JSON object; restore the folder from a copy")
    return values


def read_items(path: Path) -> list[Mapping[str, Any]]:
    """The list of JSON objects that `write_items` wrote.

    Raises:
        PackageError: the file holds something else.
    """
    items = read_json(path).get("items")
    if not isinstance(items, list) or not all(isinstance(item, dict) for item in items):
        raise PackageError(f"{path}: wanted a list of objects; restore the folder from a copy")
    return items


def write_json(path: Path, values: Mapping[str, Any]) -> None:
    """Write a JSON object, indented.

    Raises:
        WriteError: the disk is full or the place not writable.
        ValueError: a number is not finite.
    """
    text = json.dumps(values, indent=2, ensure_ascii=False, allow_nan=False)
    write_file(path, [(text + "\n").encode()])


def write_items(path: Path, items: Sequence[Mapping[str, Any]]) -> None:
    """Write a list of JSON objects; as `write_json` otherwise."""
    write_json(path, {"items": list(items)})


def numbers(values: object, count: int, what: str, *, least: float = -MAX_NUMBER) -> list[float]:
    """`count` numbers out of a JSON file, from `least` to `MAX_NUMBER`.

    Raises:
        ValueError: names `what`, the values and what there should be.
    """
    found = values if isinstance(values, list) else []
    fit = [
        float(value)
        for value in found
        if isinstance(value, int | float)
        and not isinstance(value, bool)
        and least <= value <= MAX_NUMBER
    ]
    if len(fit) != count or len(found) != count:
        raise ValueError(
            f"{what} {values!r:.80}: wanted {count} numbers from {least:g} to {MAX_NUMBER:g}"
        )
    return fit


def text(value: object, what: str) -> str:
    """A string out of a JSON file.

    Raises:
        ValueError: names `what` and what it is instead.
    """
    if not isinstance(value, str):
        raise ValueError(f"{what} {value!r:.80}: wanted a text")  # noqa: TRY004 (bad data, not a bug)
    return value
