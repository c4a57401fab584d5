"""Finds the splats of one thing from its masks in a few views, hidden ones included.

Masks are lifted to votes of the splats that can be seen (as FlashSplat, Shen et al. 2024, weighs
them); silhouettes speak for those that cannot; a graph cut on neighbourhood and colour decides, and
the body that the masks mean most is kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from scenes.prepare.graph_cut import cut, neighbour_links
from scenes.prepare.lifting import MaskedView, Vote, lift, share
from scenes.render.native import NativeRenderer
from scenes.splats import SplatCloud

AGREEMENT = 0.7
"""Least overlap (IoU) of a view's mask with what the other views find; else it is left out."""
FULL_SIGHT = 0.5
"""Blend weight, in pixels, from which on a vote counts half."""
VOTE_COST = 4.0
OUTSIDE_COST = 1.5
"""For each view in which a splat lies outside the mask in front of whatever is drawn there."""
BEHIND_COST = 0.15
"""The same behind what is drawn there: the thing in front may hide a part of the object."""
SMOOTHNESS = 1.0
DEPTH_SLACK_M = 0.03
LINK_REACH_M = 0.06
"""Splats farther apart than this belong to different bodies."""
SPECK = 0.02
"""Bodies with less than this share of the main body's votes are floaters."""


@dataclass(frozen=True, slots=True)
class ViewVerdict:
    """How a view's mask fits the others: IoU of mask and lifted thing, and whether it was used."""

    name: str
    agreement: float
    used: bool


@dataclass(frozen=True, slots=True, eq=False)
class Separation:
    """One thing found among splats.

    Attributes:
        labels: (N,) bool, True for its splats.
        floaters: (N,) bool, stray splats beside it that no body holds; not in `labels`.
        views: what became of each view.
    """

    labels: NDArray[np.bool_]
    floaters: NDArray[np.bool_]
    views: tuple[ViewVerdict, ...]


def separate(
    cloud: SplatCloud, views: Sequence[MaskedView], *, renderer: NativeRenderer
) -> Separation:
    """Find the splats of the thing that the masks show.

    Args:
        cloud: the whole room, any length unit close to metres.
        views: from different sides; two or three are enough.
        renderer: draws the room.

    Raises:
        ValueError: no view, or nothing but empty space lies in the masks.
    """
    if not views:
        raise ValueError("no view with a mask; draw a box around the object in one to three views")
    empty = [view.name for view in views if not view.mask.any()]
    if len(empty) == len(views):
        raise ValueError(
            f"the mask is empty in {', '.join(empty)}; draw the box around the whole object"
        )
    votes = [lift(cloud, view, renderer=renderer) for view in views]
    near = _candidates(cloud, votes)
    if not near.any():
        raise ValueError(
            "no splats lie inside the masks: there is no object in this place; "
            "choose views in which it is seen"
        )
    used = list(range(len(views)))
    labels = _decide(cloud, near, views, votes, used, renderer)
    verdicts = [ViewVerdict(view.name, 1.0, True) for view in views]
    if len(views) > 2:
        verdicts = _judge(cloud, near, views, votes, renderer)
        used = [k for k, verdict in enumerate(verdicts) if verdict.used]
        if len(used) < len(views):
            labels = _decide(cloud, near, views, votes, used, renderer)
    labels, floaters = _main_body(cloud, labels, [votes[k] for k in used])
    return Separation(labels, floaters, tuple(verdicts))


def _candidates(cloud: SplatCloud, votes: Sequence[Vote]) -> NDArray[np.bool_]:
    """Splats worth deciding about: the seen part's bounding box, with room around it."""
    inside, seen = _summed(votes)
    core = inside > 0.5 * np.maximum(seen, 1e-3)
    if not core.any():
        return core
    weights = inside[core]
    low, high = _weighted_range(cloud.means[core], weights)
    reach = 0.25 * (high - low) + 0.05
    return ((cloud.means > low - reach) & (cloud.means < high + reach)).all(axis=1)


