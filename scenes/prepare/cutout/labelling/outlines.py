# pyright: standard
"""Outlines of an object in drawn views of the room, and the splats that paint what is in them.

Surface cells are as rough as the depth that is drawn: a floor that photos hardly tell apart is
drawn into the air above it, and what hangs a centimetre beside an object is near to its cells. A
picture says to the pixel where an object ends. Every pixel is the object's by the cells at its
depth and by its colour, if that is the object's rather than the room's around; odds are smoothed up
to the picture's edges (Min et al. 2014, *Fast Global Image Smoothing*), and colours and outlines
found by turns, as GrabCut does (Rother et al. 2004). Whose pixels a splat paints, owns it: one that
hangs beside an object and paints the wall behind it is the wall's.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.cluster.vq import kmeans2

from scenes.package.records import ViewPoint
from scenes.prepare.cells import nearest
from scenes.prepare.cutout.connected_bodies import bodies
from scenes.prepare.cutout.labelling.above_ground import SOLID
from scenes.prepare.cutout.labelling.ending_bodies import GAP
from scenes.prepare.cutout.labelling.separate import Separation
from scenes.prepare.cutout.labelling.surface_cells import (
    AROUND_M,
    DrawnView,
    SurfaceCells,
    cells_around,
    splats_of_cells,
)
from scenes.prepare.cutout.level_planes import Support, support_under
from scenes.prepare.cutout.marks.masked_view import MaskedView
from scenes.prepare.cutout.votes.cropped_views import light_in_masks
from scenes.render.native import NativeRenderer
from scenes.splats import SplatCloud

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

CELL_ODDS = 2.5
"""Log odds that the cells at a pixel's depth give at most. Overlap of outlines with the true ones,
18 objects of three rooms: 1.0 to 3.0 give 0.849 to 0.858, 2.5 gives 0.854; by cells alone it is
0.63. With 1.5 a suitcase's thin handle before a wall of its colour is lost, 32 cm of its box."""

OUTSIDE_ODDS = 1.25
"""Log odds against a pixel whose depth lies outside the boxes: depth may be wrong. Measured: 0.5,
1.0 and 1.5 give 0.813, 0.853 and 0.853."""

SURE_ODDS = 8.0
"""Log odds of a pixel at a stroke: more than cells and colours say together."""

CORRECTED_ODDS = 4.0
"""Log odds that cells give a splat where somebody drew a stroke beside the object: more than all
its light (`FEW`). Where nobody did, colours know better: it would lose 0.04 of IoU (22 objects)."""

NEAR_SIDES = 4.0
"""Sides of a cell at which a cell says only a third (1/e) as much about a pixel."""

NEAR = float(np.exp(-((1.0 / NEAR_SIDES) ** 2)))
"""How near a pixel is to a cell that somebody drew a stroke on, by that: a side of a cell."""

NEIGHBOURS = 4
"""Cells that say whose a pixel is."""

FEW = 0.05
"""Share of a pixel's cells, and of a splat's light, that may be wrong."""

TINY = 1e-9
"""Light that is none."""

COLOURS = 64
"""Kinds of colour that all views together are made of. Measured: 32 and 128 change overlaps by less
than 0.01."""

SAMPLED_PX = 4000
"""Pixels by which these kinds are found."""

MAX_COLOUR_ODDS = 3.0
"""Log odds that a colour gives at most. Measured: 2 and 4 give the same."""

RARE = 0.002
"""Share of the pixels below which a kind of colour says little."""

ROUNDS = 3
"""Outlines found, each with the colours of the one before. Measured: 2 and 5 give no more."""

SMOOTHNESS, EDGE = 300.0, 3.0
"""Of the odds: weight of smoothness, and grey levels that are an edge. Measured: 0.858; 100 and
1,000 give 0.853 and 0.838, edges of 2 and 6 levels 0.858 and 0.842."""

SEEN_PX = 0.5
"""Light, in pixels of all views, below which a splat's nearest cells say whose it is."""

