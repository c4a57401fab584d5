"""Finds the object that somebody clicked on: the body that ends, however far one looks around it.

A room's floor, walls and tables go on beyond any ball around a click, an object does not. So the
surfaces around the click are labelled in balls of growing radius: what lies outside a ball is the
room, a flat patch that goes on outside is the room's too, and the cheapest cut along creases and
steps of colour (`graph_cut`) divides the rest. The first ball in which what was clicked ends, and
does not grow any more in the next, holds the object.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.package.records import ViewPoint
from scenes.pose import Pose
from scenes.prepare.cells import nearest
from scenes.prepare.cutout.connected_bodies import bodies
from scenes.prepare.cutout.labelling.graph_cut import Links, cut
from scenes.prepare.cutout.labelling.separate import Separation
from scenes.prepare.cutout.labelling.surface_cells import (
    SurfaceCells,
    links_between,
    splats_of_cells,
    surface_cells,
)
from scenes.prepare.cutout.marks.prompted_views import PromptedView
from scenes.prepare.cutout.votes.silhouettes import points_drawn
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats
from scenes.splats import SplatCloud

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

RADII_M = (0.12, 0.2, 0.33, 0.55, 0.9, 1.4)
"""Of the balls, each two thirds larger than the one before: from a mug to a table or a sofa."""

CELLS_ACROSS = 25
"""Cells from a ball's middle to its end."""

SIDES_M = (0.004, 0.02)
"""Smallest and largest side of a cell: finer than the splats' noise nothing is seen, and larger
ones swallow a chair's legs."""

PRIOR = 0.5
"""Log odds that a surface inside the ball is the clicked object's, before anything is known."""

GOES_ON_COST = 2.0
"""Cost of taking a cell of a flat patch that goes on outside the ball. Measured: 1 to 4 give the
same in three rooms."""

GOES_ON_SHARE = 0.15
"""Of a flat patch: so much of it outside the ball means that it goes on."""

SMOOTHNESS = 2.0
"""Cost of separating two cells that hold fast. Measured: 1 to 4 give the same within 0.01."""

MAX_COLOUR_ODDS = 2.0
"""Log odds that a colour may say: objects and rooms share colours."""

BINS = 12
"""Of each channel, in which colours are counted; as wide as exposure and noise scatter them."""

MIN_PATCH = 60
"""Cells of a flat patch: eight by eight."""

MAX_PATCHES = 24
"""Planes that are looked for, the largest first."""

SAMPLED = 3000
"""Cells among which a plane is looked for; of more, so many are drawn."""

TRIALS = 100
"""Cells whose tangent plane is tried as a plane."""

THICKNESS = 1.5
"""In sides of a cell, half the thickness of a plane at most."""

GAP = 3.0
"""Cells farther apart than so many sides belong to different bodies."""

BESIDE = 0.1
"""Of the body's size: how far beside it another that ends, too, may be a part of it."""

TOUCHING = 0.05
"""Links to the outside for a cell of a body: with more it goes on there."""

CLOSED = 0.03
"""The same for the clicked body to end inside the ball, as one that hardly touches it does."""

HELD = 0.7
"""Of the cells around the click: the body has to hold so many, or it is a speck on it."""

GROWTH = 1.6
"""How much larger the body's area may be in the next ball to be the same body."""

MIN_CELLS = 40
"""Of a body that counts; a mug in its ball has ten times as many."""

ROUNDS = 2
"""Cuts: the first by shape, the second by the colours of what the first found, too."""


@dataclass(frozen=True, slots=True, eq=False)
class _Body:
    """Body found in one ball.

    Attributes:
        cells: of all surfaces there.
        labels: (N,) those of the body.
        openness: links to the outside for each of its cells, and how far it lacks the click.
    """

    cells: SurfaceCells
    labels: BoolArray
    openness: float

    @property
    def is_closed(self) -> bool:
        """Whether it ends there, and is no speck."""
        return self.openness < CLOSED and int(self.labels.sum()) >= MIN_CELLS

    @property
    def area_m2(self) -> float:
        """Of the surface that was seen, within a cell's roughness."""
        return float(self.labels.sum()) * self.cells.side_m**2


