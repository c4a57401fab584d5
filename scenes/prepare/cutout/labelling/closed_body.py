"""Finds the object that somebody clicked on: the body that ends, however far one looks around it.

A room's floor, walls and tables go on beyond any ball around a click, an object does not. So the
surfaces around the click are labelled in balls of growing radius: what lies outside a ball is the
room, a flat patch that goes on outside is the room's too, and the cheapest cut along creases and
steps of colour (`graph_cut`) divides the rest. The first ball in which what was clicked ends, and
does not grow any more in the next, holds the object; so does a larger one, if the body holds on to
the room by much less there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.package.records import ViewPoint
from scenes.pose import Pose
from scenes.prepare.cutout.labelling.cell_odds import colour_odds, going_on
from scenes.prepare.cutout.labelling.ending_bodies import ending_bodies
from scenes.prepare.cutout.labelling.graph_cut import cut
from scenes.prepare.cutout.labelling.outlines import separated
from scenes.prepare.cutout.labelling.separate import Separation
from scenes.prepare.cutout.labelling.surface_cells import (
    MIN_HOLD,
    SIDES_M,
    SurfaceCells,
    links_between,
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

PRIOR = 0.5
"""Log odds that a surface inside the ball is the clicked object's, before anything is known."""

GOES_ON_COST = 2.0
"""Cost of taking a cell of a flat patch that goes on outside the ball. Measured: 1 to 4 give the
same in three rooms."""

SMOOTHNESS = 2.0
"""Cost of separating two cells that hold fast. Measured: 1 to 4 give the same within 0.01."""

BESIDE = 0.1
"""Of the body's size: how far beside it another that ends, too, may be a part of it."""

CLOSED = 0.03
"""The same for the clicked body to end inside the ball, as one that hardly touches it does."""

HELD = 0.7
"""Of the cells around the click: the body has to hold so many, or it is a speck on it."""

GROWTH = 1.6
"""How much larger the body's area may be in the next ball to be the same body."""

LOOSER = 0.5
"""Share of its attachment to the room at which the same body in a larger ball is more of the
object: a seat's post and base, a table's. Measured on 59 clicks in eight rooms: 0.2 to 0.9 give the
same within 0.01."""

MIN_CELLS = 40
"""Of a body that counts; a mug in its ball has ten times as many."""

ROUNDS = 2
"""Cuts: the first by shape, the second by the colours of what the first found, too."""


def _directions() -> FloatArray:
    """(200, 3) unit vectors, evenly spread by the golden angle."""
    k = np.arange(200) + 0.5
    height, turn = 1.0 - k / 100.0, k * np.pi * (3.0 - np.sqrt(5.0))
    ring = np.sqrt(1.0 - height**2)
    around = [ring * np.cos(turn), ring * np.sin(turn), height]
    return np.stack(around, axis=1).astype(np.float64)


EVENLY = _directions()
"""Points of a ball that views are cropped to."""


@dataclass(frozen=True, slots=True, eq=False)
class _Body:
    """Body found in one ball.

    Attributes:
        cells: of all surfaces there.
        labels: (N,) those of the body.
        inside: (N,) those inside the ball.
        clicked: (N,) those at the click.
        radius_m: of the ball.
        openness: links to the outside for each of its cells, and how far it lacks the click.
        attachment: strength of the links that it was cut from the room along, of those within it.
    """

    cells: SurfaceCells
    labels: BoolArray
    inside: BoolArray
    clicked: BoolArray
    radius_m: float
    openness: float
    attachment: float

    @property
    def is_closed(self) -> bool:
        """Whether it ends there, and is no speck."""
        return self.openness < CLOSED and int(self.labels.sum()) >= MIN_CELLS

    @property
    def area_m2(self) -> float:
        """Of the surface that was seen, within a cell's roughness."""
        return float(self.labels.sum()) * self.cells.side_m**2

    def is_as_large_as(self, other: _Body) -> bool:
        """Whether it may be the same body, found in another ball."""
        return 1 / GROWTH < self.area_m2 / other.area_m2 < GROWTH


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
    centre = np.median(clicked, axis=0)
    body = _closed(cloud, centre, viewpoints=viewpoints, renderer=renderer)
    if body is None:
        raise ValueError(
            f"what was clicked on does not end within {RADII_M[-1]:g} m: it is a wall, a floor or "
            "grown together with one; draw a box around the object in two views"
        )
    means = cloud.means.astype(np.float64)
    return separated(
        cloud,
        body.cells,
        labels=body.labels,
        inside=body.inside,
        sure=body.clicked,
        within=np.linalg.norm(means - centre, axis=1) < body.radius_m,
        renderer=renderer,
    )


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