FAR_M = 0.2
"""How far from the object's cells a splat inside all boxes may hang: in rooms that few photos show,
splats paint a surface from 2 to 20 cm off it. Measured on 27 objects: 0.05, 0.1 and 0.2 give an IoU
of 0.693, 0.716 and 0.747."""

SAME_SIDES = 2.0
"""Sides of a cell within which what is drawn at its pixel is the cell."""

SCRAP = 0.02
"""Of the largest body's cells: a smaller piece says nothing of where the object ends, as in
`votes.seen_surface`."""

LEVEL = 0.8
"""Cosine between a cell's normal and up from which on the object may stand on it."""


def separated(
    cloud: SplatCloud,
    cells: SurfaceCells,
    *,
    labels: BoolArray,
    inside: BoolArray,
    sure: BoolArray,
    within: BoolArray,
    renderer: NativeRenderer,
) -> Separation:
    """The splats and the surface of an object, by its outlines.

    Args:
        cloud: the whole room.
        cells: around the object, and well beyond it.
        labels: (K,) those of the object, roughly.
        inside: (K,) those where it may be.
        sure: (K,) those whose label somebody gave.
        within: (N,) the splats where it may be.
        renderer: draws the room.
    """
    odds = outlines(cells, labels=labels, inside=inside, sure=sure)
    found = _painting(
        cloud, cells, odds, labels=labels, sure=sure, within=within, renderer=renderer
    )
    own = _cells_in(odds, cells, labels=labels, inside=inside)
    is_level = ~own & (cells.normals[:, 2] > LEVEL)
    none = np.zeros_like(found)
    masks = tuple(
        MaskedView(drawn.view.name, drawn.view.camera, drawn.view.world_from_camera, of_view > 0)
        for drawn, of_view in zip(cells.views, odds, strict=True)
    )
    return Separation(found, none, none, (), masks, cells.places[own], cells.places[is_level])


def outlined(
    cloud: SplatCloud,
    labels: BoolArray,
    *,
    viewpoints: Sequence[ViewPoint],
    renderer: NativeRenderer,
) -> Separation:
    """The splats and the surface of an object whose splats are roughly known.

    Args:
        cloud: the whole room.
        labels: (N,) the object's splats, roughly.
        viewpoints: photos of the room; where none shows the object, it stays as it is.
        renderer: draws the room.
    """
    solid = labels & (cloud.opacities >= SOLID)
    own = cloud.means[solid if solid.any() else labels].astype(np.float64)
    low, high = np.percentile(own, (1, 99), axis=0)
    cells = cells_around(cloud, viewpoints, own, box=(low, high), renderer=renderer)
    if not len(cells):
        none = np.zeros_like(labels)
        return Separation(labels, none, none, ())
    _, which = nearest(cells.places, cloud.means, count=1)

    def is_near(points: NDArray[np.floating]) -> BoolArray:
        return ((points > low - AROUND_M) & (points < high + AROUND_M)).all(axis=1)

    inside = is_near(cells.places)
    return separated(
        cloud,
        cells,
        labels=labels[which[:, 0]] & inside,
        inside=inside,
        sure=np.zeros_like(inside),
        within=is_near(cloud.means),
        renderer=renderer,
    )


