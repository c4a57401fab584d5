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
from scenes.package.coverage import SUFFIX, read_coverage, sides_to_json, write_coverage
from scenes.package.files import PackageError, inside, read_items, text, write_items
from scenes.splats import SplatCloud

CUTS = "cuts.json"
FILES = ("splats", "places")
"""Fields of every cut that name files."""
OF_REFINED = ("replaced", "replaced_seen")
"""Fields of a refinement that do."""
_PLACE = np.dtype("<u4")
_STRAY = np.uint32(1 << 31)
"""Set in the place of a splat that is no part of the object."""


def write_cuts(part: Path, cuts: Sequence[Cut]) -> None:
    """Write `cuts.json`, and two files a cut: its splats, and the places they were taken from.

    Of a refined object a third has the splats that it had before, and a fourth their coverage.
    """
    (part / "cuts").mkdir()
    records = []
    for number, cut in enumerate(cuts):
        splats, places = f"cuts/{number:03d}.ply", f"cuts/{number:03d}.places"
        write_ply(part / splats, cut.taken, comments=[WORLD_COMMENT])
        marked = np.where(cut.is_object, cut.places, cut.places | _STRAY).astype(_PLACE)
        write_file(part / places, [marked.tobytes()])
        record: dict[str, Any] = {"object": cut.object_id, "splats": splats, "places": places}
        record["filled"] = cut.filled
        if cut.replaced is not None:
            record["replaced"] = f"cuts/{number:03d}-replaced.ply"
            write_ply(part / record["replaced"], cut.replaced)
        if cut.replaced_coverage is not None:
            record["replaced_seen"] = f"cuts/{number:03d}-replaced{SUFFIX}"
            record["seen_sides"] = sides_to_json(cut.replaced_coverage)
            write_coverage(part / record["replaced_seen"], cut.replaced_coverage)
        records.append(record)
    write_items(part / CUTS, records)


def read_cuts(source: Path, files: Mapping[str, Any]) -> tuple[Cut, ...]:
    """Inverse of `write_cuts`.

    Raises:
        PackageError: a file is not listed or damaged.
        KeyError, TypeError, ValueError: a field is missing or has a value that no cut can have.
    """
    cuts = []
    for values in read_items(source / CUTS):
        keys = [*FILES, *(key for key in OF_REFINED if key in values)]
        names = {key: text(values[key], f"{CUTS}: {key}") for key in keys}
        for name in names.values():
            if name not in files:
                raise PackageError(f"{source / CUTS}: {name} is not listed; damaged")
        taken = _read_splats(source, names["splats"])
        places = _read_places(inside(source / CUTS, names["places"]))
        filled = values["filled"]
        if not isinstance(filled, int) or isinstance(filled, bool):
            raise PackageError(f"{source / CUTS}: filled {filled!r}, wanted a whole number")
        replaced = _read_splats(source, names["replaced"]) if "replaced" in names else None
        coverage = None
        if replaced is not None and "replaced_seen" in names:
            seen = inside(source / CUTS, names["replaced_seen"])
            coverage = read_coverage(seen, values, splats=len(replaced))
        cuts.append(
            Cut(
                text(values["object"], "object"),
                places & ~_STRAY,
                taken,
                (places & _STRAY) == 0,
                filled,
                replaced,
                coverage,
            )
        )
    return tuple(cuts)


def _read_splats(source: Path, name: str) -> SplatCloud:
    try:
        return read_ply(inside(source / CUTS, name))
    except FormatError as error:
        raise PackageError(str(error)) from None


def _read_places(path: Path) -> NDArray[np.uint32]:
    raw = path.read_bytes()
    if len(raw) % _PLACE.itemsize:
        raise PackageError(f"{path}: {len(raw)} bytes, wanted whole places of 4; damaged")
    return np.frombuffer(raw, dtype=_PLACE).astype(np.uint32)
