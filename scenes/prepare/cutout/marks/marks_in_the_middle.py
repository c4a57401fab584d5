# pyright: standard
"""Marks the one object that photos were taken around, as a person would: a box in three of them.

What all photos look at is in the middle. The level plane below it is what the object stands on, and
what hangs together above that plane, there, is the object; its outline is left to the masks.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Pinhole
from scenes.package import ScenePackage
from scenes.package.records import ViewPoint
from scenes.prepare.cutout.connected_bodies import bodies
from scenes.prepare.cutout.level_planes import level_planes
from scenes.prepare.cutout.marks.masks import Prompt
from scenes.splats import SplatCloud

FloatArray = NDArray[np.float64]

AROUND_SHARE = 0.6
"""Of the photos' distance: what is farther from the middle is not the object."""
REACH_SHARE = 0.035
"""Of the photos' distance: gaps within an object."""
RAISED_SHARE = 0.02
"""Of the photos' distance: what lies lower above the plane may be a card or the plane's noise."""
FOOT = 2.0
"""Height in times `RAISED_SHARE` below which points of an object are its foot on the plane."""
SOLID = 0.3
"""Opacity from which on a splat counts."""
MIN_SPLATS = 30
"""Splats of a body at least."""
TAIL = 0.005
"""Quantile of splats left out at either end."""
MARGIN = 0.06
"""Of a box's size: how far a person would draw it beside the object."""
PHOTOS = 3
"""Photos that are marked at most."""


def marks_in_the_middle(package: ScenePackage) -> dict[str, Prompt]:
    """A box around the object in the middle, by view, in up to three views from different sides.

    Args:
        package: a capture of one object, before anything is cut out.

    Raises:
        ValueError: nothing stands there, or no view shows the whole of it.
    """
    own = _object_in_the_middle(package)
    whole = [(view, box) for view in package.views if (box := _box_in(view, own)) is not None]
    if not whole:
        raise ValueError(
            "no photo shows the whole of the object in the middle; step back, or mark it with "
            "--box VIEW X0 Y0 X1 Y1"
        )
    chosen = _from_all_sides([view for view, _ in whole], own.mean(axis=0))
    return {whole[k][0].name: Prompt(whole[k][1]) for k in chosen}


def looked_at(views: Sequence[ViewPoint]) -> FloatArray:
    """(3,) the point nearest to the middle rays of all views, least squares.

    Raises:
        ValueError: they all look the same way, or there are none.
    """
    eyes = _eyes(views)
    along = np.array([view.world_from_camera.rotation[:, 2] for view in views]).reshape(-1, 3)
    across = np.eye(3) - along[:, :, None] * along[:, None, :]
    total = across.sum(axis=0)
    if len(views) < 2 or np.linalg.cond(total) > 1e4:
        raise ValueError(
            f"{len(views)} photos look the same way; take them from all around the object, or "
            "mark it with --box VIEW X0 Y0 X1 Y1"
        )
    return np.linalg.solve(total, np.einsum("nij,nj->i", across, eyes))


def _object_in_the_middle(package: ScenePackage) -> FloatArray:
    """(N, 3) the splats' places of what stands in the middle, and below the lowest its foot."""
    middle = looked_at(package.views)
    distance_m = float(np.median(np.linalg.norm(_eyes(package.views) - middle, axis=1)))
    raised_m = RAISED_SHARE * distance_m
    room = package.room
    beside = np.linalg.norm(room.means[:, :2] - middle[:2], axis=1)
    near = room.select((beside < AROUND_SHARE * distance_m) & (room.opacities >= SOLID))
    floor_m = _support_m(near, float(middle[2]) + raised_m)
    points = near.means.astype(np.float64)
    points = points[points[:, 2] > floor_m + raised_m]
    if len(points) < MIN_SPLATS:
        raise _nothing(middle)
    count, body = bodies(points, REACH_SHARE * distance_m)
    sizes = np.bincount(body, minlength=count)
    # The photos' middle may pass beside an object with legs: of what is large, the nearest.
    away = np.full(count, np.inf)
    np.minimum.at(away, body, np.linalg.norm(points - middle, axis=1))
    large = sizes >= max(MIN_SPLATS, 0.1 * sizes.max())
    own = points[body == int(np.argmin(np.where(large, away, np.inf)))]
    low, high = np.quantile(own, (TAIL, 1.0 - TAIL), axis=0)
    own = own[((own >= low) & (own <= high)).all(axis=1)]
    foot = own[own[:, 2] < floor_m + FOOT * raised_m] * (1.0, 1.0, 0.0) + (0.0, 0.0, floor_m)
    return np.concatenate([own, foot])


def _support_m(near: SplatCloud, below_m: float) -> float:
    """Height of the largest level plane below a height; without one, of the lowest splats."""
    planes = [plane for plane in level_planes(near) if plane.height_m < below_m]
    if planes:
        return planes[0].height_m
    return float(np.quantile(near.means[:, 2], TAIL)) if len(near) else below_m


def _box_in(view: ViewPoint, own: FloatArray) -> tuple[float, float, float, float] | None:
    """(left, top, right, bottom) px around the object; None where the picture does not hold it."""
    in_camera = view.world_from_camera.inverse() @ own
    if isinstance(view.camera, Pinhole) and in_camera[:, 2].min() <= 0:
        return None
    pixels, _ = view.camera.project(in_camera)
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    if (low < 0).any() or (high > (view.camera.width_px, view.camera.height_px)).any():
        return None
    margin = MARGIN * (high - low)
    (left, top), (right, bottom) = low - margin, high + margin
    return float(left), float(top), float(right), float(bottom)


def _from_all_sides(views: Sequence[ViewPoint], middle: FloatArray) -> list[int]:
    """Up to `PHOTOS` of the views that see the object from directions far apart."""
    towards = _eyes(views) - middle
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    # From above it stands out best from what is around it.
    chosen = [int(np.argmax(towards[:, 2]))]
    while len(chosen) < min(PHOTOS, len(views)):
        nearest = (towards @ towards[chosen].T).max(axis=1)
        chosen.append(int(np.argmin(nearest)))
    return chosen


def _eyes(views: Sequence[ViewPoint]) -> FloatArray:
    return np.array([view.world_from_camera.translation for view in views]).reshape(-1, 3)


def _nothing(middle: FloatArray) -> ValueError:
    return ValueError(
        f"nothing stands at {', '.join(f'{x:.2f}' for x in middle)} m, where the photos look; mark "
        "the object with --box VIEW X0 Y0 X1 Y1 in one to three of the photos"
    )
