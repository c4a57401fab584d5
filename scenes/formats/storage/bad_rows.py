"""Splats that no scan can have: left out and counted, refused only where most of a file is so."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from scenes.formats.storage.blocks import BadRows, SplatBlocks, whole
from scenes.formats.storage.error import refusal
from scenes.splats import SplatCloud, faults

MAX_BAD_SHARE = 0.5
"""Of a file's splats. Trainers that diverge leave a few bad rows; a file that is bad throughout is
of another layout, or damaged."""


class CountError(ValueError):
    """Fewer splats came than were announced.

    Attributes:
        count: how many came.
    """

    def __init__(self, count: int) -> None:
        super().__init__(f"{count} splats came, fewer than were announced")
        self.count = count


def without_bad_rows(path: Path, splats: SplatBlocks) -> SplatBlocks:
    """The same blocks without splats whose values no scan can have, which `bad` counts.

    The iteration raises `FormatError` at its end if more than `MAX_BAD_SHARE` were left out.
    """
    return replace(splats, blocks=_sound(path, splats))


def intact(path: Path, splats: SplatBlocks) -> SplatCloud:
    """All blocks as one cloud, of a file that was written here: every splat counts.

    Raises:
        FormatError: the file is damaged, or one of its splats is bad.
    """
    cloud = whole(splats)
    if splats.bad.count:
        raise refusal(path, "", in_words(splats.bad, splats.count), "export the file again")
    return cloud


def in_words(bad: BadRows, count: int) -> str:
    """How many of a file's splats were left out, and why."""
    if not bad.count:
        return ""
    return f"{bad.count:,} of {count:,} splats are damaged and left out (the first is {bad.first})"


def all_announced(splats: SplatBlocks) -> SplatBlocks:
    """The same blocks, for writers that state the number first.

    The iteration raises `CountError` at its end if bad splats were left out.
    """
    return replace(splats, blocks=_announce(splats))


def _sound(path: Path, splats: SplatBlocks) -> Iterator[SplatCloud]:
    start = 0
    for cloud in splats.blocks:
        bad = np.zeros(len(cloud), dtype=np.bool_)
        for fault in faults(cloud):
            if fault.bad.any():
                splats.bad.first = splats.bad.first or fault.first(start)
                bad |= fault.bad
        splats.bad.count += int(bad.sum())
        start += len(cloud)
        yield cloud.select(~bad) if bad.any() else cloud
    if splats.bad.count > MAX_BAD_SHARE * splats.count:
        raise refusal(
            path,
            "",
            f"{splats.bad.count:,} of {splats.count:,} splats are damaged (the first is "
            f"{splats.bad.first}), at most {MAX_BAD_SHARE:.0%} may be",
            "export the file again",
        )


def _announce(splats: SplatBlocks) -> Iterator[SplatCloud]:
    count = 0
    for cloud in splats.blocks:
        count += len(cloud)
        yield cloud
    if count != splats.count:
        raise CountError(count)
