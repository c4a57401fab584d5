# pyright: standard
"""Projection of splats into views with masks, and how well the masks of several fit together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.prepare.cutout.marks.masked_view import MaskedView
from scenes.prepare.cutout.votes.lifting import Vote

BoolArray = NDArray[np.bool_]

MIN_OVERLAP = 0.75
"""Least share of what one mask shows that has to fall into another mask, and the other way."""
BOX_SLACK = 0.08
"""Of a box's size: how far the object may reach beyond the box that somebody drew."""
DEPTH_SLACK_M = 0.03
"""Depth behind the drawn surface up to which a point is seen, metres."""
CORE = 0.5
"""Share of a splat's light inside a mask from which on the mask means it."""


@dataclass(frozen=True, slots=True)
class ViewVerdict:
    """How a view's mask fits the others, 0..1, and whether it was used."""

    name: str
    overlap: float
    used: bool


@dataclass(frozen=True, slots=True, eq=False)
class Silhouette:
    """Relation of points to the mask of one view; all (N,) bool.

    Attributes:
        framed: in the picture.
        in_mask: on the mask.
        in_front: not behind what is drawn there.
    """

    framed: BoolArray
    in_mask: BoolArray
    in_front: BoolArray


def silhouette(points: NDArray[np.float64], view: MaskedView, vote: Vote) -> Silhouette:
    """Project world points (N, 3) into a view and its mask."""
    camera = view.camera
    in_camera = view.world_from_camera.inverse() @ points
    pixels, framed = camera.project(in_camera)
    row, column = _cells(camera, pixels)
    away = in_camera[:, 2] if isinstance(camera, Pinhole) else np.linalg.norm(in_camera, axis=1)
    return Silhouette(
        framed,
        framed & view.mask[row, column],
        framed & (away < vote.depth[row, column] + DEPTH_SLACK_M),
    )


def in_box(
    points: NDArray[np.float64],
    camera: Pinhole | Fisheye,
    world_from_camera: Pose,
    box_px: tuple[float, float, float, float],
    slack: float,
) -> BoolArray:
    """(N,) whether world points fall into a box, or beside it by a share `slack` of its size.

    A box that ends at the picture's border says nothing about what lies beyond.
    """
    in_camera = world_from_camera.inverse() @ points
    pixels, _ = camera.project(in_camera)
    left, top, right, bottom = box_px
    across, down = slack * (right - left) + 2, slack * (bottom - top) + 2
    low_x = -np.inf if left <= 1 else left - across
    low_y = -np.inf if top <= 1 else top - down
    high_x = np.inf if right >= camera.width_px - 1 else right + across
    high_y = np.inf if bottom >= camera.height_px - 1 else bottom + down
    x, y = pixels[:, 0], pixels[:, 1]
    inside = (x > low_x) & (x < high_x) & (y > low_y) & (y < high_y)
    return inside & (in_camera[:, 2] > 0) if isinstance(camera, Pinhole) else inside


def points_drawn(
    camera: Pinhole | Fisheye,
    world_from_camera: Pose,
    depth: NDArray[np.float32],
    pixels: NDArray[np.float64],
) -> tuple[NDArray[np.float64], BoolArray]:
    """(N, 3) world points of what is drawn at pixels (N, 2), and (N,) whether there is anything."""
    if not len(pixels):
        return np.zeros((0, 3)), np.zeros(0, dtype=bool)
    far = depth[_cells(camera, pixels)].astype(np.float64)
    rays = camera.unproject(pixels)
    if isinstance(camera, Pinhole):
        rays = rays / rays[:, 2:]
    return world_from_camera @ (rays * far[:, None]), far > 0


def _cells(
    camera: Pinhole | Fisheye, pixels: NDArray[np.float64]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Rows and columns, clipped to the picture."""
    column = np.clip(np.floor(pixels[:, 0]).astype(np.intp), 0, camera.width_px - 1)
    row = np.clip(np.floor(pixels[:, 1]).astype(np.intp), 0, camera.height_px - 1)
    return row, column


def box_of(view: MaskedView) -> tuple[float, float, float, float]:
    """The box that was drawn, else that of the mask, which must not be empty."""
    if view.box_px is not None:
        return view.box_px
    rows, columns = np.nonzero(view.mask)
    return (
        float(columns.min()),
        float(rows.min()),
        float(columns.max() + 1),
        float(rows.max() + 1),
    )


def core_of(vote: Vote) -> BoolArray:
    """(N,) the splats that the view's mask means."""
    return vote.inside > CORE * np.maximum(vote.seen, 1e-3)


def judge(
    positions: NDArray[np.float64], views: Sequence[MaskedView], votes: Sequence[Vote]
) -> tuple[ViewVerdict, ...]:
    """Compares each view's mask with the others' and leaves out those that fit too few.

    What a mask shows must lie in every other mask, unless something stands before it there: a mask
    that holds too much sticks out of the others, one that holds too little lets the others stick
    out. A view is judged by the half of the others that it fits best, so that one bad mask does not
    speak against the rest; of two views neither is known to be wrong, so both are used.
    """
    n = len(views)
    fits = np.ones((n, n))
    for k, vote in enumerate(votes):
        core = core_of(vote)
        for j in range(n):
            if j != k:
                fits[k, j] = _share_inside(positions[core], vote.inside[core], views[j], votes[j])
    mutual = np.minimum(fits, fits.T)
    verdicts = []
    for k, view in enumerate(views):
        others = np.sort(np.delete(mutual[k], k))[::-1]
        overlap = float(others[: max(1, n // 2)].mean()) if n > 1 else 1.0
        verdicts.append(ViewVerdict(view.name, overlap, n < 3 or overlap >= MIN_OVERLAP))
    if sum(verdict.used for verdict in verdicts) < min(n, 2):
        best = np.unravel_index(np.argmax(np.triu(mutual, 1)), mutual.shape)
        verdicts = [ViewVerdict(v.name, v.overlap, k in best) for k, v in enumerate(verdicts)]
    return tuple(verdicts)


def _share_inside(
    points: NDArray[np.float64], weights: NDArray[np.float32], view: MaskedView, vote: Vote
) -> float:
    if not len(points):
        return 0.0
    where = silhouette(points, view, vote)
    visible = where.in_front & where.framed
    total = float(weights[visible].sum())
    return float(weights[visible & where.in_mask].sum()) / total if total > 0 else 1.0