def _painting(
    cloud: SplatCloud,
    cells: SurfaceCells,
    odds_by_view: Sequence[NDArray[np.float32]],
    *,
    labels: BoolArray,
    sure: BoolArray,
    within: BoolArray,
    renderer: NativeRenderer,
) -> BoolArray:
    """(N,) the splats whose light falls into the outlines, but for those of the support.

    What is dark in the shadow of an object is often as dark as the object, and what no photo shows
    under it goes on from around it.
    """
    by_cells = splats_of_cells(cloud, cells, labels=labels, within=within, far_m=FAR_M)
    if not labels.any() or not cells.views:
        return by_cells
    masks = [(drawn.view, odds > 0) for drawn, odds in zip(cells.views, odds_by_view, strict=True)]
    light, seen = light_in_masks(cloud, masks, renderer=renderer)
    means = cloud.means.astype(np.float64)
    by_light = np.log((light + FEW * seen + TINY) / ((1.0 + FEW) * seen - light + TINY))
    odds = np.where(seen > SEEN_PX, by_light, np.where(by_cells, 0.0, -np.inf))
    own, level = cells.places[labels], cells.places[~labels & (cells.normals[:, 2] > LEVEL)]
    ground = (cloud.opacities >= SOLID) & ~(by_light > 0)
    support = support_under(own, level, means[ground])
    if support is not None:
        reach_m = max(float(own[:, 2].max()) - support.height_m, support.spread_m)
        odds -= _on_support(means[:, 2], support, reach_m=reach_m)
    if (sure & ~labels).any():
        # Somebody said what is not the object: cells were parted there, whatever colours say.
        which, weights, decay = _weighed(means, cells)
        said = (weights * np.where(labels[which], 1.0, -1.0)).sum(axis=1)
        odds += CORRECTED_ODDS * decay * said
    candidates = np.flatnonzero((odds >= 0) & within)
    apart, _ = nearest(means[candidates], own)
    found = np.zeros(len(cloud), dtype=bool)
    found[candidates[apart[:, 0] < FAR_M]] = True
    return found


def _cells_in(
    odds: Sequence[NDArray[np.float32]],
    cells: SurfaceCells,
    *,
    labels: BoolArray,
    inside: BoolArray,
) -> BoolArray:
    """(K,) the cells in most outlines of the views that see them; where none does, the labelled."""
    total, seen = np.zeros((2, len(cells)))
    for drawn, of_view in zip(cells.views, odds, strict=True):
        camera = drawn.view.camera
        in_camera = drawn.view.world_from_camera.inverse() @ cells.places
        pixels, framed = camera.project(in_camera)
        column = np.clip(np.floor(pixels[:, 0]).astype(np.intp), 0, camera.width_px - 1)
        row = np.clip(np.floor(pixels[:, 1]).astype(np.intp), 0, camera.height_px - 1)
        beyond = np.abs(in_camera[:, 2] - drawn.depth_m[row, column])
        sees = framed & (beyond < SAME_SIDES * cells.side_m)
        total += np.where(sees, np.clip(of_view[row, column], -MAX_COLOUR_ODDS, MAX_COLOUR_ODDS), 0)
        seen += sees
    found = np.where(seen > 0, total > 0, labels) & inside
    chosen = np.flatnonzero(found)
    if not labels.any() or not len(chosen):
        return labels
    apart, _ = nearest(cells.places[chosen], cells.places[labels])
    count, body = bodies(cells.places[chosen], GAP * cells.side_m)
    size = np.bincount(body, minlength=count)
    found[chosen] = (apart[:, 0] < FAR_M) & (size >= SCRAP * size.max())[body]
    return found


def _on_support(heights_m: FloatArray, support: Support, *, reach_m: float) -> FloatArray:
    """(N,) log odds that heights are the support's, not anywhere up to how high its object reaches.

    At a centimetre above a floor that is drawn to a millimetre an object is an object, above one
    that is drawn to a centimetre nobody knows. What lies below is no part of what stands there.
    """
    off = np.maximum(heights_m - support.height_m, 0.0) / support.spread_m
    on = reach_m / (np.sqrt(2.0 * np.pi) * support.spread_m)
    return np.maximum(np.log(on) - 0.5 * off**2, 0.0)


def outlines(
    cells: SurfaceCells, *, labels: BoolArray, inside: BoolArray, sure: BoolArray
) -> list[NDArray[np.float32]]:
    """By drawn view, (H, W) log odds that a pixel is the object's; see `separated`."""
    by_cells = [
        _odds_by_cells(drawn, cells, labels=labels, inside=inside, sure=sure)
        for drawn in cells.views
    ]
    kinds = _kinds_of_colour(cells.views)
    share = [(odds > 0.5 * CELL_ODDS).astype(np.float64) for odds in by_cells]
    found: list[NDArray[np.float32]] = []
    for _ in range(ROUNDS):
        by_colour = _odds_of_kinds(kinds, share)
        found = [
            _smoothed(drawn, odds + by_colour[kind])
            for drawn, odds, kind in zip(cells.views, by_cells, kinds, strict=True)
        ]
        share = [1.0 / (1.0 + np.exp(-odds.astype(np.float64))) for odds in found]
    return found


