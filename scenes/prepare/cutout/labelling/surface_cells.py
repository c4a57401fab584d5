"""Small cells of the surfaces around a place, as many views of the room together draw them.

Splats hang before and behind what they paint, and differ in size by a hundred times. The depth that
several views draw in the same cell is surface, evenly sampled, with a normal and a colour; which
cells hang together says more about objects than which splats do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Pinhole, pixel_centres
from scenes.package.records import ViewPoint
from scenes.pose import Pose
from scenes.prepare.cells import cells_of, nearest, pairs_within
from scenes.prepare.cutout.labelling.graph_cut import Links
from scenes.prepare.cutout.votes.cropped_views import CloseView
from scenes.prepare.cutout.votes.framed import framed
from scenes.prepare.cutout.votes.seen_surface import CELL_PX
from scenes.prepare.surface_depth import surface_depth
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats
from scenes.splats import SplatCloud

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

MAX_VIEWS = 16
"""Views that are drawn. Measured: cuts in three rooms are as good with 16 as with 24."""

MAX_PX = 260
"""Longest side of what is drawn of a view, as in `votes.cropped_views`."""

MARGIN = 0.25
"""Of the place's size in a view: how far around it the view is cropped, as there."""

CELLS_ACROSS = 60
"""Cells along the longest side of an object."""

SIDES_M = (0.004, 0.02)
"""Smallest and largest side of a cell: finer than the splats' noise nothing is seen, and larger
ones swallow a chair's legs."""

AROUND, AROUND_M = 0.3, 0.05
"""Of an object's size, and metres: how far around it cells say what the room is."""

POINTS = 2000
"""Points around which views are cropped."""

NEAREST_M = 0.3
"""Views nearer than this are not preferred to others: they show too little around."""

MIN_SHOWN = 0.3
"""Share of the points around a place that a view has to show."""

AGREEING = 3
"""Views that have to find a surface in a cell. Measured: with 5 thin legs are lost."""

AGREEING_SHARE = 0.2
"""Of the views, where there are fewer than 15 of them."""

MIN_COSINE = 0.1
"""Between a surface's normal and the way to the eye; flatter than 6° a normal is a guess."""

LINK_REACH = 1.9
"""Cells whose places are nearer than so many sides are linked: those that share a face, an edge or
a corner lie 1 to 1.73 sides apart."""

CREASE_DEG = 25.0
"""Angle between the normals of two cells of a hollow at which they hardly hold together (1/e). Over
three cells, as blurred as depth is, a right angle makes 30° a step. Measured: 40° changes IoU by
less than 0.01."""

EDGE_DEG = 3 * CREASE_DEG
"""The same of an edge that stands out, which is seldom where one object ends and another begins."""

COLOUR_STEP = 0.15
"""Colour difference (0..1 per channel, Euclidean) at which two cells hardly hold together."""

MIN_HOLD = 1e-3
"""Strength of a link across any crease."""

NEIGHBOURS = 8
"""Cells that say whose a splat is."""

FAR_SIDES = 3.0
"""Splats farther from all cells than so many sides belong to none."""

FAR_M = 0.03
"""Or, where cells are small, than this: so far splats hang off what they paint."""


@dataclass(frozen=True, slots=True, eq=False)
class DrawnView:
    """A crop of a view as the room's splats draw it.

    Attributes:
        view: the crop.
        depth_m: (H, W) along the optical axis; 0 where there is none.
        rgb: (H, W, 3) 0..1.
    """

    view: CloseView
    depth_m: FloatArray
    rgb: NDArray[np.float32]

    def points(self) -> tuple[FloatArray, BoolArray]:
        """(H, W, 3) world points of what is drawn, and (H, W) where anything is."""
        camera = self.view.camera
        rays = camera.unproject(pixel_centres(camera))
        in_camera = rays / rays[:, 2:] * self.depth_m.reshape(-1, 1)
        places = self.view.world_from_camera @ in_camera
        return places.reshape(*self.depth_m.shape, 3), self.depth_m > 0


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceCells:
    """Cells that hold surface.

    Attributes:
        places: (N, 3) mean of the points that views draw in each, world metres.
        normals: (N, 3) unit vectors towards those who see it.
        colours: (N, 3) 0..1.
        seen_by: (N,) how many views draw a surface there.
        side_m: of a cell.
        views: that they were found in.
    """

    places: FloatArray
    normals: FloatArray
    colours: FloatArray
    seen_by: NDArray[np.intp]
    side_m: float
    views: tuple[DrawnView, ...] = ()

    def __len__(self) -> int:
        return len(self.places)


