# pyright: standard
"""Relation of places in the room to the photos' own depth: on a surface, or in front of all.

Between what stereo has seen, a surface is taken to go on as it does at its rim: the inverse depth
of a plane is affine in the pixels, so it is filled in harmonically, less so across edges of the
picture. Seen depth is held to a small tolerance, filled depth to a large one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, diags_array
from scipy.sparse.linalg import spsolve

from scenes.cameras import Pinhole, pixel_centres
from scenes.pose import Pose
from scenes.prepare.train.depth.propagated import propagated_depth
from scenes.prepare.train.depth.stereo import SeenDepth

CELL_PX = 4
"""Filled depth is as coarse as this."""
MIN_SEEN_SHARE = 0.02
"""Views of which stereo has seen less than this share say nothing."""
SEEN_PULL = 10.0
EDGE_UNITS = 12.0
"""Difference of neighbouring cells' brightness (0..255) that loosens them e-fold."""
SEEN_SLACK, FILLED_SLACK = 0.01, 0.12
"""In front of a surface begins so far before it, as a share of its depth."""
REACH = 0.06
"""Share of its depth within which a place off a surface is put back on it."""
MIN_VIEWS = 2
MAX_PROPAGATED_POINTS = 1_000_000
"""Points of all views that are drawn into each."""
ASKED = 20
"""Views that are asked to confirm what one sees, itself among them."""
BEFORE, UPON, BEHIND = range(3)
"""Sides of a surface that a place can lie on: in front of it, on it, behind it."""


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """Surface that one view shows.

    Attributes:
        view: its name.
        camera: its lens, at the depth's size.
        world_from_camera: its pose.
        picture: (H, W, 3) uint8 RGB.
        depth: (H, W) float32 z, everywhere.
        is_seen: (H, W) bool: by stereo of this view.
        is_propagated: (H, W) bool: depth comes from other views' stereo; the rest is filled in.
    """

    view: str
    camera: Pinhole
    world_from_camera: Pose
    picture: NDArray[np.uint8]
    depth: NDArray[np.float32]
    is_seen: NDArray[np.bool_]
    is_propagated: NDArray[np.bool_]

    def places(self) -> NDArray[np.float32]:
        """(N, 3) world, of the pixels that stereo of this view has seen."""
        seen = np.flatnonzero(self.is_seen)
        rays = self.camera.unproject(pixel_centres(self.camera)[seen])
        in_camera = rays * (self.depth.ravel()[seen] / rays[:, 2])[:, None]
        return (self.world_from_camera @ in_camera).astype(np.float32)


