"""Levels of detail: the splats of an object that matter in pictures of it.

How much a splat matters is the sum of its blend weights, alpha times transmittance, over pictures
from all around. A picture is linear in the colour of its splats, with those weights as factors, so
one backward pass of a picture without colour gives all of them (`scenes.render.gradients`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from scenes.render.gradients import record
from scenes.render.levels.object_views import ObjectView, views_around
from scenes.render.levels.refit import refit
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats, RenderOptions
from scenes.splats import SH_C0, SplatCloud

LEVELS = (5_000, 20_000)
"""Splats of an object that is tracked: small in the picture, and large."""

OPTIONS = RenderOptions(sh_degree=0, antialias=True)


def contributions(
    cloud: SplatCloud, renderer: NativeRenderer, views: Sequence[ObjectView]
) -> NDArray[np.float64]:
    """(N,) sum over views and pixels of each splat's blend weight; 0 for splats never seen."""
    # Without colour: a channel clamped at black would let no gradient through.
    colourless = SplatCloud(
        cloud.means,
        cloud.scales,
        cloud.rotations,
        cloud.opacities,
        np.zeros((len(cloud), 1, 3), dtype=np.float32),
    )
    total = np.zeros(len(cloud))
    objects = (PosedSplats(colourless, Pose.identity()),)
    for view in views:
        recording = record(renderer, objects, view.camera, view.object_from_camera, OPTIONS)
        d_rgb = np.zeros_like(recording.rendering.rgb)
        d_rgb[..., 0] = 1.0
        (found,) = recording.gradients(d_rgb).objects
        total += found.sh[:, 0, 0] / SH_C0
    return total


def prune(
    cloud: SplatCloud,
    count: int,
    *,
    renderer: NativeRenderer,
    views: Sequence[ObjectView] | None = None,
) -> SplatCloud:
    """The splats that contribute most, unchanged and in the order of the cloud.

    Args:
        cloud: the object, in its own frame.
        count: how many splats to keep at most; those that no view sees go in any case.
        renderer: draws the pictures.
        views: what to look from; `views_around` the cloud by default.

    Raises:
        ValueError: the count is below 1.
    """
    if count < 1:
        raise ValueError(f"prune: count: got {count}, wanted at least 1 splat")
    weights = contributions(cloud, renderer, views or views_around(cloud))
    return _heaviest(cloud, weights, count)


def levels_of(
    cloud: SplatCloud, counts: Sequence[int] = LEVELS, *, renderer: NativeRenderer
) -> tuple[SplatCloud, ...]:
    """One smaller cloud per count, pruned and refitted; the cloud itself where it is no larger.

    Pruning alone leaves gaps between the splats. Those kept are enlarged to the contribution of
    all, then fitted to pictures of the whole. About a second per level.

    Raises:
        ValueError: a count is below 1.
    """
    if min(counts, default=1) < 1:
        raise ValueError(f"levels_of: counts: got {tuple(counts)}, wanted at least 1 splat each")
    if all(count >= len(cloud) for count in counts):
        return tuple(cloud for _ in counts)
    views = views_around(cloud)
    weights = contributions(cloud, renderer, views)
    return tuple(
        cloud
        if count >= len(cloud)
        else refit(_enlarged(cloud, weights, count), cloud, renderer=renderer, views=views)
        for count in counts
    )


def _enlarged(cloud: SplatCloud, weights: NDArray[np.float64], count: int) -> SplatCloud:
    kept = _heaviest(cloud, weights, count)
    share = np.sort(weights)[-count:].sum() / max(weights.sum(), np.finfo(np.float64).tiny)
    factor = np.float32(1.0 / np.sqrt(share)) if share > 0 else np.float32(1.0)
    return SplatCloud(kept.means, kept.scales * factor, kept.rotations, kept.opacities, kept.sh)


def _heaviest(cloud: SplatCloud, weights: NDArray[np.float64], count: int) -> SplatCloud:
    ranked = np.argsort(-weights, kind="stable")[:count]
    return cloud.select(np.sort(ranked[weights[ranked] > 0]))
