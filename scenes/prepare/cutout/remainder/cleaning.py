"""Splats that a hand has marked in views of a room, and their removal as a cut."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cut import divide
from scenes.package import ScenePackage
from scenes.package.records import Stage
from scenes.prepare.cutout.marks.masked_view import MaskedView
from scenes.prepare.cutout.remainder.floaters import FLOATERS
from scenes.prepare.cutout.votes.lifting import Vote, lift
from scenes.render.native import NativeRenderer
from scenes.splats import SplatCloud

MOSTLY = 0.5
"""Share of a splat's light inside a mark from which on it is meant."""
RING_PX = 7
"""Width of what is looked at around a mark: a pen's shake, pixels."""
NEAREST_SHARE = 10.0
"""Percentile of the depth around a mark that counts as the room's: stray splats are there, too."""
MARGIN_M = 0.03
"""How much nearer than that a splat has to be to hang before the room, as splats stick out."""


def marked_splats(
    room: SplatCloud, views: Sequence[MaskedView], *, renderer: NativeRenderer
) -> NDArray[np.bool_]:
    """(N,) which of a room's splats are meant by marks in one or more views.

    In several views those are meant that lie in every mark, and are seen in one of them. In one
    view a mark holds all that is behind it, too: those are meant that hang before what is around
    the mark.
    """
    votes = [lift(room, view, renderer=renderer) for view in views]
    inside = np.zeros(len(room), dtype=bool)
    for vote in votes:
        inside |= vote.inside > MOSTLY * vote.seen
    for view, vote in zip(views, votes, strict=True):
        depth, is_marked = _in_mark(room, view)
        inside &= is_marked
        if len(views) == 1:
            inside &= depth < _room_depth(view, vote) - MARGIN_M
    return inside


def remove_marked(
    package: ScenePackage, views: Sequence[MaskedView], *, renderer: NativeRenderer
) -> tuple[ScenePackage, int]:
    """The package without what is marked, and how many splats that were.

    `scenes.prepare.cutout.cutout.undo_cut` puts them back.

    Raises:
        ValueError: nothing is meant by the marks; says how to mark it.
    """
    gone = marked_splats(package.room, views, renderer=renderer)
    if not gone.any():
        remedy = (
            "nothing in the mark hangs before the room; mark it in a second view, from a side"
            if len(views) == 1
            else "no splat lies in all of the marks; mark the same thing in each view"
        )
        raise ValueError(f"{package.name}: {remedy}")
    room, cut = divide(package.room, np.zeros_like(gone), object_id="", floaters=gone)
    stage = Stage(f"cut {FLOATERS}", f"{len(cut.taken)} splats removed that were marked by hand")
    changed = replace(
        package, room=room, cuts=(*package.cuts, cut), stages=(*package.stages, stage)
    )
    return changed, len(cut.taken)


def _in_mark(room: SplatCloud, view: MaskedView) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """(N,) depth of the splats' middles along z, metres, and whether they are in the mark."""
    local = view.world_from_camera.inverse() @ room.means.astype(np.float64)
    pixels, is_seen = view.camera.project(local)
    height, width = view.mask.shape
    # Where a pixel is none (NaN), it is not seen either.
    whole = np.nan_to_num(pixels, nan=-1.0, posinf=-1.0, neginf=-1.0)
    column, row = np.floor(np.clip(whole, -1.0, max(width, height))).astype(np.int64).T
    is_in = is_seen & (column >= 0) & (column < width) & (row >= 0) & (row < height)
    found = np.zeros(len(room), dtype=bool)
    found[is_in] = view.mask[row[is_in], column[is_in]]
    return local[:, 2], found


def _room_depth(view: MaskedView, vote: Vote) -> float:
    """Depth of the room around a mark, metres; infinite where nothing is around it."""
    side = 2 * RING_PX + 1
    wider = cv2.dilate(view.mask.astype(np.uint8), np.ones((side, side), np.uint8)) > 0
    around = vote.depth[wider & ~view.mask]
    if not len(around):
        return float("inf")
    open_air = np.where(around > 0, around, np.inf)
    return float(np.percentile(open_air, NEAREST_SHARE, method="lower"))
