"""Finds the splats of one object from its masks in a few views, hidden ones included.

Masks are lifted to votes of the splats that can be seen (as FlashSplat, Shen et al. 2024, weighs
them); silhouettes and the plane that the object stands on speak for those that cannot; a graph cut
on neighbourhood and colour decides, and the body that the masks mean most is kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from scenes.prepare.cells import nearest
from scenes.prepare.cutout.colour_similarity import log_likelihood_ratio
from scenes.prepare.cutout.connected_bodies import bodies, linked
from scenes.prepare.cutout.labelling.above_ground import (
    AROUND_M,
    FREE_SHARE,
    planes_around,
)
from scenes.prepare.cutout.labelling.graph_cut import Links, cut, neighbour_links
from scenes.prepare.cutout.labelling.outliers import outliers
from scenes.prepare.cutout.level_planes import on_planes
from scenes.prepare.cutout.marks.masked_view import MaskedView
from scenes.prepare.cutout.votes.lifting import FULL_SIGHT, Vote, lift
from scenes.prepare.cutout.votes.silhouettes import (
    BOX_SLACK,
    CORE,
    ViewVerdict,
    box_of,
    in_box,
    judge,
    points_drawn,
    silhouette,
)
from scenes.render.native import NativeRenderer
from scenes.splats import SplatCloud

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

VOTE_COST = 4.0
FREE_VOTE_COST = 1.0
"""The same for splats of a free-standing body, whose shape says more than its colours."""
STANDING_GAIN = 3.0
"""For splats of a free-standing body."""
OUTSIDE_COST = 1.5
"""For each view in which a splat lies outside the mask in front of whatever is drawn there."""
BEHIND_COST = 0.15
"""The same behind what is drawn there: what stands in front may hide a part of the object."""
HIDDEN_GAIN = 0.4
"""For a splat inside all boxes that no view shows."""
PLANE_COST = 1.0
"""For a splat that is seen in a plane which goes on far beyond the object."""
COLOUR_COST = 2.0
"""For a splat in such a plane, by how its colour fits the plane around or the object above."""
PLAIN_SIGHT = 5.0
"""Blend weight, in pixels, from which on a splat is half as sure to be seen in a plane."""
HELD_BY_BOX = 0.95
"""Of what the masks mean: what a box has to hold to be heeded without its mask."""
MUST = 1e6
"""Weight that no other outweighs, for splats outside of all boxes."""
SMOOTHNESS = 1.0
"""Weight of the links between neighbours against the splats' own votes."""
LINK_REACH_M = 0.06
"""Splats farther apart than this belong to different bodies."""
BESIDE_M = 0.05
"""Bodies may lie this far outside the main body's bounding box to belong to it."""
SPECK = 0.01
"""Bodies with less than this share of the main body's splats are floaters."""


@dataclass(frozen=True, slots=True, eq=False)
class Separation:
    """One object found among splats.

    Attributes:
        labels: (N,) bool, True for its splats.
        floaters: (N,) bool, stray splats beside it that no body holds; not in `labels`.
        outliers: (N,) bool, those of `labels` that hang beside it: `labelling.outliers`.
        views: what became of each view.
        masks: the views whose masks were used.
        own: (P, 3) points on its surface and around: (Q, 3) beside it, as many views agree about
            them; none where splats alone were looked at.
        notes: doubts about the marks, in words.
    """

    labels: BoolArray
    floaters: BoolArray
    outliers: BoolArray
    views: tuple[ViewVerdict, ...]
    masks: tuple[MaskedView, ...] = ()
    own: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    around: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    notes: tuple[str, ...] = ()


