# pyright: standard
"""Surface of an object, as many views of the room together see it.

Splats of a trained room float before and behind what they paint, and big ones end far beyond their
centres. What views agree about is firmer: the depth of what is drawn inside the object's outline,
kept where several views find a surface in the same place and none sees it outside the outline.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import KDTree

from scenes.cameras import pixel_centres
from scenes.package.records import ViewPoint
from scenes.prepare.cells import cells_of
from scenes.prepare.cutout.connected_bodies import bodies
from scenes.prepare.cutout.votes.cropped_views import CloseView, close_views, evenly
from scenes.prepare.cutout.votes.framed import framed
from scenes.prepare.cutout.votes.lifting import share
from scenes.prepare.cutout.votes.seen_from import SeenFrom
from scenes.prepare.surface_depth import surface_depth
from scenes.render.native import NativeRenderer
from scenes.splats import SplatCloud

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

MAX_VIEWS = 24
"""Views that are drawn, evenly out of those that frame the object."""
MAJORITY = 0.5
"""Share of a pixel's light from which on it is the object's."""
PURE = 0.9
"""The same for its depth to be the object's alone."""
MIN_PX = 60
"""A smaller outline says nothing."""
RIM_PX = 3.0
"""How far a depth may be carried to the outline: depth is unsure at edges, outlines are not."""
OUTLINE_PX = 8.0
"""The same where only the outline matters."""
CELL_M = 0.01
"""Least side of a cell in which views agree."""
CELL_PX = 2.0
"""A cell is also at least as wide as so many pixels of the crops."""
AGREEING = 4
"""How many views have to find a surface in the same cell."""
MIN_VIEWS = 6
"""Of fewer views so many seldom agree."""
MAX_SHARE_OUTSIDE = 0.1
"""Of the views: how many may see a point of the object outside its outline."""
BEHIND_M = 0.05
"""So far behind what is drawn a point is hidden."""
GAP_M = 0.03
"""Distance beyond which points are of another body, metres."""
SPECK = 0.02
"""A piece of surface that far away from all others, with less than this share of the largest
one's points, is none of the object's."""


@dataclass(frozen=True, slots=True, eq=False)
class SeenSurface:
    """Surface that views agree about; world points, none where too few frame the object whole.

    Attributes:
        own: (P, 3) on the object's surface.
        around: (Q, 3) on surfaces beside it, as far as the object is large.
        by_view: what each view shows of the object up to its outline, whoever agrees.
    """

    own: FloatArray
    around: FloatArray
    by_view: tuple[SeenFrom, ...] = ()


NOTHING = SeenSurface(np.zeros((0, 3)), np.zeros((0, 3)))
"""Surface of an object that too few views frame."""


def seen_surface(
    cloud: SplatCloud,
    labels: BoolArray,
    viewpoints: Sequence[ViewPoint],
    *,
    renderer: NativeRenderer,
) -> SeenSurface:
    """Points on the surfaces of an object and of what is beside it that `AGREEING` views see.

    Args:
        cloud: the whole room, metres.
        labels: (N,) the object's splats.
        viewpoints: of the room; pinhole ones that frame the object whole are used, evenly chosen.
        renderer: draws the room.
    """
    own = cloud.means[labels].astype(np.float64)
    framing = close_views(viewpoints, own)
    if len(framing) < MIN_VIEWS:
        return NOTHING
    sights = [_sight(cloud, labels, view, renderer) for view in evenly(framing, MAX_VIEWS)]
    pixels_m = np.concatenate([sight.pixels_m() for sight in sights])
    if not len(pixels_m):
        return NOTHING
    cell_m = max(CELL_M, CELL_PX * float(np.median(pixels_m)))
    own = _agree([sight.own for sight in sights], cell_m)
    own = own[_in_outlines(own, sights)]
    if not len(own):
        return NOTHING
    count, body = bodies(own, GAP_M)
    points_of = np.bincount(body, minlength=count)
    own = own[points_of[body] >= SPECK * points_of.max()]
    around = _agree([sight.around for sight in sights], cell_m)
    low, high = own.min(axis=0), own.max(axis=0)
    reach = (high - low).max()
    near = ((around > low - reach) & (around < high + reach)).all(axis=1)
    return SeenSurface(own, around[near], _by_view(sights, own))


def _by_view(sights: Sequence[_Sight], own: FloatArray) -> tuple[SeenFrom, ...]:
    """Points of each view near the agreed surface; depths at edges may be far behind."""
    tree = KDTree(own)
    seen = []
    for sight in sights:
        apart, _ = (
            tree.query(sight.whole, distance_upper_bound=BEHIND_M, workers=-1)
            if len(sight.whole)
            else (np.zeros(0), None)
        )
        eye = sight.view.world_from_camera.translation
        seen.append(SeenFrom(eye, sight.whole[apart < BEHIND_M], 1.0 / sight.view.camera.fx))
    return tuple(seen)


