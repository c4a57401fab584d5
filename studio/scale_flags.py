"""Flags that tell how large things in photos are: printed codes of known size, or a length."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from scenes.prepare.options import KnownLength

LEAST_SIDE_M, MOST_SIDE_M = 0.005, 5.0


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
    if not LEAST_SIDE_M <= side_m <= MOST_SIDE_M:
        raise argparse.ArgumentTypeError(
            f"{text}: a code's side in metres, wanted {LEAST_SIDE_M} to {MOST_SIDE_M}"
        )
    return side_m
