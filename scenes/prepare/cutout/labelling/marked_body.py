"""Finds the object that boxes, strokes and masks in a few photos mean, in a room with many photos.

Photos of the room give surface cells around what was marked (`surface_cells`). One energy over
these cells is minimised (`graph_cut`): what lies outside a box is the room, a flat patch that goes
on outside the boxes is likely the room's, a mask that shows a cell speaks for it, and so do its
colours; what does not hold together, at a crease or a step of colour, is cheap to part. From these
cells the outlines in the photos are found, and whose a splat is (`outlines`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Pinhole, pixel_centres
from scenes.package.records import ViewPoint
from scenes.pose import Pose
from scenes.prepare.cells import nearest
from scenes.prepare.cutout.labelling.cell_odds import colour_odds, going_on
from scenes.prepare.cutout.labelling.doubts import (
    Boxed,
    Labelled,
    doubts,
    require_meeting,
    require_object,
    something_else,
)
from scenes.prepare.cutout.labelling.ending_bodies import ending_bodies
from scenes.prepare.cutout.labelling.graph_cut import cut
from scenes.prepare.cutout.labelling.outlines import separated
from scenes.prepare.cutout.labelling.separate import Separation
from scenes.prepare.cutout.labelling.surface_cells import (
    SurfaceCells,
    cells_around,
    links_between,
)
from scenes.prepare.cutout.marks.masked_view import MaskedView
from scenes.prepare.cutout.votes.silhouettes import (
    DEPTH_SLACK_M,
    ViewVerdict,
    box_of,
    in_box,
    points_drawn,
)
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats
from scenes.splats import SplatCloud

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

BOX_SLACK = 0.02
"""Of a box's size: how far a cell may lie outside it, for depth that is off by a cell."""

PASSES = 3
"""Times that the place is looked at, each time as closely as what was found before allows."""

SMALLER = 0.8
"""Of the last pass's size: only an object smaller than this is looked at again."""

PRIOR = 2.0
"""Log odds that a cell which is seen inside all boxes is the object's. Measured in three rooms (19
objects): 1, 2 and 3 give an IoU of 0.818, 0.826 and 0.817."""

HIDDEN_PRIOR = 0.1
"""The same of a cell that no marked view sees: what lies behind an object is as likely the room's.
Measured: 1 instead gives 0.824."""

GOES_ON_COST = 2.0
"""Cost of taking a cell of a flat patch that goes on outside the boxes. Measured: 0.5 gives the
same."""

MASK_ODDS = 1.0
"""Log odds of a cell that a mask shows. What a mask leaves out says nothing where there is a box:
of the cells that were lost, four of five were left out by GrabCut. Measured: 2 gives the same, 0.5
both ways an IoU lower by 0.02."""

SMOOTHNESS = 2.0
"""Cost of parting two cells that hold fast, as of `closed_body`. Measured: 1 and 4 give 0.814 and
0.821."""

ROUNDS = 2
"""Cuts: the first by shape and masks, the second by the colours of what the first found, too."""

BESIDE = 0.5
"""Of the main body's size: how far beside it another part may lie that no photo shows joined.
Measured: 0.15 loses 0.02 of IoU, 1.0 loses 0.01."""

STROKE_SIDES = 2.0
"""Sides of a cell around a stroke's point that are what the stroke says."""

LEFT_OUT = 0.1
"""Weight of a body's cells that no marked view sees, when it is asked which body is meant."""


@dataclass(frozen=True, slots=True, eq=False)
class _Mark:
    """One view's marks, and the depth that the room has there."""

    view: MaskedView
    depth: NDArray[np.float32]

    def holds(self, points: FloatArray, slack: float) -> BoolArray:
        """(N,) whether world points fall into the view's box."""
        view = self.view
        return in_box(points, view.camera, view.world_from_camera, box_of(view), slack)

    def boxed(self, slack: float) -> Boxed:
        """Its box, for words about it."""
        view = self.view
        return Boxed(view.name, view.camera, view.world_from_camera, box_of(view), slack)


