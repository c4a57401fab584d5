# pyright: standard
"""Cuts in a scene package: what was taken, bit for bit, and from which places."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenes.cut import Cut
from scenes.formats.ply import WORLD_COMMENT, read_ply, write_ply
from scenes.formats.storage.atomic import write_file
from scenes.formats.storage.error import FormatError
from scenes.package.files import PackageError, inside, read_items, text, write_items

CUTS = "cuts.json"
_PLACE = np.dtype("<u4")
_STRAY = np.uint32(1 << 31)
"""Set in the place of a splat that is no part of the object."""


def write_cuts(part: Path, cuts: Sequence[Cut]) -> None:
    """Write `cuts.json`, and two files a cut: its splats, and the places they were taken from."""
    (part / "cuts").mkdir()
    records = []
    for number, cut in enumerate(cuts):
        splats, places = f"cuts/{number:03d}.ply", f"cuts/{number:03d}.places"
        write_ply(part / splats, cut.taken, comments=[WORLD_COMMENT])
        marked = np.where(cut.is_object, cut.places, cut.places | _STRAY).astype(_PLACE)
        write_file(part / places, [marked.tobytes()])
        records.append(
            {"object": cut.object_id, "splats": splats, "places": places, "filled": cut.filled}
        )
    write_items(part / CUTS, records)


def read_cuts(source: Path, files: Mapping[str, Any]) -> tuple[Cut, ...]:
    """Inverse of `write_cuts`.

    Raises:
        PackageError: a file is not listed or damaged.
        KeyError, TypeError, ValueError: a field is missing or has a value that no cut can have.
    """
    cuts = []
    for values in read_items(source / CUTS):
        names = [text(values[key], f"{CUTS}: {key}") for key in ("splats", "places")]
        for name in names:
            if name not in files:
                raise PackageError(f"{source / CUTS}: {name} is not listed; damaged")
        try:
            taken = read_ply(inside(source / CUTS, names[0]))
        except FormatError as error:
            raise PackageError(str(error)) from None
        places = _read_places(inside(source / CUTS, names[1]))
        filled = values["filled"]
        if not isinstance(filled, int) or isinstance(filled, bool):
            raise PackageError(f"{source / CUTS}: filled {filled!r}, wanted a whole number")
        cuts.append(
            Cut(
                text(values["object"], "object"),
                places & ~_STRAY,
                taken,
                (places & _STRAY) == 0,
                filled,
            )
        )
    return tuple(cuts)


def _read_places(path: Path) -> NDArray[np.uint32]:
    raw = path.read_bytes()
    if len(raw) % _PLACE.itemsize:
        raise PackageError(f"{path}: {len(raw)} bytes, wanted whole places of 4; damaged")
    return np.frombuffer(raw, dtype=_PLACE).astype(np.uint32)