def _closed(
    cloud: SplatCloud,
    centre: FloatArray,
    *,
    viewpoints: Sequence[ViewPoint],
    renderer: NativeRenderer,
) -> _Body | None:
    """The body in the first ball in which it ends and that the next ball confirms.

    Of larger balls that do as well the one in which it holds on to the room by less. If none is
    confirmed, the first in which it ends.
    """
    first: _Body | None = None
    last: _Body | None = None
    found: _Body | None = None
    for radius_m in RADII_M:
        body = _body_in(cloud, centre, radius_m=radius_m, viewpoints=viewpoints, renderer=renderer)
        if found is None and last is not None and body is not None and body.is_as_large_as(last):
            found = last
        closed = body if body is not None and body.is_closed else None
        if found is None:
            first, last = first or closed, closed
        elif closed is None or not closed.is_as_large_as(found):
            break
        elif closed.attachment < LOOSER * found.attachment:
            found = closed
    return found or first


def _body_in(
    cloud: SplatCloud,
    centre: FloatArray,
    *,
    radius_m: float,
    viewpoints: Sequence[ViewPoint],
    renderer: NativeRenderer,
) -> _Body | None:
    """The clicked body in a ball; None where hardly any surface is seen."""
    reach = 1.5 * radius_m
    cells = surface_cells(
        cloud,
        viewpoints,
        around=centre + 0.8 * radius_m * EVENLY,
        corners=(centre - reach, centre + reach),
        side_m=float(np.clip(radius_m / CELLS_ACROSS, *SIDES_M)),
        renderer=renderer,
    )
    return _body_at(cells, centre=centre, radius_m=radius_m) if len(cells) >= MIN_CELLS else None


def _body_at(cells: SurfaceCells, *, centre: FloatArray, radius_m: float) -> _Body:
    """The clicked body, if all outside a ball were the room."""
    apart = np.linalg.norm(cells.places - centre, axis=1)
    inside = apart < radius_m
    clicked = apart < max(2.0 * cells.side_m, apart.min() + 0.5 * cells.side_m)
    links = links_between(cells)
    shape = np.where(inside, PRIOR - (PRIOR + GOES_ON_COST) * going_on(cells, inside), -np.inf)
    belief = np.where(clicked, np.inf, shape)
    labels = clicked
    openness = np.inf
    for _ in range(ROUNDS):
        labels, openness = ending_bodies(
            cells,
            cut(belief, links, smoothness=SMOOTHNESS),
            meant=clicked.astype(np.float64),
            inside=inside,
            links=links,
            beside=BESIDE,
        )
        odds = colour_odds(cells.colours, labels)
        belief = np.where(inside & ~clicked, shape + odds, belief)
    around = inside & (apart < max(radius_m / 4, 3.0 * cells.side_m))
    if not around.any() or labels[around].mean() < HELD:
        openness = np.inf
    first, second, strength = links
    across, within = labels[first] != labels[second], labels[first] & labels[second]
    attachment = float(strength[across].sum() / max(strength[within].sum(), MIN_HOLD))
    return _Body(cells, labels, inside, clicked, radius_m, openness, attachment)