def marked_body(
    cloud: SplatCloud,
    views: Sequence[MaskedView],
    *,
    viewpoints: Sequence[ViewPoint],
    renderer: NativeRenderer,
) -> Separation:
    """The splats of the object that marks mean.

    Args:
        cloud: the whole room, metres, Z up.
        views: with a box, a mask or both.
        viewpoints: photos of the room, whose surfaces are fused.
        renderer: draws the room.

    Raises:
        ValueError: nothing is marked, the boxes do not meet, or no object is in them.
    """
    marks = _marks(cloud, views, renderer=renderer)
    core = _drawn_inside(marks)
    last_m = np.inf
    cells, body, other = None, None, None
    for number in range(PASSES):
        low, high = np.percentile(core, (1, 99) if number == 0 else (0, 100), axis=0)
        size_m = float((high - low).max())
        if size_m > SMALLER * last_m:
            break
        last_m = size_m
        cells = cells_around(cloud, viewpoints, core, box=(low, high), renderer=renderer)
        body = _labelled(cells, marks)
        other = something_else(cells, body) if other is None else other
        core = cells.places[body.labels]
    assert cells is not None
    assert body is not None
    labels, boxed = body.labels, [mark.boxed(BOX_SLACK) for mark in marks]
    if not any(len(view.inside_px) for view in views):
        require_object(cells, body, boxed=boxed)
    means = cloud.means.astype(np.float64)
    within = np.logical_and.reduce([mark.holds(means, BOX_SLACK) for mark in marks])
    found = separated(
        cloud,
        cells,
        labels=labels,
        inside=body.inside,
        sure=body.sure,
        within=within,
        renderer=renderer,
    )
    shown = {mark.view.name: _verdict(mark, found.own) for mark in marks}
    verdicts = tuple(shown.get(view.name, ViewVerdict(view.name, 0.0, False)) for view in views)
    notes = doubts(cells, body, boxed=boxed, other=other)
    return replace(found, views=verdicts, notes=notes)


def _marks(
    cloud: SplatCloud, views: Sequence[MaskedView], *, renderer: NativeRenderer
) -> list[_Mark]:
    if not views:
        raise ValueError("no view with a mask; draw a box around the object in one to three views")
    shown = [view for view in views if view.mask.any()]
    if not shown:
        raise ValueError(
            f"the mask is empty in {', '.join(view.name for view in views)}: there is no object in "
            "the box; draw it around the whole object"
        )
    room = [PosedSplats(cloud, Pose.identity())]
    return [
        _Mark(view, renderer.render(room, view.camera, view.world_from_camera).depth)
        for view in shown
    ]


def _drawn_inside(marks: Sequence[_Mark]) -> FloatArray:
    """(K, 3) world points of what is drawn inside all boxes."""
    found: list[FloatArray] = []
    for mark in marks:
        view = mark.view
        pixels = pixel_centres(view.camera).reshape(-1, 2)
        left, top, right, bottom = box_of(view)
        x, y = pixels.T
        pixels = pixels[(x > left) & (x < right) & (y > top) & (y < bottom)]
        points, is_drawn = points_drawn(view.camera, view.world_from_camera, mark.depth, pixels)
        found.append(points[is_drawn])
    return require_meeting(found, [mark.boxed(0.0) for mark in marks])


