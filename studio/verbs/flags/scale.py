"""Flags that give the scale of photos: printed codes, a length, a known object."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from scenes.prepare.options import KnownLength, KnownObject

MIN_SIDE_M, MAX_SIDE_M = 0.005, 5.0


def add_scale_flags(group: argparse._ArgumentGroup, *, without: str) -> None:
    """`--qr-size`, `--length` and `--end`.

    Args:
        group: gets the flags.
        without: what happens if none of them is given, as a sentence without its full stop.
    """
    group.add_argument(
        "--qr-size",
        type=_sides,
        metavar="M",
        help="printed side of the codes in metres, without the white border; "
        f"or CODE=M,CODE=M where they differ. {without}",
    )
    group.add_argument(
        "--length",
        type=float,
        metavar="M",
        help="a length measured there, where no code is; --end says between what",
    )
    group.add_argument(
        "--end",
        nargs=4,
        action="append",
        metavar=("WHICH", "PHOTO", "X", "Y"),
        help="pixel of one end of the length (a or b) in a photo; two photos or more for each end",
    )


def add_object_flags(group: argparse._ArgumentGroup) -> None:
    """`--known-object` and `--object-box`."""
    group.add_argument(
        "--known-object",
        metavar="SIZE",
        help="an object in the room whose size is known, where no code is: W,D,H in metres of "
        "something box-shaped, or SCENE:ID of an object that was cut out earlier",
    )
    group.add_argument(
        "--object-box",
        nargs=5,
        action="append",
        default=[],
        metavar=("PHOTO", "X0", "Y0", "X1", "Y1"),
        help="a box in pixels close around that object; two photos or more, from different sides",
    )


def known_object(text: str | None, boxes: Sequence[Sequence[str]]) -> KnownObject | None:
    """The known object with its boxes in photos.

    Raises:
        ValueError: only one of both flags is given, or one of them cannot be read.
        PackageError: the scene it comes from cannot be opened.
    """
    from scenes.prepare.options import KnownObject

    if text is None and not boxes:
        return None
    if text is None or not boxes:
        raise ValueError(
            "--known-object and --object-box belong together: its size, and where photos show it"
        )
    boxes_px: dict[str, tuple[float, float, float, float]] = {}
    for photo, *words in boxes:
        try:
            left, top, right, bottom = (float(word) for word in words)
        except ValueError:
            left = right = top = bottom = 0.0
        if not (left < right and top < bottom) or photo in boxes_px:
            raise ValueError(
                f"--object-box {photo} {' '.join(words)}: wanted one box a photo, left < right and "
                "top < bottom in pixels"
            )
        boxes_px[photo] = (left, top, right, bottom)
    return KnownObject(_known_points(text), boxes_px)


def _known_points(text: str) -> NDArray[np.float64]:
    """(N, 3) corners of `W,D,H`, or what spans the object `SCENE:ID`."""
    from scenes.opening import open_scene
    from scenes.prepare.align.by_object import box_corners, spanning_points

    scene, _, object_id = text.rpartition(":")
    if scene:
        try:
            return spanning_points(open_scene(scene).object_by_id(object_id))
        except KeyError as error:
            raise ValueError(f"--known-object {text}: {error.args[0]}") from None
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        x = y = z = 0.0
    if not (min(x, y, z) >= 0.01 and max(x, y, z) <= 20.0):
        raise ValueError(
            f"--known-object {text!r}: wanted width, depth, height in metres such as 0.6,0.4,0.75, "
            "or SCENE:ID"
        )
    return box_corners((x, y, z))


def known_length(length_m: float | None, ends: Sequence[Sequence[str]]) -> KnownLength | None:
    """The measured length with its ends in photos.

    Raises:
        ValueError: an end is neither a nor b or has no pixel, or only one of both flags is given.
    """
    from scenes.prepare.options import KnownLength

    if length_m is None and not ends:
        return None
    if length_m is None or not ends:
        raise ValueError("--length and --end belong together: metres, and the pixels of both ends")
    picks: dict[str, dict[str, tuple[float, float]]] = {"a": {}, "b": {}}
    for which, photo, x, y in ends:
        try:
            picks[which.lower()][photo] = (float(x), float(y))
        except (KeyError, ValueError):
            raise ValueError(
                f"--end {which} {photo} {x} {y}: wanted a or b, a photo's name and two numbers"
            ) from None
    return KnownLength(length_m, picks["a"], picks["b"])


def _sides(text: str) -> float | Mapping[str, float]:
    """`0.2`, or `CODE=0.2,OTHER=0.16`."""
    try:
        if "=" not in text:
            return _side(text)
        pairs = [part.rpartition("=") for part in text.split(",")]
        return {payload.strip(): _side(side) for payload, _, side in pairs}
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"{text!r}: wanted metres such as 0.2, or CODE=0.2,OTHER=0.16"
        ) from None


def _side(text: str) -> float:
    side_m = float(text)
    if not MIN_SIDE_M <= side_m <= MAX_SIDE_M:
        raise argparse.ArgumentTypeError(
            f"{text}: a code's side in metres, wanted {MIN_SIDE_M} to {MAX_SIDE_M}"
        )
    return side_m