def closed_body(
    cloud: SplatCloud,
    views: Sequence[PromptedView],
    *,
    viewpoints: Sequence[ViewPoint],
    renderer: NativeRenderer,
) -> Separation:
    """The splats of the body that was clicked on.

    Args:
        cloud: the whole room, metres.
        views: with clicks on the object.
        viewpoints: of the room.
        renderer: draws the room.

    Raises:
        ValueError: there is nothing where somebody clicked, or nothing that ends.
    """
    clicked = np.concatenate([_clicked_points(cloud, view, renderer=renderer) for view in views])
    if not len(clicked):
        names = ", ".join(view.name for view in views)
        raise ValueError(f"nothing is drawn where you clicked in {names}; click on the object")
    body = _smallest_closed(
        cloud, np.median(clicked, axis=0), viewpoints=viewpoints, renderer=renderer
    )
    if body is None:
        raise ValueError(
            f"what was clicked on does not end within {RADII_M[-1]:g} m: it is a wall, a floor or "
            "grown together with one; draw a box around the object in two views"
        )
    labels = splats_of_cells(cloud, body.cells, labels=body.labels)
    none = np.zeros_like(labels)
    return Separation(labels, none, none, ())


def _clicked_points(
    cloud: SplatCloud, view: PromptedView, *, renderer: NativeRenderer
) -> FloatArray:
    """(K, 3) world points of what is drawn where somebody clicked."""
    drawn = renderer.render(
        [PosedSplats(cloud, Pose.identity())], view.camera, view.world_from_camera
    )
    points, is_drawn = points_drawn(
        view.camera, view.world_from_camera, drawn.depth, view.prompt.inside_px
    )
    return points[is_drawn]


def _smallest_closed(
    cloud: SplatCloud,
    centre: FloatArray,
    *,
    viewpoints: Sequence[ViewPoint],
    renderer: NativeRenderer,
) -> _Body | None:
    """The body in the first ball in which it ends and that the next ball confirms.

    If there is none, the first in which it ends.
    """
    first: _Body | None = None
    last: _Body | None = None
    for radius in RADII_M:
        side = float(np.clip(radius / CELLS_ACROSS, *SIDES_M))
        cells = surface_cells(
            cloud, viewpoints, centre=centre, radius_m=radius, side_m=side, renderer=renderer
        )
        body = _body_at(cells, centre=centre, radius_m=radius) if len(cells) >= MIN_CELLS else None
        grown = 0.0 if last is None or body is None else body.area_m2 / last.area_m2
        if 1 / GROWTH < grown < GROWTH:
            return last
        last = body if body is not None and body.is_closed else None
        first = first or last
    return first


def _body_at(cells: SurfaceCells, *, centre: FloatArray, radius_m: float) -> _Body:
    """The clicked body, if all outside a ball were the room."""
    apart = np.linalg.norm(cells.places - centre, axis=1)
    inside = apart < radius_m
    clicked = apart < max(2.0 * cells.side_m, apart.min() + 0.5 * cells.side_m)
    links = links_between(cells)
    shape = np.where(inside, PRIOR - (PRIOR + GOES_ON_COST) * _going_on(cells, inside), -np.inf)
    belief = np.where(clicked, np.inf, shape)
    labels = clicked
    openness = np.inf
    for _ in range(ROUNDS):
        labels, openness = _clicked_body(
            cells,
            cut(belief, links, smoothness=SMOOTHNESS),
            clicked=clicked,
            inside=inside,
            links=links,
        )
        odds = _colour_odds(cells.colours, labels)
        belief = np.where(inside & ~clicked, shape + odds, belief)
    around = inside & (apart < max(radius_m / 4, 3.0 * cells.side_m))
    if not around.any() or labels[around].mean() < HELD:
        openness = np.inf
    return _Body(cells, labels, openness)


def _clicked_body(
    cells: SurfaceCells,
    labels: BoolArray,
    *,
    clicked: BoolArray,
    inside: BoolArray,
    links: Links,
) -> tuple[BoolArray, float]:
    """The clicked body and those beside it that end, too; and its links to the outside per cell."""
    chosen = np.flatnonzero(labels)
    count, body = bodies(cells.places[chosen], GAP * cells.side_m)
    body_of = np.full(len(cells), -1)
    body_of[chosen] = body
    main = int(np.bincount(body_of[clicked & labels]).argmax())
    first, second, _ = links
    ends = np.concatenate([first, second]), np.concatenate([second, first])
    leaves = (body_of[ends[0]] >= 0) & ~inside[ends[1]]
    size = np.bincount(body, minlength=count)
    openness = np.bincount(body_of[ends[0][leaves]], minlength=count) / size
    own = cells.places[chosen[body == main]]
    to_main, _ = nearest(cells.places[chosen], own)
    beside = np.full(count, np.inf)
    np.minimum.at(beside, body, to_main[:, 0])
    reach = BESIDE * float(np.ptp(own, axis=0).max())
    kept = (openness < TOUCHING) & (beside <= reach)
    kept[main] = True
    found = np.zeros_like(labels)
    found[chosen] = kept[body]
    return found, float(openness[main])