def surfaces_of(depths: Sequence[SeenDepth]) -> list[Surface]:
    """The surfaces that views agree about, propagated between views and filled in.

    Views that see next to nothing are left out.
    """
    raw = [
        Surface(
            s.view.name,
            s.camera,
            s.view.world_from_camera,
            s.picture,
            s.depth,
            s.depth > 0,
            np.zeros(s.depth.shape, dtype=np.bool_),
        )
        for s in depths
    ]
    sure = [_confirm(surface, raw) for surface in raw]
    places = np.concatenate([np.zeros((0, 3), np.float32), *(s.places() for s in sure)])
    places = places[:: max(len(places) // MAX_PROPAGATED_POINTS, 1)]
    whole = [_add_propagated(surface, places) for surface in sure]
    return [
        replace(surface, depth=filled(surface.depth, surface.picture))
        for surface in whole
        if (surface.depth > 0).mean() >= MIN_SEEN_SHARE
    ]


def _add_propagated(surface: Surface, places: NDArray[np.float32]) -> Surface:
    """The surface with depth propagated from others where it has none of its own."""
    propagated = propagated_depth(surface.camera, surface.world_from_camera, places)
    is_propagated = ~surface.is_seen & (propagated > 0)
    return replace(
        surface,
        depth=np.where(is_propagated, propagated, surface.depth),
        is_propagated=is_propagated,
    )


def _confirm(surface: Surface, others: Sequence[Surface]) -> Surface:
    """The surface where views near by see it too, at their mean depth; depth 0 elsewhere."""
    eye = surface.world_from_camera.translation
    others = sorted(
        others, key=lambda other: float(np.linalg.norm(other.world_from_camera.translation - eye))
    )
    seen = np.flatnonzero(surface.is_seen)
    places = surface.places()
    tally = _Tally(len(seen))
    for other in others[:ASKED]:
        tally.add(other, places)
    before, upon, *_ = tally.counts
    # The view itself is one of those upon it.
    sure = (upon > MIN_VIEWS) & (upon > before)
    on = places[sure] + tally.way[UPON][sure] / upon[sure, None]
    depth = np.zeros(surface.depth.size, dtype=np.float32)
    depth[seen[sure]] = (surface.world_from_camera.inverse() @ on.astype(np.float64))[:, 2]
    depth = depth.reshape(surface.depth.shape)
    return replace(surface, depth=depth, is_seen=depth > 0)


def filled(depth: NDArray[np.float32], picture: NDArray[np.uint8]) -> NDArray[np.float32]:
    """(H, W) `depth` where it is not 0, and what goes on from there elsewhere.

    Args:
        depth: (H, W), not all 0.
        picture: (H, W, 3) uint8: its edges are where surfaces may end.
    """
    height, width = depth.shape
    rows, columns = -(-height // CELL_PX), -(-width // CELL_PX)
    known = depth > 0
    inverse = np.where(known, 1 / np.maximum(depth, 1e-9), 0.0)
    cell = (np.arange(height) // CELL_PX)[:, None] * columns + np.arange(width) // CELL_PX
    count = np.bincount(cell[known], minlength=rows * columns)
    mean = np.bincount(cell[known], inverse[known], rows * columns) / np.maximum(count, 1)
    size = (columns, rows)
    grey = cv2.resize(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY), size, interpolation=cv2.INTER_AREA)
    stiffness = _stiffness(grey.astype(np.float64))
    pull = SEEN_PULL * (count > 0)
    solved = np.asarray(spsolve((stiffness + diags_array(pull)).tocsc(), pull * mean))
    coarse = solved.reshape(rows, columns).astype(np.float32)
    smooth = cv2.resize(coarse, (columns * CELL_PX, rows * CELL_PX), interpolation=cv2.INTER_LINEAR)
    whole = 1 / np.maximum(smooth[:height, :width], 1e-9)
    return np.where(known, depth, whole).astype(np.float32)


def _stiffness(grey: NDArray[np.float64]) -> coo_array:
    """Laplacian of the grid of cells, loose across edges of the picture."""
    rows, columns = grey.shape
    place = np.arange(rows * columns).reshape(rows, columns)
    pairs = [(place[:, :-1], place[:, 1:]), (place[:-1], place[1:])]
    one = np.concatenate([a.ravel() for a, _ in pairs])
    other = np.concatenate([b.ravel() for _, b in pairs])
    flat = grey.ravel()
    weight = np.exp(-np.abs(flat[one] - flat[other]) / EDGE_UNITS) + 1e-4
    ends = np.concatenate([one, other, one, other]), np.concatenate([one, other, other, one])
    values = np.concatenate([weight, weight, -weight, -weight])
    return coo_array((values, ends), shape=(flat.size, flat.size))


@dataclass(frozen=True, slots=True, eq=False)
class Verdict:
    """Verdict of views on N points.

    Attributes:
        is_stray: (N,) bool: more views see through it than see it on a surface.
        offset: (N, 3) float32: the way to the surface that it is a little off, 0 for all others.
    """

    is_stray: NDArray[np.bool_]
    offset: NDArray[np.float32]


def judge(points: NDArray[np.floating], surfaces: Sequence[Surface]) -> Verdict:
    """Find the points that hang in front of what views see, and those a little off it.

    A view says nothing about what lies well behind its surface: that is hidden.

    Args:
        points: (N, 3) in the surfaces' world.
        surfaces: of several views.
    """
    places = np.asarray(points, dtype=np.float32)
    tally = _Tally(len(places))
    for surface in surfaces:
        tally.add(surface, places)
    before, upon, behind, guessed_before, guessed_upon = tally.counts
    # Filled depth is asked only where stereo has seen nothing.
    is_unseen = before + upon + behind == 0
    is_before = (before >= MIN_VIEWS) & (before > upon)
    is_before |= is_unseen & (guessed_before >= MIN_VIEWS) & (guessed_before > guessed_upon)
    close, reach = tally.close, tally.way
    is_near = is_before & (2 * close[BEFORE] > before) & ~is_unseen
    is_behind = (close[BEHIND] >= MIN_VIEWS) & (before + upon == 0)
    offset = np.zeros((len(places), 3), dtype=np.float32)
    for side, off in ((BEFORE, is_near), (BEHIND, is_behind)):
        offset[off] = reach[side][off] / close[side][off, None]
    return Verdict(is_before & ~is_near, offset)


class _Tally:
    """Votes of views about N places.

    Attributes:
        counts: (5, N): views whose seen surface lies behind, at, before the place; and whose filled
            one lies behind, at it.
        close: (3, N): views whose seen surface lies a little behind, at, a little before the place.
        way: (3, N, 3): sums of the ways to those surfaces.
    """

    def __init__(self, count: int) -> None:
        self.counts = np.zeros((5, count), dtype=np.int32)
        self.close = np.zeros((3, count), dtype=np.int32)
        self.way = np.zeros((3, count, 3), dtype=np.float32)

    def add(self, surface: Surface, places: NDArray[np.float32]) -> None:
        """A view's votes."""
        index, at, z, rays = _seen_by(surface, places)
        depth, is_seen = surface.depth[at], surface.is_seen[at]
        ahead = (depth - z) / np.maximum(depth, 1e-9)
        votes = (
            is_seen & (ahead > SEEN_SLACK),
            is_seen & (np.abs(ahead) <= SEEN_SLACK),
            is_seen & (ahead < -SEEN_SLACK),
            ~is_seen & (ahead > FILLED_SLACK),
            ~is_seen & (np.abs(ahead) <= FILLED_SLACK),
        )
        for count, vote in zip(self.counts, votes, strict=True):
            count[index] += vote
        for side, vote in enumerate(votes[:3]):
            off = vote & (np.abs(ahead) < REACH)
            self.close[side, index[off]] += 1
            step = ahead[off] * depth[off] / z[off]
            self.way[side, index[off]] += step[:, None] * rays[off]


def _seen_by(
    surface: Surface, places: NDArray[np.float32]
) -> tuple[
    NDArray[np.intp],
    tuple[NDArray[np.int32], NDArray[np.int32]],
    NDArray[np.float32],
    NDArray[np.float32],
]:
    """Project places into a picture: which fall in, their pixels, z, and ways from the eye."""
    camera = surface.camera
    rays = places - surface.world_from_camera.translation.astype(np.float32)
    x, y, z = surface.world_from_camera.rotation.astype(np.float32).T @ rays.T
    with np.errstate(divide="ignore", invalid="ignore"):
        column = np.floor(camera.fx * x / z + camera.cx)
        row = np.floor(camera.fy * y / z + camera.cy)
    inside = (z > 0) & (column >= 0) & (column < camera.width_px)
    inside &= (row >= 0) & (row < camera.height_px)
    index = np.flatnonzero(inside)
    at = row[index].astype(np.int32), column[index].astype(np.int32)
    return index, at, z[index], rays[index]
