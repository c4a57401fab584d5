"""Splats of a found object that show what is behind it.

In a trained room some splats hang in the air and paint the wall or the floor behind. Those beside a
object are found with it, and its box would have to hold them. Taken away with the object they
change nothing that is drawn: there the same wall is seen without them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from scenes.package.records import ViewPoint
from scenes.pose import Pose
from scenes.prepare.cutout.votes.cropped_views import (
    CloseView,
    close_views,
    evenly,
    light_in_masks,
)
from scenes.prepare.cutout.votes.framed import framed
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats
from scenes.splats import SplatCloud

BoolArray = NDArray[np.bool_]

MAX_VIEWS = 16
"""Views that are drawn, evenly out of those that frame the object."""
MIN_VIEWS = 3
"""Views below which nothing is decided."""
CHANGED = 0.05
"""Of any channel (0..1): what a picture has to change by for the change to be seen."""
MIN_CHANGING_SHARE = 0.25
"""Share of a splat's light that has to fall where the picture changes without the object."""
SEEN_PX = 0.5
"""Light, in pixels of all views, below which nothing is decided."""
MAX_SEE_THROUGH_SHARE = 0.3
"""Of the object's opacity: where more shows the background, the object only looks like it."""


def shows_background(
    cloud: SplatCloud,
    labels: BoolArray,
    viewpoints: Sequence[ViewPoint],
    *,
    renderer: NativeRenderer,
) -> BoolArray:
    """(N,) the labelled splats without which, and the rest of the object, all looks the same.

    Args:
        cloud: the whole room, metres.
        labels: (N,) the object's splats.
        viewpoints: of the room; those that frame the object whole are used, evenly chosen.
        renderer: draws the room.
    """
    none = np.zeros(len(cloud), dtype=bool)
    framing = close_views(viewpoints, cloud.means[labels].astype(np.float64))
    if len(framing) < MIN_VIEWS:
        return none

    def changes() -> Iterator[tuple[CloseView, BoolArray]]:
        for view in evenly(framing, MAX_VIEWS):
            shown = framed(cloud, view.camera, view.world_from_camera)
            rest = shown[~labels[shown]]
            change = np.abs(
                _draw(cloud.select(shown), view, renderer)
                - _draw(cloud.select(rest), view, renderer)
            )
            yield view, change.max(axis=2) > CHANGED

    changing, seen = light_in_masks(cloud, changes(), renderer=renderer)
    through = labels & (seen > SEEN_PX) & (changing < MIN_CHANGING_SHARE * seen)
    if cloud.opacities[through].sum() > MAX_SEE_THROUGH_SHARE * cloud.opacities[labels].sum():
        return none
    return through


def _draw(cloud: SplatCloud, view: CloseView, renderer: NativeRenderer) -> NDArray[np.float32]:
    posed = [PosedSplats(cloud, Pose.identity())]
    return np.clip(renderer.render(posed, view.camera, view.world_from_camera).rgb, 0.0, 1.0)