def _weighted_range(
    points: NDArray[np.float32], weights: NDArray[np.float32]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(3,) lowest and highest corner, without the outermost 0.2 % of the weight on each side."""
    corners = np.zeros((2, 3))
    for axis in range(3):
        order = np.argsort(points[:, axis])
        running = np.cumsum(weights[order]) / weights.sum()
        picks = np.searchsorted(running, (0.002, 0.998))
        corners[:, axis] = points[order[np.minimum(picks, len(order) - 1)], axis]
    return corners[0], corners[1]


def _summed(votes: Sequence[Vote]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    return sum(v.inside for v in votes), sum(v.seen for v in votes)  # pyright: ignore[reportReturnType]


def _decide(
    cloud: SplatCloud,
    near: NDArray[np.bool_],
    views: Sequence[MaskedView],
    votes: Sequence[Vote],
    used: Sequence[int],
    renderer: NativeRenderer,
) -> NDArray[np.bool_]:
    chosen = np.flatnonzero(near)
    inside, seen = _summed([votes[k] for k in used])
    sight = seen[chosen] / (seen[chosen] + FULL_SIGHT)
    lean = 2 * inside[chosen] / np.maximum(seen[chosen], 1e-6) - 1
    belief = VOTE_COST * sight * lean
    for k in used:
        belief -= _outside_cost(cloud, chosen, views[k], renderer)
    links = neighbour_links(cloud.means[chosen], cloud.colours()[chosen])
    labels = np.zeros(len(cloud), dtype=bool)
    labels[chosen] = cut(belief, links, smoothness=SMOOTHNESS)
    return labels


def _outside_cost(
    cloud: SplatCloud, chosen: NDArray[np.intp], view: MaskedView, renderer: NativeRenderer
) -> NDArray[np.float64]:
    """Cost of calling splats the object although the view's silhouette leaves them out."""
    from scenes.pose import Pose
    from scenes.render.renderer import PosedSplats

    points = view.world_from_camera.inverse() @ cloud.means[chosen].astype(np.float64)
    pixels, valid = view.camera.project(points)
    column = np.floor(pixels[:, 0]).astype(int)
    row = np.floor(pixels[:, 1]).astype(int)
    valid &= (column >= 0) & (column < view.camera.width_px)
    valid &= (row >= 0) & (row < view.camera.height_px)
    drawn = renderer.render(
        [PosedSplats(cloud, Pose.identity())], view.camera, view.world_from_camera
    )
    cost = np.zeros(len(chosen))
    at = row[valid], column[valid]
    outside = ~view.mask[at]
    in_front = points[valid, 2] < drawn.depth[at] + DEPTH_SLACK_M
    cost[valid] = outside * np.where(in_front, OUTSIDE_COST, BEHIND_COST)
    return cost


def _judge(
    cloud: SplatCloud,
    near: NDArray[np.bool_],
    views: Sequence[MaskedView],
    votes: Sequence[Vote],
    renderer: NativeRenderer,
) -> list[ViewVerdict]:
    """Compares each view's mask with the thing that the others find."""
    verdicts = []
    for k, view in enumerate(views):
        others = [j for j in range(len(views)) if j != k]
        labels = _decide(cloud, near, views, votes, others, renderer)
        seen = share(cloud, labels, view.camera, view.world_from_camera, renderer=renderer) > 0.5
        union = (seen | view.mask).sum()
        agreement = float((seen & view.mask).sum() / union) if union else 0.0
        verdicts.append(ViewVerdict(view.name, agreement, agreement >= AGREEMENT))
    if sum(verdict.used for verdict in verdicts) < 2:
        best = sorted(verdicts, key=lambda verdict: -verdict.agreement)[:2]
        verdicts = [ViewVerdict(v.name, v.agreement, v in best) for v in verdicts]
    return verdicts


def _main_body(
    cloud: SplatCloud, labels: NDArray[np.bool_], votes: Sequence[Vote]
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """The connected body with most votes, and others of weight; the rest floats."""
    chosen = np.flatnonzero(labels)
    if not len(chosen):
        raise ValueError(
            "the masks and the splats do not agree on any object; draw the boxes closer around it"
        )
    pairs = cKDTree(cloud.means[chosen]).query_pairs(LINK_REACH_M, output_type="ndarray")
    n = len(chosen)
    graph = csr_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    count, body = connected_components(graph, directed=False)
    inside, _ = _summed(votes)
    weight = np.bincount(body, weights=inside[chosen], minlength=count)
    kept = weight >= SPECK * weight.max()
    result, floaters = np.zeros_like(labels), np.zeros_like(labels)
    result[chosen[kept[body]]] = True
    floaters[chosen[~kept[body]]] = True
    return result, floaters