def _labelled(cells: SurfaceCells, marks: Sequence[_Mark]) -> Labelled:
    """The object's cells: those of least energy.

    Raises:
        ValueError: there are none.
    """
    inside = np.logical_and.reduce([mark.holds(cells.places, BOX_SLACK) for mark in marks])
    sights = [_sight(cells, mark) for mark in marks]
    is_seen = np.logical_or.reduce([seen for seen, _ in sights])
    shape = np.where(is_seen, PRIOR, HIDDEN_PRIOR)
    flat = going_on(cells, inside)
    shape -= (PRIOR + GOES_ON_COST) * flat
    shape += sum(odds for _, odds in sights)
    meant = _centrality(cells.places, marks) * np.where(is_seen, 1.0, LEFT_OUT)
    for mark in marks:
        for at_stroke, says in _strokes(cells, mark):
            shape[at_stroke] = says * np.inf
            meant[at_stroke] = says * len(cells)
    sure = np.isinf(shape)
    shape = np.where(inside, shape, -np.inf)
    links = links_between(cells)
    belief, labels, held, openness = shape, inside, inside, 0.0
    for _ in range(ROUNDS):
        held = cut(belief, links, smoothness=SMOOTHNESS)
        if not held.any():
            raise ValueError(
                "the photos show no object inside the boxes that ends there; draw each box around "
                "one whole object, in views from different sides"
            )
        labels, openness = ending_bodies(
            cells, held, meant=meant, inside=inside, links=links, beside=BESIDE
        )
        belief = shape + colour_odds(cells.colours, labels)
    return Labelled(labels, held, flat, inside, sure, openness, links)


def _sight(cells: SurfaceCells, mark: _Mark) -> tuple[BoolArray, FloatArray]:
    """(N,) whether a marked view sees each cell, and the log odds that its mask gives."""
    view, camera = mark.view, mark.view.camera
    in_camera = view.world_from_camera.inverse() @ cells.places
    pixels, framed = camera.project(in_camera)
    column = np.clip(np.floor(pixels[:, 0]).astype(np.intp), 0, camera.width_px - 1)
    row = np.clip(np.floor(pixels[:, 1]).astype(np.intp), 0, camera.height_px - 1)
    away = in_camera[:, 2] if isinstance(camera, Pinhole) else np.linalg.norm(in_camera, axis=1)
    seen = framed & (away < mark.depth[row, column] + DEPTH_SLACK_M)
    # Where somebody corrected a mask, or drew nothing else, what it leaves out is not the object.
    is_exact = view.box_px is None or len(view.outside_px) > 0
    against = -(PRIOR + MASK_ODDS) if is_exact else 0.0
    return seen, np.where(seen, np.where(view.mask[row, column], MASK_ODDS, against), 0.0)


def _strokes(cells: SurfaceCells, mark: _Mark) -> Iterator[tuple[BoolArray, int]]:
    """(N,) cells at a view's strokes: those beside the object, -1, and those on it, 1."""
    view = mark.view
    for pixels, says in ((view.outside_px, -1), (view.inside_px, 1)):
        points, is_drawn = points_drawn(view.camera, view.world_from_camera, mark.depth, pixels)
        if is_drawn.any():
            apart, _ = nearest(cells.places, points[is_drawn])
            yield apart[:, 0] < STROKE_SIDES * cells.side_m, says


def _centrality(points: FloatArray, marks: Sequence[_Mark]) -> FloatArray:
    """(N,) how near to the middle of all boxes points lie: 1 there, 0 at a border."""
    found = np.ones(len(points))
    for mark in marks:
        view = mark.view
        pixels, _ = view.camera.project(view.world_from_camera.inverse() @ points)
        left, top, right, bottom = box_of(view)
        off = np.abs(pixels - ((left + right) / 2, (top + bottom) / 2))
        found *= np.clip(1.0 - (2 * off / (right - left, bottom - top)).max(axis=1), 0.05, 1.0)
    return found


def _verdict(mark: _Mark, places: FloatArray) -> ViewVerdict:
    """How much of the object a view's mask shows."""
    view, camera = mark.view, mark.view.camera
    pixels, framed = camera.project(view.world_from_camera.inverse() @ places)
    column, row = np.floor(pixels[framed]).astype(np.intp).T
    column, row = np.clip(column, 0, camera.width_px - 1), np.clip(row, 0, camera.height_px - 1)
    shown = float(view.mask[row, column].mean()) if len(row) else 0.0
    return ViewVerdict(view.name, shown, True)
