"""Bodies of labelled cells that end: what is left of a label where it runs on into the room."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scenes.prepare.cells import nearest
from scenes.prepare.cutout.connected_bodies import bodies
from scenes.prepare.cutout.labelling.graph_cut import Links
from scenes.prepare.cutout.labelling.surface_cells import SurfaceCells

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

GAP = 3.0
"""Cells farther apart than so many sides belong to different bodies."""

TOUCHING = 0.05
"""Links to the outside for a cell of a body: with more it goes on there."""

SPECK = 0.003
"""Of the main body's cells: a smaller body is a speck. A chair's foot seen alone is ten times as
large."""


def ending_bodies(
    cells: SurfaceCells,
    labels: BoolArray,
    *,
    meant: FloatArray,
    inside: BoolArray,
    links: Links,
    beside: float,
) -> tuple[BoolArray, float]:
    """The body that is meant and those beside it that end; and its links to the outside per cell.

    Args:
        cells: around the object.
        labels: (N,) labelled ones, at least one of which is meant.
        meant: (N,) how much a cell is; the body with most of it is the main one, and one that ends
            rather than one that goes on. Another that is meant less than nothing is left out.
        inside: (N,) where the object may be.
        links: between cells.
        beside: of the main body's size: how far beside it another may be a part of it.
    """
    chosen = np.flatnonzero(labels)
    count, body = bodies(cells.places[chosen], GAP * cells.side_m)
    body_of = np.full(len(cells), -1)
    body_of[chosen] = body
    first, second, _ = links
    ends = np.concatenate([first, second]), np.concatenate([second, first])
    leaves = (body_of[ends[0]] >= 0) & ~inside[ends[1]]
    size = np.bincount(body, minlength=count)
    openness = np.bincount(body_of[ends[0][leaves]], minlength=count) / size
    weight = np.bincount(body, weights=meant[chosen], minlength=count)
    main = int(np.argmax(weight / (1.0 + openness / TOUCHING)))
    own = cells.places[chosen[body == main]]
    to_main, _ = nearest(cells.places[chosen], own)
    apart = np.full(count, np.inf)
    np.minimum.at(apart, body, to_main[:, 0])
    reach = beside * float(np.ptp(own, axis=0).max())
    kept = (openness < TOUCHING) & (apart <= reach) & (size >= SPECK * size[main]) & (weight >= 0)
    kept[main] = True
    found = np.zeros_like(labels)
    found[chosen] = kept[body]
    return found, float(openness[main])