@dataclass(frozen=True, slots=True, eq=False)
class _Sight:
    """Depth and outline of an object in one view.

    Attributes:
        view: which.
        outline: (H, W) where most of the light is the object's.
        depth: (H, W) z of what is drawn, 0 where it is not sure.
        own: (K, 3) world points drawn inside the outline, up to its rim.
        whole: (J, 3) the same up to the outline.
        around: (L, 3) world points drawn outside.
    """

    view: CloseView
    outline: BoolArray
    depth: NDArray[np.float32]
    own: FloatArray
    whole: FloatArray
    around: FloatArray

    def pixels_m(self) -> FloatArray:
        """(K,) how wide a pixel is at each of the object's points."""
        apart = self.own - self.view.world_from_camera.translation
        return np.linalg.norm(apart, axis=1) / self.view.camera.fx

    def outside(self, points: NDArray[np.float32]) -> tuple[BoolArray, BoolArray]:
        """(N,) whether world points are framed and not hidden, and whether outside the outline."""
        pose = self.view.world_from_camera
        in_camera = (points - pose.translation.astype(np.float32)) @ pose.rotation.astype(
            np.float32
        )
        pixels, framed = self.view.camera.project(in_camera)
        height, width = self.outline.shape
        row = np.clip(pixels[:, 1].astype(np.intp), 0, height - 1)
        column = np.clip(pixels[:, 0].astype(np.intp), 0, width - 1)
        # Legs are a few pixels wide: a point on their rim is none outside.
        near = np.asarray(ndimage.binary_dilation(self.outline, np.ones((3, 3))), dtype=bool)
        beside = framed & ~near[row, column]
        drawn = self.depth[row, column]
        hidden = beside & (drawn > 0) & (drawn < in_camera[:, 2] - BEHIND_M)
        return framed & ~hidden, beside & ~hidden


def _sight(
    cloud: SplatCloud, labels: BoolArray, view: CloseView, renderer: NativeRenderer
) -> _Sight:
    camera, world_from_camera = view.camera, view.world_from_camera
    shown = framed(cloud, camera, world_from_camera)
    cloud, labels = cloud.select(shown), labels[shown]
    light = share(cloud, labels, camera, world_from_camera, renderer=renderer)
    outline = light > MAJORITY
    depth = surface_depth(cloud, camera, world_from_camera, renderer=renderer)
    none = np.zeros((0, 3))
    if outline.sum() < MIN_PX:
        return _Sight(view, outline, depth, none, none, none)
    rays = camera.unproject(pixel_centres(camera)).reshape(*depth.shape, 3)
    rays = rays / rays[..., 2:]
    away = (light < 1.0 - PURE) & (depth > 0)
    around = world_from_camera @ (rays[away] * depth[away].astype(np.float64)[:, None])
    sure = (light > PURE) & (depth > 0)
    if not sure.any():
        return _Sight(view, outline, depth, none, none, around)
    found = ndimage.distance_transform_edt(~sure, return_indices=True)
    assert isinstance(found, tuple)
    apart, nearest = found
    reached = outline & (apart <= OUTLINE_PX)
    z = depth[nearest[0], nearest[1]][reached].astype(np.float64)
    whole = world_from_camera @ (rays[reached] * z[:, None])
    return _Sight(view, outline, depth, whole[apart[reached] <= RIM_PX], whole, around)


def _in_outlines(points: NDArray[np.floating], sights: Sequence[_Sight]) -> BoolArray:
    """(N,) the points that lie inside the outlines of nearly all views that they could be seen in.

    Depth carried past an edge by one view is found outside by those that look along the surface.
    """
    framing, outside = np.zeros((2, len(points)))
    # To a hundredth of a pixel: a crop has a few hundred of them.
    points = points.astype(np.float32)
    for sight in sights:
        if sight.outline.sum() >= MIN_PX:
            seen, beside = sight.outside(points)
            framing += seen
            outside += beside
    return outside <= MAX_SHARE_OUTSIDE * framing


def _agree(by_view: Sequence[FloatArray], cell_m: float) -> FloatArray:
    """(K, 3) the points of all views in whose cell enough views have some."""
    points = np.concatenate(by_view)
    if not len(points):
        return points
    view = np.repeat(np.arange(len(by_view)), [len(there) for there in by_view])
    _, cell = cells_of(points, cell_m)
    cell_of_pair = np.unique(cell * len(by_view) + view) // len(by_view)
    return points[np.bincount(cell_of_pair)[cell] >= AGREEING]
