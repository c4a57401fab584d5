# pyright: standard
"""Proposals of movable objects: bodies that stand free on the floor or on a table."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, binary_erosion, binary_fill_holes

from scenes.prepare.cutout.connected_bodies import bodies
from scenes.prepare.cutout.labelling.separate import Separation
from scenes.prepare.cutout.level_planes import LevelPlane, level_planes, on_planes
from scenes.prepare.cutout.object.upright_box import UprightBox, upright_box
from scenes.splats import SplatCloud

REACH_M = 0.05
"""Objects closer to each other than this are proposed as one."""
SIZE_M = (0.03, 1.3)
"""Shortest and longest side of what a person would move."""
MIN_LEVEL_SHARE = 0.01
"""Of the room's level area: what lies at one height to be a support."""
LEVEL = 0.5
"""Upward spread of a splat, as a share of its largest, below which it lies level."""
PATCH_REACH_M = 0.1
"""Distance between splats of one patch of a support, metres."""
PATCH_M2 = 0.4
"""Level patches of less area, counted in cells they touch, are parts of objects."""
CELL_M = 0.01
"""Side of a cell of an outline, metres."""
RING_GAP_CELLS = 3
"""Gaps of an outline of contact that are closed, in cells to either side."""
MARGIN_CELLS = 5
"""Cells around an outline."""
CONTACT_M = 0.03
"""How far above its support an object's outline there is looked at."""
MIN_SPLATS = 60
"""Splats of a body at least."""
STANDING_M = 0.03
"""How far above its support an object's lowest splats may lie."""
RING_M = 0.2
"""Width of the ring around a body in which its support is looked for, metres."""
SECTORS = 16
"""Directions in which a body has to be surrounded by its support."""
MIN_SCORE = 0.5
"""Score below which nothing is proposed."""


@dataclass(frozen=True, slots=True, eq=False)
class Proposal:
    """A body that could be made an object.

    Attributes:
        found: its splats, ready for `scenes.prepare.cutout.cutout.make_object`.
        box: around it.
        score: 0..1, the share of directions in which its support goes on around it.
    """

    found: Separation
    box: UprightBox
    score: float


def propose(room: SplatCloud) -> tuple[Proposal, ...]:
    """The free-standing bodies of a room, the surest first.

    Args:
        room: world frame, metres, Z up.
    """
    planes = level_planes(room, min_share=MIN_LEVEL_SHARE)
    flat = _support(room, planes)
    standing = np.flatnonzero(~flat)
    if not len(standing):
        return ()
    count, body = bodies(room.means[standing], REACH_M)
    members = np.split(standing[np.argsort(body, kind="stable")], np.cumsum(np.bincount(body))[:-1])
    proposals = []
    for chosen in members[:count]:
        proposal = _proposal(room, np.sort(chosen), flat, planes)
        if proposal is not None:
            proposals.append(proposal)
    return tuple(sorted(proposals, key=lambda item: -item.score))


def _support(room: SplatCloud, planes: tuple[LevelPlane, ...]) -> NDArray[np.bool_]:
    """(N,) the level splats of planes, but for patches as small as a seat or a book's cover."""
    spread = np.sqrt(room.covariances()[:, 2, 2])
    level = np.flatnonzero(
        on_planes(room.means, planes) & (spread < LEVEL * room.scales.max(axis=1))
    )
    support = np.zeros(len(room), dtype=bool)
    if len(level):
        count, patch = bodies(room.means[level], PATCH_REACH_M)
        order = np.argsort(patch, kind="stable")
        ends = np.cumsum(np.bincount(patch, minlength=count))[:-1]
        for members in np.split(level[order], ends):
            cells = np.unique(np.floor(room.means[members, :2] / PATCH_REACH_M), axis=0)
            if len(cells) * PATCH_REACH_M**2 > PATCH_M2:
                support[members] = True
    return support


def _with_underside(
    room: SplatCloud, chosen: NDArray[np.intp], flat: NDArray[np.bool_], height_m: float
) -> NDArray[np.intp]:
    """The body with the splats in its support's plane that its outline there encloses."""
    means = room.means
    touching = means[chosen][means[chosen, 2] < height_m + CONTACT_M, :2]
    if not len(touching):
        return chosen
    low = touching.min(axis=0) - MARGIN_CELLS * CELL_M
    shape = np.ceil((touching.max(axis=0) - low) / CELL_M).astype(int) + MARGIN_CELLS + 1
    contact = np.zeros(shape, dtype=bool)
    contact[tuple(np.floor((touching - low) / CELL_M).astype(int).T)] = True
    # Gaps in the outline are bridged before it is filled, and what that adds is taken off again.
    filled = binary_fill_holes(binary_dilation(contact, iterations=RING_GAP_CELLS))
    inside = np.asarray(binary_erosion(filled, iterations=RING_GAP_CELLS), dtype=bool)
    near = np.flatnonzero(flat & (np.abs(means[:, 2] - height_m) < STANDING_M))
    cells = np.floor((means[near, :2] - low) / CELL_M).astype(int)
    within = ((cells >= 0) & (cells < shape)).all(axis=1)
    near, cells = near[within], cells[within]
    return np.union1d(chosen, near[inside[tuple(cells.T)]])


def _proposal(
    room: SplatCloud,
    chosen: NDArray[np.intp],
    flat: NDArray[np.bool_],
    planes: tuple[LevelPlane, ...],
) -> Proposal | None:
    """The body as a proposal, unless it is too small, too large or stands on nothing."""
    if len(chosen) < MIN_SPLATS:
        return None
    points = room.means[chosen].astype(np.float64)
    low, high = np.percentile(points, (1, 99), axis=0)
    if (high - low).max() > SIZE_M[1] or np.sort(high - low)[1] < SIZE_M[0]:
        return None
    below = [p for p in planes if abs(low[2] - p.height_m) < STANDING_M + p.reach_m]
    if not below:
        return None
    height = min(below, key=lambda plane: abs(low[2] - plane.height_m)).height_m
    score = _surrounded(room, flat, low, high, height)
    if score < MIN_SCORE:
        return None
    labels = np.zeros(len(room), dtype=bool)
    labels[_with_underside(room, chosen, flat, height)] = True
    box = upright_box(room.select(labels), room.select(~labels))
    none = np.zeros_like(labels)
    return Proposal(Separation(labels, none, none, ()), box, score)


def _surrounded(
    room: SplatCloud,
    flat: NDArray[np.bool_],
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    height_m: float,
) -> float:
    """Share of the directions around a body in which its support goes on."""
    means = room.means
    near = flat & (np.abs(means[:, 2] - height_m) < STANDING_M)
    near &= ((means[:, :2] > low[:2] - RING_M) & (means[:, :2] < high[:2] + RING_M)).all(axis=1)
    near &= ~((means[:, :2] > low[:2]) & (means[:, :2] < high[:2])).all(axis=1)
    away = means[near, :2] - 0.5 * (low + high)[:2]
    sector = np.floor((np.arctan2(away[:, 1], away[:, 0]) / (2 * np.pi) % 1.0) * SECTORS)
    return len(np.unique(sector)) / SECTORS
