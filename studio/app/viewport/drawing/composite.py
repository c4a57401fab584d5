"""Splats and meshes in one picture, by depth: each hides what is behind it of the other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from studio.app.viewport.drawing.mesh_picture import MeshPicture

TIE_M = 0.02
"""A mesh that lies in a surface of splats is shown: a scan's surface is rough by about this."""


def composite(
    picture: NDArray[np.uint8], splat_depth: NDArray[np.float32], meshes: MeshPicture
) -> None:
    """Paint meshes over a picture of splats wherever they are nearer.

    Args:
        picture: (H, W, 3) RGB of the splats, painted on.
        splat_depth: (H, W) metres along z, 0 where there is no splat.
        meshes: of the same camera.
    """
    rows = np.flatnonzero(meshes.rgba[..., 3].any(axis=1))
    if not len(rows):
        return
    columns = np.flatnonzero(meshes.rgba[..., 3].any(axis=0))
    part = slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)
    before, depth = splat_depth[part], meshes.depth[part]
    alpha = meshes.rgba[part][..., 3]
    nearer = (alpha > 0) & ((before <= 0) | (depth < before + TIE_M))
    if not nearer.any():
        return
    share = np.where(nearer, alpha, 0).astype(np.uint16)[..., None]
    under, over = picture[part].astype(np.uint16), meshes.rgba[part][..., :3]
    picture[part] = ((under * (255 - share) + over * share + 127) // 255).astype(np.uint8)
