"""A room in fewer splats at once, without drawing it: for pictures while the camera moves."""

from __future__ import annotations

import numpy as np

from scenes.splats import SplatCloud
from scenes.zcurve import z_order


def thinned(cloud: SplatCloud, count: int) -> SplatCloud:
    """About `count` splats spread as evenly as the cloud's, enlarged to cover what all covered.

    Every n-th along a Z curve is kept. On walls all splats contribute about the same; keeping the
    heaviest (`scenes.render.levels.levels`) would leave holes there.

    Args:
        cloud: any cloud; splats whose mean isn't finite are left out.
        count: how many splats to keep at most; a cloud that has no more comes back as it is.

    Raises:
        ValueError: the count is below 1.
    """
    if count < 1:
        raise ValueError(f"thinned: count: got {count}, wanted at least 1 splat")
    if len(cloud) <= count:
        return cloud
    (sound,) = np.nonzero(np.isfinite(cloud.means).all(axis=1))
    order = sound[z_order(cloud.means[sound].astype(np.float64))]
    steps = (np.arange(count) * (len(order) / count)).astype(np.intp)
    kept = cloud.select(np.sort(order[np.unique(steps)]) if len(order) else order)
    # Areas are of squares: half the splats must be sqrt(2) as large.
    factor = np.float32(np.sqrt(len(order) / max(len(kept), 1)))
    return SplatCloud(kept.means, kept.scales * factor, kept.rotations, kept.opacities, kept.sh)
