"""A cheap look at a few hundred patches of all lenses: may the camera have moved since?

Every frame of a camera that stands is looked at; what seems to move is looked at closely
(`tracking.camera.common_motion`). So a moved camera is noticed in the first picture that it takes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tracking.camera.watch import DARK, Details, Watch
from tracking.kernels import native

FloatArray = NDArray[np.float32]
Points = NDArray[np.float64]

PATCH_PX = 5
"""Side in px of the patches, in the lens's own picture."""

CELLS = 14
"""The steepest point of each of so many by so many cells of a lens is looked at."""

MIN_NOISE = 0.01
"""Least scale of the patches' residuals, log grey."""

SUSPECT_RAD = math.radians(0.03)
"""Turn of a lens that is looked at closely: half of what is noticed, six times its scatter while
people walk about a 480-px lens."""

SUSPECT_SHARE = 0.5
"""Share of a lens's patches that another light, somebody close by or a large turn has changed."""

ITERATIONS = 4
"""Of reweighting."""


@dataclass(frozen=True, slots=True, eq=False)
class Glance:
    """A few patches of one lens.

    Attributes:
        corners: (N, 2) int64 left and top of the patches.
        values: (N,) their log grey.
        model: (N, 4) its derivatives by a turn of the rig, per radian, and by all light.
    """

    corners: NDArray[np.int64]
    values: Points
    model: Points


def glance_at(watch: Watch, image: NDArray[np.uint8]) -> Glance:
    """The patches to look at, from what is watched closely.

    Args:
        watch: of the lens.
        image: (H, W, 3) uint8 of it, taken where the watch began.
    """
    details = watch.sizes[-1]
    height, width = image.shape[:2]
    steep = _steepest(details)
    small, _ = details.camera.project(details.rays[steep])
    pixels = small * (width / details.camera.width_px)
    limit = np.array([width, height]) - PATCH_PX - 1
    corners = np.clip(np.floor(pixels - 0.5 * PATCH_PX), 1, limit).astype(np.int64)
    x, y = np.array([1, 0]), np.array([0, 1])
    slope = np.stack(
        [0.5 * (_values(image, corners + d) - _values(image, corners - d)) for d in (x, y)], axis=1
    )
    f_px = details.camera.f_px * width / details.camera.width_px
    by_turn = np.einsum("nia,ni->na", details.flow_by_twist[steep][:, :, :3] * f_px, slope)
    model = np.concatenate([by_turn, np.ones((len(corners), 1))], axis=1)
    return Glance(corners, _values(image, corners), model)


def renew(glance: Glance, image: NDArray[np.uint8]) -> Glance:
    """The same patches as they look now: another light is there to stay, or somebody is."""
    return Glance(glance.corners, _values(image, glance.corners), glance.model)


def is_suspect(glance: Glance, image: NDArray[np.uint8]) -> bool:
    """Whether a lens has to be looked at closely."""
    if len(glance.corners) < 2 * glance.model.shape[1]:
        return True
    change = _values(image, glance.corners) - glance.values
    fit, noise = np.zeros(glance.model.shape[1]), MIN_NOISE
    fit[-1] = float(np.median(change))
    for _ in range(ITERATIONS):
        left = change - glance.model @ fit
        noise = max(1.5 * float(np.median(np.abs(left))), MIN_NOISE)
        agree = 1.0 / (1.0 + (left / noise) ** 2) ** 2
        weighted = glance.model * agree[:, None]
        stiff = 1e-9 * np.eye(len(fit))
        fit = np.linalg.solve(weighted.T @ glance.model + stiff, weighted.T @ change)
    left = np.abs(change - glance.model @ fit)
    changed = float((left > 4.0 * MIN_NOISE).mean())
    return float(np.linalg.norm(fit[:3])) > SUSPECT_RAD or changed > SUSPECT_SHARE


def _steepest(details: Details) -> NDArray[np.intp]:
    """Indices of the steepest point of each cell."""
    places, _ = details.camera.project(details.rays)
    cell = np.floor(places * CELLS / details.camera.width_px).astype(np.intp)
    number = cell[:, 1] * CELLS + cell[:, 0]
    steep = np.linalg.norm(details.by_twist[:, :3], axis=1)
    order = np.lexsort((-steep, number))
    _, first = np.unique(number[order], return_index=True)
    return np.asarray(order[first], dtype=np.intp)


def _values(image: NDArray[np.uint8], corners: NDArray[np.int64]) -> Points:
    """(N,) log grey of patches."""
    colours = native.patch_means(image, corners, PATCH_PX).reshape(-1, 3)
    return np.log(colours.mean(axis=1).astype(np.float64) + DARK)