def separate(
    cloud: SplatCloud,
    views: Sequence[MaskedView],
    *,
    renderer: NativeRenderer,
) -> Separation:
    """Find the splats of the object that the masks show.

    Args:
        cloud: the whole room, metres, Z up.
        views: from different sides; two or three are enough.
        renderer: draws the room.

    Raises:
        ValueError: no view, or nothing but empty space lies in the masks.
    """
    if not views:
        raise ValueError("no view with a mask; draw a box around the object in one to three views")
    shown = [view for view in views if view.mask.any()]
    if not shown:
        raise ValueError(
            f"the mask is empty in {', '.join(view.name for view in views)}: there is no object in "
            "the box; draw it around the whole object"
        )
    votes = [lift(cloud, view, renderer=renderer) for view in shown]
    positions = cloud.means.astype(np.float64)
    verdicts = judge(positions, shown, votes)
    empty = tuple(ViewVerdict(v.name, 0.0, False) for v in views if not v.mask.any())
    used = [k for k, verdict in enumerate(verdicts) if verdict.used]
    dropped = [view for view, verdict in zip(shown, verdicts, strict=True) if not verdict.used]
    votes = [votes[k] for k in used]
    shown = [shown[k] for k in used]
    in_boxes = _in_boxes(positions, shown, dropped, votes)
    chosen = _candidates(positions, in_boxes, votes)
    if not len(chosen):
        raise ValueError(
            "no splats lie inside the masks: there is no object in this place; "
            "choose views in which it is seen"
        )
    links = neighbour_links(positions[chosen], cloud.colours()[chosen])
    belief = _belief(cloud, chosen, in_boxes[chosen], links, shown, votes)
    found = chosen[cut(belief, links, smoothness=SMOOTHNESS)]
    labels, floaters = _main_body(cloud, found, shown, votes)
    beside = outliers(cloud, labels, votes, in_boxes=in_boxes)
    return Separation(labels, floaters, beside, verdicts + empty, tuple(shown))


def _in_boxes(
    positions: FloatArray,
    views: Sequence[MaskedView],
    dropped: Sequence[MaskedView],
    votes: Sequence[Vote],
) -> BoolArray:
    """(N,) whether splats lie in the boxes of all views.

    The box of a view whose mask was left out is heeded where it holds what the other masks mean.
    """
    inner = np.ones(len(positions), dtype=bool)
    for view in views:
        box = box_of(view)
        inner &= in_box(positions, view.camera, view.world_from_camera, box, BOX_SLACK)
    inside, seen = _sum(votes)
    core = inner & (inside > CORE * np.maximum(seen, 1e-3))
    for view in dropped:
        if view.box_px is not None:
            box = view.box_px
            within = in_box(positions, view.camera, view.world_from_camera, box, BOX_SLACK)
            if inside[core & within].sum() >= HELD_BY_BOX * inside[core].sum():
                inner &= within
    return inner


def _candidates(
    positions: FloatArray, in_boxes: BoolArray, votes: Sequence[Vote]
) -> NDArray[np.intp]:
    """Places of the candidates: near what the masks show."""
    inside, seen = _sum(votes)
    core = in_boxes & (inside > CORE * np.maximum(seen, 1e-3))
    if not core.any():
        return np.zeros(0, dtype=np.intp)
    low, high = _weighted_range(positions[core], inside[core])
    # One view does not say how far back the object reaches; the boxes of two do.
    reach = (2.0 if len(votes) > 1 else 0.25) * (high - low).max() + 0.05
    near = ((positions > low - reach) & (positions < high + reach)).all(axis=1)
    inner = positions[near & in_boxes]
    low, high = inner.min(axis=0) - AROUND_M, inner.max(axis=0) + AROUND_M
    return np.flatnonzero(near & ((positions > low) & (positions < high)).all(axis=1))


def _weighted_range(
    points: FloatArray, weights: NDArray[np.floating]
) -> tuple[FloatArray, FloatArray]:
    """(3,) lowest and highest corner, without the outermost 0.5 % of the weight on each side."""
    corners = np.zeros((2, 3))
    for axis in range(3):
        order = np.argsort(points[:, axis])
        running = np.cumsum(weights[order]) / weights.sum()
        picks = np.searchsorted(running, (0.005, 0.995))
        corners[:, axis] = points[order[np.minimum(picks, len(order) - 1)], axis]
    return corners[0], corners[1]


def _sum(votes: Sequence[Vote]) -> tuple[FloatArray, FloatArray]:
    inside = np.stack([vote.inside for vote in votes]).astype(np.float64)
    seen = np.stack([vote.seen for vote in votes]).astype(np.float64)
    return inside.sum(axis=0), seen.sum(axis=0)


