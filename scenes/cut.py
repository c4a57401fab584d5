"""Cutting splats out of a room, as an exact partition that can be undone to the byte."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.coverage.record import Coverage
from scenes.splats import SplatCloud, concatenate


@dataclass(frozen=True, slots=True, eq=False)
class Cut:
    """Object taken out of a room, and the splats to put it back.

    Attributes:
        object_id: of the object made of it; empty if only floaters were removed.
        places: (K,) uint32 ascending places of the taken splats in the room as it was; none if the
            object came from elsewhere.
        taken: the K splats, as they were in the room.
        is_object: (K,) bool; the others are floaters, which belong to nothing now.
        filled: how many splats were added at the room's end, where the cut left a hole.
        replaced: splats that the object had before it was refined, in its own frame; None of a
            cut. Undoing a refinement puts them back and leaves the room and its places alone.
        replaced_coverage: from where photos saw those, if that was measured.

    Raises:
        ValueError: the arrays do not belong together.
    """

    object_id: str
    places: NDArray[np.uint32]
    taken: SplatCloud
    is_object: NDArray[np.bool_]
    filled: int
    replaced: SplatCloud | None = None
    replaced_coverage: Coverage | None = None

    def __post_init__(self) -> None:
        places = np.array(self.places, dtype=np.uint32)
        is_object = np.array(self.is_object, dtype=bool)
        if places.shape != (len(self.taken),) or is_object.shape != places.shape:
            raise ValueError(
                f"Cut: {len(self.taken)} splats, {places.shape} places and {is_object.shape} "
                "labels, wanted as many of each"
            )
        if (np.diff(places.astype(np.int64)) <= 0).any():
            raise ValueError("Cut.places: not ascending; wanted every place once, in order")
        if self.filled < 0:
            raise ValueError(f"Cut.filled: {self.filled}, wanted 0 or more")
        for name, array in (("places", places), ("is_object", is_object)):
            array.setflags(write=False)
            object.__setattr__(self, name, array)


def divide(
    room: SplatCloud,
    labels: NDArray[np.bool_],
    *,
    object_id: str,
    floaters: NDArray[np.bool_],
    fill: SplatCloud | None = None,
) -> tuple[SplatCloud, Cut]:
    """Take splats out of a room.

    Args:
        room: N splats.
        labels: (N,) bool, the object's.
        object_id: of the object.
        floaters: (N,) bool, to be removed with it.
        fill: put in their place, at the room's end.

    Returns:
        The room that is left, in its order, and the cut.

    Raises:
        ValueError: a label array does not fit, a splat is both, or there is nothing to take.
    """
    for name, array in (("labels", labels), ("floaters", floaters)):
        if array.shape != (len(room),) or array.dtype != np.bool_:
            raise ValueError(
                f"{name}: {array.dtype} {array.shape}, wanted bool ({len(room)},), one per splat"
            )
    if (labels & floaters).any():
        raise ValueError(f"{(labels & floaters).sum()} splats are both object and floater")
    gone = labels | floaters
    if not gone.any():
        raise ValueError("nothing to cut out: no splat is labelled")
    places = np.flatnonzero(gone)
    left = room.select(~gone)
    added = 0 if fill is None else len(fill)
    cut = Cut(object_id, places.astype(np.uint32), room.select(places), labels[places], added)
    return (left if fill is None or not added else concatenate([left, fill])), cut


def restore(room: SplatCloud, cut: Cut) -> SplatCloud:
    """The room as it was before its last cut, equal in every bit.

    Raises:
        ValueError: the cut was not the room's last.
    """
    kept = len(room) - cut.filled
    total = kept + len(cut.taken)
    if kept < 0 or (len(cut.places) and int(cut.places[-1]) >= total):
        raise ValueError(
            f"the cut of {cut.object_id or 'floaters'!r} does not fit a room of {len(room)} "
            "splats; undo later cuts first"
        )
    is_taken = np.zeros(total, dtype=bool)
    is_taken[cut.places] = True
    order = np.empty(total, dtype=np.intp)
    order[~is_taken] = np.arange(kept)
    order[is_taken] = len(room) + np.arange(len(cut.taken))
    return concatenate([room, cut.taken]).select(order)