def surface_cells(
    cloud: SplatCloud,
    viewpoints: Sequence[ViewPoint],
    *,
    around: FloatArray,
    corners: tuple[FloatArray, FloatArray],
    side_m: float,
    renderer: NativeRenderer,
) -> SurfaceCells:
    """Cells of the surfaces in a box around a place.

    Args:
        cloud: the whole room, metres.
        viewpoints: of the room; of the pinhole ones up to `MAX_VIEWS`, from all sides and near.
        around: (K, 3) points that views are cropped to, a few of them.
        corners: lowest and highest (3,) of the box.
        side_m: of a cell, at least; it is as wide as `CELL_PX` pixels of most views, too, or there
            would be holes between cells.
        renderer: draws each view three times.
    """
    centre = (around.min(axis=0) + around.max(axis=0)) / 2
    some = around[:: max(1, len(around) // POINTS)]
    views = _views_around(viewpoints, some, centre=centre)
    drawn = tuple(_drawn(cloud, view, renderer=renderer) for view in views)
    sights = [_surface_in(view) for view in drawn]
    if views:
        away_m = [np.linalg.norm(view.world_from_camera.translation - centre) for view in views]
        pixels_m = [away / view.camera.fx for away, view in zip(away_m, views, strict=True)]
        side_m = max(side_m, CELL_PX * float(np.median(pixels_m)))
    low, high = corners
    kept = [((places > low) & (places < high)).all(axis=1) for places, _, _ in sights]
    if not any(mask.any() for mask in kept):
        none = np.zeros((0, 3))
        return SurfaceCells(none, none, none, np.zeros(0, dtype=np.intp), side_m, drawn)
    places, normals, colours = (
        np.concatenate([sight[part][mask] for sight, mask in zip(sights, kept, strict=True)])
        for part in range(3)
    )
    view = np.repeat(np.arange(len(sights)), [int(mask.sum()) for mask in kept])
    _, cell = cells_of(places, side_m)
    count = int(cell.max()) + 1
    points = np.bincount(cell, minlength=count)
    seen_by = np.bincount(
        np.unique(cell.astype(np.int64) * len(sights) + view) // len(sights), minlength=count
    )
    held = seen_by >= max(1, min(AGREEING, round(AGREEING_SHARE * len(sights))))

    def mean_of(values: FloatArray) -> FloatArray:
        sums = [np.bincount(cell, weights=axis, minlength=count) for axis in values.T]
        return (np.stack(sums, axis=1) / points[:, None])[held]

    normals = mean_of(normals)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
    return SurfaceCells(mean_of(places), normals, mean_of(colours), seen_by[held], side_m, drawn)


def cells_around(
    cloud: SplatCloud,
    viewpoints: Sequence[ViewPoint],
    own: FloatArray,
    *,
    box: tuple[FloatArray, FloatArray],
    renderer: NativeRenderer,
) -> SurfaceCells:
    """Cells of an object and of the room around it, as fine as the object is large.

    Args:
        cloud: the whole room, metres.
        viewpoints: of the room.
        own: (K, 3) points of the object, roughly.
        box: lowest and highest (3,) of it.
        renderer: draws each view.
    """
    low, high = box
    size_m = float((high - low).max())
    reach = AROUND * size_m + AROUND_M
    return surface_cells(
        cloud,
        viewpoints,
        around=own,
        corners=(low - reach, high + reach),
        side_m=float(np.clip(size_m / CELLS_ACROSS, *SIDES_M)),
        renderer=renderer,
    )


def links_between(cells: SurfaceCells) -> Links:
    """Links of cells beside each other, weak across creases and steps of colour.

    Two faces that meet in a hollow are often two objects, two that meet in an edge seldom (Stein et
    al. 2014, *Object Partitioning using Local Convexity*).
    """
    first, second = pairs_within(cells.places, LINK_REACH * cells.side_m)
    apart = cells.places[second] - cells.places[first]
    turned = cells.normals[second] - cells.normals[first]
    is_hollow = (turned * apart).sum(axis=1) < 0
    cosine = np.clip((cells.normals[first] * cells.normals[second]).sum(axis=1), -1.0, 1.0)
    angle_deg = np.degrees(np.arccos(cosine))
    bend = angle_deg / np.where(is_hollow, CREASE_DEG, EDGE_DEG)
    step = np.linalg.norm(cells.colours[first] - cells.colours[second], axis=1) / COLOUR_STEP
    return first, second, np.exp(-(bend**2) - step**2) + MIN_HOLD


def splats_of_cells(
    cloud: SplatCloud,
    cells: SurfaceCells,
    *,
    labels: BoolArray,
    within: BoolArray | None = None,
    far_m: float = FAR_M,
) -> BoolArray:
    """(N,) the splats that lie at labelled cells rather than at others.

    The nearest cells vote, near ones and those that many views see with more weight.

    Args:
        cloud: the whole room.
        cells: around an object, and well beyond it.
        labels: (K,) those of the object.
        within: (N,) splats that nothing but the object's cells may be near to; none if not given.
        far_m: how far from any cell these may hang to be the object's.
    """
    found = np.zeros(len(cloud), dtype=bool)
    if not labels.any():
        return found
    limit_m = np.full(len(cloud), max(FAR_SIDES * cells.side_m, FAR_M))
    if within is not None:
        limit_m[within] = np.maximum(limit_m[within], far_m)
    reach = limit_m.max()
    low, high = cells.places[labels].min(axis=0) - reach, cells.places[labels].max(axis=0) + reach
    near = np.flatnonzero(((cloud.means > low) & (cloud.means < high)).all(axis=1))
    if not len(near):
        return found
    apart, which = nearest(cloud.means[near], cells.places, count=NEIGHBOURS)
    # Far from all cells the nearest few are equally near.
    scale = np.maximum(2.0 * cells.side_m, apart[:, :1])
    votes = np.exp(-((apart / scale) ** 2)) * cells.seen_by[which]
    share = (votes * labels[which]).sum(axis=1) / votes.sum(axis=1)
    found[near] = (share > 0.5) & (apart[:, 0] <= limit_m[near])
    return found


def _views_around(
    viewpoints: Sequence[ViewPoint], around: FloatArray, *, centre: FloatArray
) -> list[CloseView]:
    """Up to `MAX_VIEWS` crops to points.

    First the one that shows most of them from near, then always the one whose direction differs
    most from those chosen.
    """
    found: list[CloseView] = []
    quality: list[float] = []
    for view in viewpoints:
        crop = _cropped(view, around)
        if crop is not None:
            found.append(crop[0])
            away_m = float(np.linalg.norm(view.world_from_camera.translation - centre))
            quality.append(crop[1] / max(away_m, NEAREST_M))
    if len(found) <= MAX_VIEWS:
        return found
    ways = np.stack([view.world_from_camera.translation - centre for view in found])
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    picked = [int(np.argmax(quality))]
    new = 1.0 - ways @ ways[picked[0]]
    while len(picked) < MAX_VIEWS:
        picked.append(int(np.argmax(new * quality)))
        new = np.minimum(new, 1.0 - ways @ ways[picked[-1]])
    return [found[pick] for pick in picked]


def _cropped(view: ViewPoint, points: FloatArray) -> tuple[CloseView, float] | None:
    """A view's part around points, and the share of them that it shows; None if too few."""
    camera = view.camera
    if not isinstance(camera, Pinhole):
        return None
    in_camera = view.world_from_camera.inverse() @ points
    if (in_camera[:, 2] < 0.05).mean() > 0.02:
        return None
    pixels, _ = camera.project(in_camera[in_camera[:, 2] >= 0.05])
    limit = np.array([camera.width_px, camera.height_px])
    shown = float(((pixels > 0) & (pixels < limit)).all(axis=1).mean())
    if shown < MIN_SHOWN:
        return None
    low, high = np.percentile(pixels, (1, 99), axis=0)
    reach = MARGIN * (high - low).max() + 4
    first = np.floor(np.maximum(low - reach, 0)).astype(int)
    last = np.ceil(np.minimum(high + reach, limit)).astype(int)
    scale = min(1.0, MAX_PX / float((last - first).max()))
    size = np.maximum(np.rint((last - first) * scale).astype(int), 3)
    crop = Pinhole(
        int(size[0]), int(size[1]), camera.fx * scale, camera.fy * scale,
        (camera.cx - float(first[0])) * scale, (camera.cy - float(first[1])) * scale,
    )  # fmt: skip
    return CloseView(view.name, crop, view.world_from_camera, scale), shown


def _drawn(cloud: SplatCloud, view: CloseView, *, renderer: NativeRenderer) -> DrawnView:
    camera, pose = view.camera, view.world_from_camera
    shown = cloud.select(framed(cloud, camera, pose))
    depth = surface_depth(shown, camera, pose, renderer=renderer).astype(np.float64)
    rgb = renderer.render([PosedSplats(shown, Pose.identity())], camera, pose).rgb
    return DrawnView(view, depth, np.clip(rgb, 0.0, 1.0))


def _surface_in(drawn: DrawnView) -> tuple[FloatArray, FloatArray, FloatArray]:
    """World points (K, 3) of the surface that a view draws, their normals and colours."""
    points, there = drawn.points()
    colours = drawn.rgb
    across, down = np.zeros(points.shape), np.zeros(points.shape)
    across[:, 1:-1] = points[:, 2:] - points[:, :-2]
    down[1:-1] = points[2:] - points[:-2]
    # A surface's point is sure where its four neighbours are.
    is_sure = np.zeros(there.shape, dtype=bool)
    is_sure[1:-1, 1:-1] = (
        there[1:-1, 1:-1]
        & there[2:, 1:-1] & there[:-2, 1:-1] & there[1:-1, 2:] & there[1:-1, :-2]
    )  # fmt: skip
    normals = np.cross(down, across)
    length = np.linalg.norm(normals, axis=2)
    normals /= np.maximum(length, 1e-15)[..., None]
    towards = drawn.view.world_from_camera.translation - points
    cosine = (normals * towards).sum(axis=2) / np.maximum(np.linalg.norm(towards, axis=2), 1e-9)
    is_sure &= (length > 0) & (np.abs(cosine) > MIN_COSINE)
    normals *= np.sign(cosine)[..., None]
    return points[is_sure], normals[is_sure], colours[is_sure].astype(np.float64)
