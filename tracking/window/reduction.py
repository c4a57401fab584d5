"""Reduction of a rendering to contour, texture and surface points, in Rust.

`tests/twins/reduction.py` is the readable twin.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.render.native import lens_of
from scenes.render.renderer import Rendering
from tracking.kernels import native
from tracking.kernels.arrays import arrays_of
from tracking.kernels.reduction import REDUCTION
from tracking.window.contour import Contour, Texture
from tracking.window.extent import part_of

FloatArray = NDArray[np.float32]
Points = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Outlined:
    """A drawing's outline, and its picture where it shows anything.

    Attributes:
        part: rows and columns of the window.
        pixels: (N, 2) of the contour, counted from the part's corner.
        contour: in the object's frame, its widths in pixels of the window; colours are to come.
        drawn: the part, with the window's own pixels.
    """

    part: tuple[slice, slice]
    pixels: Points
    contour: Contour
    drawn: Rendering


@dataclass(frozen=True, slots=True, eq=False)
class Looks:
    """Points on a drawn object, and how it looks there.

    Attributes:
        contour: with the colours inside it.
        texture: surface points with structure.
        surface: (N, 3) points evenly over the silhouette, in the object's frame.
        colours: (N, 3) float32 drawn there, smoothed.
        area_px: pixels of the silhouette.
    """

    contour: Contour
    texture: Texture
    surface: Points
    colours: FloatArray
    area_px: int


def contour_of(
    drawn: Rendering,
    camera: Fisheye | Pinhole,
    object_from_camera: Pose,
    *,
    limit: int,
    reach_px: float,
) -> Contour:
    """Return the silhouette's points: crossings of alpha ½, lifted to 3D by the drawn depth.

    Args:
        drawn: the object alone.
        camera: it was drawn with.
        object_from_camera: inverse of the pose it was drawn at.
        limit: keep about this many points, evenly.
        reach_px: how far parts and gaps are measured.
    """
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
    """Find the outline of a drawing and shrink what it shows to the window's own pixels.

    Args:
        drawn: the object alone.
        camera: it was drawn with.
        object_from_camera: inverse of the pose it was drawn at.
        finer: pixels it was drawn with, each way, per pixel of the window.
    """
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
    """Pick points of a drawing: with structure, evenly over the silhouette, inside the contour.

    Args:
        found: its outline.
        drawn: the part that shows anything, perhaps with better colours than the outline's.
        window: the camera that the part is of.
        object_from_camera: inverse of the pose it was drawn at.
    """
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