def _colour_odds(colours: FloatArray, labels: BoolArray) -> FloatArray:
    """(N,) log odds of each colour between labelled cells and all others."""
    place = np.clip((colours * BINS).astype(np.intp), 0, BINS - 1)
    bins = (place[:, 0] * BINS + place[:, 1]) * BINS + place[:, 2]
    shares: list[FloatArray] = []
    for part in (labels, ~labels):
        counted = np.bincount(bins[part], minlength=BINS**3).astype(np.float64)
        smooth = _blurred(counted.reshape(BINS, BINS, BINS)).ravel()
        # A colour that was never seen is as rare as one cell in a hundred.
        smooth += 0.01 * max(int(part.sum()), 1) / BINS**3
        shares.append((smooth / smooth.sum())[bins])
    return np.clip(np.log(shares[0] / shares[1]), -MAX_COLOUR_ODDS, MAX_COLOUR_ODDS)


def _blurred(counts: FloatArray) -> FloatArray:
    """Counts (B, B, B), each shared with the bins beside it: a half stays, a quarter each way."""
    for axis in range(counts.ndim):
        padded = np.pad(counts, [(int(a == axis),) * 2 for a in range(counts.ndim)], mode="edge")
        low, middle, high = (
            np.take(padded, range(start, start + counts.shape[axis]), axis=axis)
            for start in range(3)
        )
        counts = 0.25 * low + 0.5 * middle + 0.25 * high
    return counts


def _going_on(cells: SurfaceCells, inside: BoolArray) -> FloatArray:
    """(N,) how sure it is that a cell's flat patch goes on outside the ball, 0..1."""
    patch, count = _flat_patches(cells)
    flat = patch >= 0
    if not count:
        return np.zeros(len(cells))
    size = np.bincount(patch[flat], minlength=count)
    outside = np.bincount(patch[flat], weights=~inside[flat], minlength=count)
    share = np.clip(outside / np.maximum(size, 1) / GOES_ON_SHARE, 0.0, 1.0)
    return np.where(flat, share[np.maximum(patch, 0)], 0.0)


def _flat_patches(cells: SurfaceCells) -> tuple[NDArray[np.intp], int]:
    """(N,) number of the flat patch that a cell lies in, -1 if in none; and how many there are.

    Planes by trial (Fischler and Bolles 1981), the largest first, each divided where it has gaps.
    """
    rng = np.random.default_rng(0)
    patch, count = np.full(len(cells), -1, dtype=np.intp), 0
    left = np.arange(len(cells))
    for _ in range(MAX_PATCHES):
        if len(left) < MIN_PATCH:
            break
        sample = left if len(left) <= SAMPLED else rng.choice(left, SAMPLED, replace=False)
        found = _largest_plane(cells, sample, rng=rng)
        if found is None or found[2] * len(left) / len(sample) < MIN_PATCH:
            break
        point, normal, _, thick_m = found
        on = np.abs((cells.places[left] - point) @ normal) < thick_m
        on &= cells.normals[left] @ normal > 0.8
        members = left[on]
        if len(members):
            parts, part = bodies(cells.places[members], 2.0 * cells.side_m)
            is_large = np.bincount(part, minlength=parts) >= MIN_PATCH // 2
            patch[members] = np.where(is_large[part], count + part, -1)
            count += parts
        left = left[~on]
    return patch, count


def _largest_plane(
    cells: SurfaceCells, sample: NDArray[np.intp], *, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray, int, float] | None:
    """Point, normal, number of sampled cells on it, and half the thickness of the largest plane."""
    places, normals = cells.places[sample], cells.normals[sample]
    most = THICKNESS * cells.side_m
    tried = rng.choice(len(sample), min(TRIALS, len(sample)), replace=False)
    offsets = np.einsum("kj,kj->k", places[tried], normals[tried])
    near = np.abs(places @ normals[tried].T - offsets) < most
    near &= normals @ normals[tried].T > 0.9
    on = near[:, int(np.argmax(near.sum(axis=0)))]
    if on.sum() < 3:
        return None
    point, normal = _plane_through(places[on], normals[on])
    for _ in range(2):
        refined = (np.abs((places - point) @ normal) < most) & (normals @ normal > 0.85)
        if refined.sum() < 3:
            break
        on = refined
        point, normal = _plane_through(places[on], normals[on])
    off = np.abs((places[on] - point) @ normal)
    thick_m = min(most, 2.5 * max(1.4826 * float(np.median(off)), 0.25 * cells.side_m))
    return point, normal, int(on.sum()), thick_m


def _plane_through(places: FloatArray, normals: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Point and normal of the plane of least squares, on the side to which normals point."""
    point = places.mean(axis=0)
    normal = np.linalg.svd(places - point, full_matrices=False)[2][2]
    return point, normal * np.sign((normals @ normal).mean())
