# pyright: standard
"""The splats that paint an object, wherever they hang.

A splat of a trained room need not lie on the surface that it paints. Where its light falls decides:
an object's splats are drawn as silhouettes in many views, and what paints these is the object's.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from scenes.package.records import ViewPoint
from scenes.prepare.cutout.votes.cropped_views import (
    CloseView,
    close_views,
    evenly,
    light_in_masks,
)
from scenes.prepare.cutout.votes.framed import framed
from scenes.prepare.cutout.votes.lifting import share
from scenes.render.native import NativeRenderer
from scenes.splats import SplatCloud

BoolArray = NDArray[np.bool_]
FloatArray = NDArray[np.float64]

MAX_VIEWS = 16
"""Views that are drawn, evenly out of those that frame the object."""
MIN_PX = 60
"""A smaller silhouette says nothing."""
MAJORITY = 0.5
"""Share of a splat's light inside the silhouettes from which on it is the object's."""


def painting(
    cloud: SplatCloud,
    labels: BoolArray,
    viewpoints: Sequence[ViewPoint],
    *,
    renderer: NativeRenderer,
) -> BoolArray:
    """(N,) the splats most of whose light falls into the labelled splats' silhouettes."""
    framing = close_views(viewpoints, cloud.means[labels].astype(np.float64))
    inside, seen = _light(cloud, labels, evenly(framing, MAX_VIEWS), renderer)
    return inside > MAJORITY * np.maximum(seen, 1e-9)


def _light(
    cloud: SplatCloud, labels: BoolArray, views: Sequence[CloseView], renderer: NativeRenderer
) -> tuple[FloatArray, FloatArray]:
    """(N,) each splat's light inside the labelled splats' silhouettes, and all of it.

    In pixels of the views as they were before they were cropped.
    """

    def silhouettes() -> Iterator[tuple[CloseView, BoolArray]]:
        for view in views:
            shown = framed(cloud, view.camera, view.world_from_camera)
            drawn = share(
                cloud.select(shown),
                labels[shown],
                view.camera,
                view.world_from_camera,
                renderer=renderer,
            )
            mask = drawn > MAJORITY
            if mask.sum() >= MIN_PX:
                yield view, mask

    return light_in_masks(cloud, silhouettes(), renderer=renderer)
