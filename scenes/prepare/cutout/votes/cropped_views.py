# pyright: standard
"""The views of a room that show one object whole, cropped to it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Pinhole
from scenes.package.records import ViewPoint
from scenes.pose import Pose
from scenes.prepare.cutout.marks.masked_view import MaskedView
from scenes.prepare.cutout.votes.framed import framed
from scenes.prepare.cutout.votes.lifting import lift
from scenes.render.native import NativeRenderer
from scenes.splats import SplatCloud

FloatArray = NDArray[np.float64]

MARGIN = 0.25
"""Of the object's size in a view: how far around it the view is cropped."""
MAX_PX = 260
"""Longest side of a crop."""


@dataclass(frozen=True, slots=True)
class CloseView:
    """A view cropped to one object.

    Attributes:
        name: of the view.
        camera: of the crop.
        world_from_camera: the view's pose.
        zoom: pixels of the crop for one of the view's, at most 1.
    """

    name: str
    camera: Pinhole
    world_from_camera: Pose
    zoom: float


def close_views(viewpoints: Sequence[ViewPoint], points: FloatArray) -> tuple[CloseView, ...]:
    """The pinhole views that frame world points (N, 3) whole, cropped to them."""
    found = []
    for view in viewpoints:
        if isinstance(view.camera, Pinhole):
            crop = cropped(view.camera, view.world_from_camera, points)
            if crop is not None:
                zoom = crop.fx / view.camera.fx
                found.append(CloseView(view.name, crop, view.world_from_camera, zoom))
    return tuple(found)


def evenly(views: Sequence[CloseView], most: int) -> tuple[CloseView, ...]:
    """At most so many of the views, evenly chosen."""
    picks = np.linspace(0, len(views) - 1, min(most, len(views))).round().astype(int)
    return tuple(views[pick] for pick in picks)


def cropped(camera: Pinhole, world_from_camera: Pose, points: FloatArray) -> Pinhole | None:
    """The part of a view around world points (N, 3), at most `MAX_PX` large.

    None where a point lies outside the picture, but for the outermost few.
    """
    if not len(points):
        return None
    in_camera = world_from_camera.inverse() @ points
    if (in_camera[:, 2] <= 0).mean() > 0.02:
        return None
    pixels, _ = camera.project(in_camera[in_camera[:, 2] > 0])
    low, high = np.percentile(pixels, (1, 99), axis=0)
    limit = np.array([camera.width_px, camera.height_px])
    if (low < 0).any() or (high > limit).any():
        return None
    reach = MARGIN * (high - low).max() + 4
    first = np.floor(np.maximum(low - reach, 0)).astype(int)
    last = np.ceil(np.minimum(high + reach, limit)).astype(int)
    scale = min(1.0, MAX_PX / float((last - first).max()))
    size = np.maximum(np.round((last - first) * scale).astype(int), 1)
    return Pinhole(
        int(size[0]),
        int(size[1]),
        camera.fx * scale,
        camera.fy * scale,
        (camera.cx - float(first[0])) * scale,
        (camera.cy - float(first[1])) * scale,
    )


def light_in_masks(
    cloud: SplatCloud,
    masks: Iterable[tuple[CloseView, NDArray[np.bool_]]],
    *,
    renderer: NativeRenderer,
) -> tuple[FloatArray, FloatArray]:
    """(N,) each splat's light inside the masks of crops, and (N,) all of it there.

    Light is blend weight, summed over pixels of the views as they were before they were cropped.

    Args:
        cloud: the whole room, metres.
        masks: crops, each with a mask (H, W).
        renderer: draws the room.
    """
    inside, seen = np.zeros((2, len(cloud)))
    for view, mask in masks:
        masked = MaskedView(view.name, view.camera, view.world_from_camera, mask)
        shown = framed(cloud, view.camera, view.world_from_camera)
        vote = lift(cloud.select(shown), masked, renderer=renderer)
        inside[shown] += vote.inside / view.zoom**2
        seen[shown] += vote.seen / view.zoom**2
    return inside, seen