def _smoothed(drawn: DrawnView, odds: FloatArray) -> NDArray[np.float32]:
    """(H, W) the odds, smooth but for the picture's edges."""
    picture = np.rint(255 * drawn.rgb).astype(np.uint8)
    smooth = cv2.ximgproc.fastGlobalSmootherFilter(
        picture, odds.astype(np.float32), SMOOTHNESS, EDGE
    )
    return np.asarray(smooth, dtype=np.float32)


def _odds_by_cells(
    drawn: DrawnView, cells: SurfaceCells, *, labels: BoolArray, inside: BoolArray, sure: BoolArray
) -> FloatArray:
    """(H, W) log odds of each pixel by the cells that are nearest to what is drawn there."""
    points, there = drawn.points()
    which, weights, decay = _weighed(points[there], cells)
    own = (weights * labels[which]).sum(axis=1)
    odds = np.clip(np.log((own + FEW) / (1.0 - own + FEW)), -CELL_ODDS, CELL_ODDS) * decay
    odds -= OUTSIDE_ODDS * (weights * ~inside[which]).sum(axis=1)
    stroked = sure[which[:, 0]] & (decay > NEAR)
    odds[stroked] = np.where(labels[which[stroked, 0]], SURE_ODDS, -SURE_ODDS)
    found = np.full(there.shape, -OUTSIDE_ODDS)
    found[there] = odds
    return found


def _weighed(
    points: FloatArray, cells: SurfaceCells
) -> tuple[NDArray[np.intp], FloatArray, FloatArray]:
    """Cells (N, K) nearest to points (N, 3), their weights, and (N,) how near they are, 0..1."""
    apart, which = nearest(points, cells.places, count=NEIGHBOURS)
    apart /= cells.side_m
    weights = np.exp(-(apart**2)) + 1e-6
    weights /= weights.sum(axis=1, keepdims=True)
    return which, weights, np.exp(-((apart[:, 0] / NEAR_SIDES) ** 2))


def _kinds_of_colour(views: Sequence[DrawnView]) -> list[NDArray[np.intp]]:
    """By view, (H, W) the kind of colour of each pixel: the nearest of `COLOURS`."""
    rng = np.random.default_rng(0)
    pixels = np.concatenate([drawn.rgb.reshape(-1, 3) for drawn in views]).astype(np.float64)
    sample = pixels[rng.choice(len(pixels), min(SAMPLED_PX, len(pixels)), replace=False)]
    count = min(COLOURS, len(np.unique(sample, axis=0)))
    middles, _ = kmeans2(sample, count, minit="++", missing="warn", rng=rng)
    _, kind = nearest(pixels, middles)
    ends = np.cumsum([drawn.depth_m.size for drawn in views])[:-1]
    shapes = [drawn.depth_m.shape for drawn in views]
    parts = np.split(kind[:, 0], ends)
    return [part.reshape(shape) for part, shape in zip(parts, shapes, strict=True)]


def _odds_of_kinds(
    kinds: Sequence[NDArray[np.intp]], shares: Sequence[NDArray[np.floating]]
) -> FloatArray:
    """(C,) log odds of each kind of colour between the object and the room around it.

    Args:
        kinds: by view, (H, W).
        shares: by view, (H, W) how likely each pixel is the object's.
    """
    kind = np.concatenate([of_view.ravel() for of_view in kinds])
    share = np.concatenate([of_view.ravel() for of_view in shares])
    own = np.bincount(kind, weights=share, minlength=COLOURS)
    rest = np.bincount(kind, weights=1.0 - share, minlength=COLOURS)
    own, rest = (part / max(part.sum(), TINY) + RARE for part in (own, rest))
    return np.clip(np.log(own / rest), -MAX_COLOUR_ODDS, MAX_COLOUR_ODDS)
