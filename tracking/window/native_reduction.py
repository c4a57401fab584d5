"""Native reduction of a rendering; `tracking.window.reduction` is the readable twin."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.render.native import lens_of
from scenes.render.renderer import Rendering
from tracking.kernels import native
from tracking.kernels.arrays import arrays_of
from tracking.kernels.reduction import REDUCTION
from tracking.window.contour import Contour, Texture
from tracking.window.extent import part_of
from tracking.window.reduction import Looks, Outlined


def contour_of(
    drawn: Rendering,
    camera: Fisheye | Pinhole,
    object_from_camera: Pose,
    *,
    limit: int,
    reach_px: float,
) -> Contour:
    """`tracking.window.contour.contour_points`, natively."""
    points, normals, inner, outer, colours = native.contour(
        arrays_of(drawn), lens=lens_of(camera), limit=limit, reach_px=reach_px
    )
    return Contour(
        np.ascontiguousarray(object_from_camera @ points.reshape(-1, 3)),
        normals.reshape(-1, 2),
        inner,
        outer,
        colours.reshape(-1, 3),
    )


def outlined_of(
    drawn: Rendering, camera: Fisheye, object_from_camera: Pose, *, finer: int
) -> Outlined:
    """`tracking.window.reduction.reduce_outline`, natively."""
    part, pixels, points, normals, inner_px, outer_px, (rgb, alpha, depth) = native.outlined(
        arrays_of(drawn), lens=lens_of(camera), kept=REDUCTION.outline_for_native(finer=finer)
    )
    left, top, width, height = part
    contour = Contour(
        np.ascontiguousarray(object_from_camera @ points.reshape(-1, 3)),
        normals.reshape(-1, 2),
        inner_px,
        outer_px,
        np.zeros((len(inner_px), 3), np.float32),
    )
    shape = (height, width)
    return Outlined(
        part=(slice(top, top + height), slice(left, left + width)),
        pixels=pixels.reshape(-1, 2),
        contour=contour,
        drawn=Rendering(rgb.reshape(*shape, 3), alpha.reshape(shape), depth.reshape(shape)),
    )


def looks_of(found: Outlined, drawn: Rendering, window: Fisheye, object_from_camera: Pose) -> Looks:
    """`tracking.window.reduction.measure_looks`, natively."""
    contour = found.contour
    colours, texture, surface, area_px = native.looks(
        arrays_of(drawn),
        {"pixels": found.pixels, "normals": contour.normals, "inner_px": contour.inner_px},
        lens=lens_of(part_of(window, found.part)),
        kept=REDUCTION.surface_for_native(),
    )
    points, values, slopes = texture
    surface_points, surface_colours = surface
    return Looks(
        contour=replace(contour, colours=colours.reshape(-1, 3)),
        texture=Texture(
            np.ascontiguousarray(object_from_camera @ points.reshape(-1, 3)),
            values.reshape(-1, 3),
            slopes.reshape(-1, 3, 2),
        ),
        surface=np.ascontiguousarray(object_from_camera @ surface_points.reshape(-1, 3)),
        colours=surface_colours.reshape(-1, 3),
        area_px=area_px,
    )
