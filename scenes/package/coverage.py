"""Coverage of objects in a scene package: sides in their records, splats in files beside them.

The file `splats/objects/ID.seen` holds 8 bytes a splat, the directions from which it was seen, and
after those 4 bytes a splat, its weight in all photos; little end first, splats in the object's
order. It is optional: packages that were saved before there was one have none.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from scenes.coverage.record import Coverage
from scenes.coverage.sides import SIDES
from scenes.formats.storage.atomic import write_file
from scenes.package.files import PackageError

SUFFIX = ".seen"
"""Of the file of an object's splats."""

DIRECTIONS, WEIGHT = np.dtype("<u8"), np.dtype("<f4")
"""Types of a splat's two values in a file."""

_WORD = re.compile(r"[0-9a-f]{16}")
"""The cells of one side."""


def sides_to_json(coverage: Coverage) -> dict[str, str]:
    """The seen cells of each side, 64 bits in 16 hexadecimal digits."""
    return {side: f"{int(word):016x}" for side, word in zip(SIDES, coverage.sides, strict=True)}


def sides_from_json(values: object) -> NDArray[np.uint64]:
    """Inverse of `sides_to_json`.

    Raises:
        ValueError: a side is missing, or not of 16 hexadecimal digits.
    """
    known = cast("dict[str, object]", values) if isinstance(values, dict) else {}
    if sorted(known) != sorted(SIDES):
        raise ValueError(f"seen_sides {values!r:.80}: wanted the sides {', '.join(SIDES)}")
    words = [str(known[side]) for side in SIDES]
    if not all(_WORD.fullmatch(word) for word in words):
        raise ValueError(f"seen_sides {words!r:.80}: wanted 16 hexadecimal digits of each")
    return np.array([int(word, 16) for word in words], dtype=np.uint64)


def write_coverage(path: Path, coverage: Coverage) -> None:
    """Write the directions and weights of all splats.

    Raises:
        WriteError: the disk is full or the place not writable.
    """
    parts = (coverage.directions.astype(DIRECTIONS), coverage.weights.astype(WEIGHT))
    write_file(path, [part.tobytes() for part in parts])


def read_coverage(path: Path, values: Mapping[str, Any], *, splats: int) -> Coverage:
    """Inverse of `write_coverage`, with the sides of the object's record.

    Args:
        path: of the file.
        values: the object's record.
        splats: number of the object's splats.

    Raises:
        PackageError: the file has another size, or values that no photo gives.
        KeyError, ValueError: the record has no sides, or others.
    """
    raw = path.read_bytes()
    wanted = splats * (DIRECTIONS.itemsize + WEIGHT.itemsize)
    if len(raw) != wanted:
        raise PackageError(
            f"{path}: {len(raw)} bytes, wanted {wanted} for {splats} splats; restore the folder "
            "from a copy"
        )
    directions = np.frombuffer(raw, DIRECTIONS, splats)
    weights = np.frombuffer(raw, WEIGHT, splats, offset=splats * DIRECTIONS.itemsize)
    return Coverage(
        directions.astype(np.uint64),
        weights.astype(np.float32),
        sides_from_json(values["seen_sides"]),
    )