def _belief(
    cloud: SplatCloud,
    chosen: NDArray[np.intp],
    in_boxes: BoolArray,
    links: Links,
    views: Sequence[MaskedView],
    votes: Sequence[Vote],
) -> FloatArray:
    """(K,) what speaks for each candidate to be the object's, as costs of `graph_cut.cut`."""
    inside, seen = (total[chosen] for total in _sum(votes))
    sight = seen / (seen + FULL_SIGHT)
    lean = sight * (2 * inside / np.maximum(seen, 1e-6) - 1)
    positions = cloud.means[chosen].astype(np.float64)
    outside = np.zeros(len(chosen))
    for view, vote in zip(views, votes, strict=True):
        where = silhouette(positions, view, vote)
        cost = np.where(where.in_front, OUTSIDE_COST, BEHIND_COST)
        outside += np.where(where.framed & ~where.in_mask, cost, 0.0)
    flat = on_planes(positions, planes_around(cloud, positions[in_boxes]))
    free = _free_standing(cloud.select(chosen), links, in_boxes, ~flat)
    bound = VOTE_COST * lean - outside
    if len(views) > 1:
        bound += HIDDEN_GAIN * (1 - sight)
        bound = np.where(free, STANDING_GAIN + FREE_VOTE_COST * lean, bound)
    colours = cloud.colours()[chosen]
    # What lies in the plane unseen is likely the underside of another object.
    around = flat & ~in_boxes & (seen > FULL_SIGHT)
    ratio = log_likelihood_ratio(colours, like=free, unlike=around)
    plain = seen / (seen + PLAIN_SIGHT)
    of_foot = COLOUR_COST * ratio + HIDDEN_GAIN * (1 - sight) - PLANE_COST * plain
    return np.where(in_boxes, np.where(flat, of_foot, bound), -MUST)


def _free_standing(
    cloud: SplatCloud, links: Links, in_boxes: BoolArray, off_planes: BoolArray
) -> BoolArray:
    """(K,) the splats of bodies that lie inside all boxes once the planes are taken away.

    A body that goes on outside the boxes, such as the table that a chair was pushed under, is not
    free: there the masks have to decide.
    """
    first, second, _ = links
    apart = np.linalg.norm(cloud.means[first] - cloud.means[second], axis=1)
    held = off_planes[first] & off_planes[second] & (apart < LINK_REACH_M)
    count, body = linked(first[held], second[held], count=len(cloud))
    largest = np.sort(cloud.scales.astype(np.float64), axis=1)[:, 1:]
    area = largest.prod(axis=1) * cloud.opacities
    whole = np.bincount(body, weights=area, minlength=count)
    inner = np.bincount(body, weights=area * in_boxes, minlength=count)
    return off_planes & in_boxes & (inner >= FREE_SHARE * whole)[body]


def _main_body(
    cloud: SplatCloud,
    found: NDArray[np.intp],
    views: Sequence[MaskedView],
    votes: Sequence[Vote],
) -> tuple[BoolArray, BoolArray]:
    """The connected body that is meant, with what else lies beside it; specks there float.

    Meant is the body that was clicked on, or else the one with most votes.
    """
    if not len(found):
        raise ValueError(
            "the masks and the splats do not agree on any object; draw the boxes closer around it"
        )
    positions = cloud.means[found].astype(np.float64)
    count, body = bodies(positions, LINK_REACH_M)
    inside, _ = _sum(votes)
    main = int(np.argmax(np.bincount(body, weights=inside[found], minlength=count)))
    points = np.concatenate([_clicked(view, vote) for view, vote in zip(views, votes, strict=True)])
    if len(points):
        apart, which = nearest(points, positions)
        hit = which[apart < LINK_REACH_M]
        if len(hit):
            main = int(np.bincount(body[hit]).argmax())
    of_main = positions[body == main]
    low, high = of_main.min(axis=0) - BESIDE_M, of_main.max(axis=0) + BESIDE_M
    beside = ((positions > low) & (positions < high)).all(axis=1)
    large = np.bincount(body, minlength=count) >= SPECK * len(of_main)
    labels, floaters = np.zeros((2, len(cloud)), dtype=bool)
    labels[found[beside & large[body]]] = True
    floaters[found[beside & ~large[body]]] = True
    return labels, floaters


def _clicked(view: MaskedView, vote: Vote) -> FloatArray:
    """(K, 3) world points of what is drawn where somebody clicked on the object."""
    points, drawn = points_drawn(view.camera, view.world_from_camera, vote.depth, view.inside_px)
    return points[drawn]
