"""The tracker's native kernels with their constants; numpy says the same in the modules named here.

`tracking.background` and `tracking.reference` (what changed), `tracking.contour` (points of a drawn
object), `tracking.observe` (edges and texture), `tracking.reference` (Gauss-Newton),
`tracking.judgement` (how well a pose is supported), `tracking.reduction` (what of a drawing is
kept).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.render.native import lens_of
from scenes.render.renderer import Rendering
from tracking import background, judgement, native, observe, reduction
from tracking.contour import REACH_PX, Contour, Texture
from tracking.extent import part_of
from tracking.judgement import Judgement
from tracking.native import SeenWindow, TrackKernels
from tracking.reduction import Looks, Outlined

if TYPE_CHECKING:
    from tracking.native import DrawnArrays, TrackProblem

Points = NDArray[np.float64]

__all__ = [
    "KERNELS",
    "Measurement",
    "SeenWindow",
    "arrays_of",
    "contour_of",
    "judged",
    "looks_of",
    "outlined_of",
    "rows_of",
]

KERNELS = TrackKernels(
    {
        "neighbour_noise": background.NEIGHBOUR_NOISE,
        "likeness_gain": background.LIKENESS_GAIN,
        "shadow_darkest": background.SHADOW_DARKEST,
        "shadow_gone": background.SHADOW_GONE,
        "shadow_discount": background.SHADOW_DISCOUNT,
        "shadow_hue": background.SHADOW_HUE,
        "sample_step_px": observe.SAMPLE_STEP_PX,
        "side_px": observe.SIDE_PX,
        "least_step": observe.LEAST_STEP,
        "distance_penalty": observe.DISTANCE_PENALTY,
        "foreign": observe.FOREIGN,
        "light_range": observe.LIGHT_RANGE,
        "alike_sigma": observe.ALIKE_SIGMA,
        "cut_px": observe.CUT_PX,
        "weak_reach_px": observe.WEAK_REACH_PX,
        "weak_slope": observe.WEAK_SLOPE,
        "weak_sigma_px": observe.WEAK_SIGMA_PX,
        "edge_sigma_px": observe.EDGE_SIGMA_PX,
        "coarse_sigma_px": observe.COARSE_SIGMA_PX,
        "faint_contrast": observe.FAINT_CONTRAST,
        "contour_correlation": observe.CONTOUR_CORRELATION,
        "texture_sigma": observe.TEXTURE_SIGMA,
        "texture_cutoff": observe.TEXTURE_CUTOFF,
        **judgement.CONSTANTS,
    }
)


OUTLINE = {
    "trim_px": reduction.TRIM_PX,
    "points": (reduction.FEWEST_POINTS, reduction.MOST_POINTS),
    "around_px2": reduction.AROUND_PX2,
    "reach_px": REACH_PX,
}
SURFACE = {
    "texture_points": reduction.TEXTURE_POINTS,
    "surface_points": reduction.SURFACE_POINTS,
    "least_slope": reduction.LEAST_SLOPE,
}
"""What is kept of a drawing, in the words of the native crate."""


@dataclass(frozen=True, slots=True, eq=False)
class Measurement:
    """What a pose is measured by in one window.

    Attributes:
        camera: of the window.
        world_from_camera: its pose.
        outline: silhouette points.
        texture: surface points, or None to leave them out.
        textured: whether the object has a pattern; shading alone is trusted less.
        centre_m: (3,) of the object in its own frame.
        prior_world_from_object: pose believed before looking.
        prior_sigma: (7,) standard deviations: shift, turn about the world's axes, halo.
        prior_halo_m: halo believed before looking.
        low_pass_px: by how much the drawing widened the outline.
        is_round: yaw cannot be seen.
    """

    camera: Fisheye | Pinhole
    world_from_camera: Pose
    outline: Contour
    texture: Texture | None
    textured: bool
    centre_m: Points
    prior_world_from_object: Pose
    prior_sigma: Points
    prior_halo_m: float
    low_pass_px: float
    is_round: bool

    def request(self) -> TrackProblem:
        """In the words of the native crate."""
        outline, texture = self.outline, self.texture
        camera = self.camera
        shared = observe.TEXTURE_CORRELATION if self.textured else observe.PLAIN_CORRELATION
        return {
            "lens": lens_of(camera),
            "focal": camera.fx if isinstance(camera, Pinhole) else camera.f_px,
            "camera_from_world": rows_of(self.world_from_camera.inverse()),
            "outline": {
                "points": outline.points,
                "normals": outline.normals,
                "inner_px": outline.inner_px,
                "outer_px": outline.outer_px,
                "colours": outline.colours,
            },
            "texture": None
            if texture is None
            else {
                "points": texture.points,
                "values": texture.values,
                "slopes": texture.slopes,
                "correlation": shared,
            },
            "centre": self.centre_m,
            "prior_mean": rows_of(self.prior_world_from_object),
            "prior_sigma": self.prior_sigma,
            "prior_halo": self.prior_halo_m,
            "low_pass_px": self.low_pass_px,
            "is_round": self.is_round,
        }


def refined(
    seen: SeenWindow,
    measurement: Measurement,
    world_from_object: Pose,
    halo_m: float,
    *,
    rounds: Sequence[tuple[float, int]],
) -> tuple[Pose, float, Points]:
    """A pose after Gauss-Newton, its halo, and the information (7, 7) behind them.

    Args:
        seen: the window.
        measurement: what to measure by.
        world_from_object: where to begin.
        halo_m: where to begin.
        rounds: reach in pixels and number of steps, one after the other.
    """
    rows, halo, information = KERNELS.refine(
        seen, measurement.request(), rows_of(world_from_object), halo_m, rounds=list(rounds)
    )
    return pose_of(rows), halo, np.array(information).reshape(7, 7)


def judged(
    seen: SeenWindow,
    measurement: Measurement,
    world_from_object: Pose,
    halo_m: float,
    *,
    surface: Points,
    colours: NDArray[np.float32],
) -> Judgement:
    """`tracking.judgement.judged`, natively; of a measurement's outline.

    Args:
        seen: the window.
        measurement: what to measure by.
        world_from_object: the pose.
        halo_m: how far the drawn contour lies outside the real one.
        surface: (N, 3) points evenly over the silhouette, in the object's frame.
        colours: (N, 3) drawn there.
    """
    found = KERNELS.judge(
        seen,
        measurement.request(),
        rows_of(world_from_object),
        halo_m,
        surface=surface,
        colours=colours,
        is_textured=measurement.textured,
    )
    return Judgement(*found)


def contour_of(
    drawn: Rendering,
    camera: Fisheye | Pinhole,
    object_from_camera: Pose,
    *,
    limit: int,
    reach_px: float,
) -> Contour:
    """`tracking.contour.contour_points`, natively."""
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
    """`tracking.reduction.outlined`, natively."""
    part, pixels, points, normals, inner_px, outer_px, (rgb, alpha, depth) = native.outlined(
        arrays_of(drawn), lens=lens_of(camera), kept={"finer": finer, **OUTLINE}
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
    """`tracking.reduction.looks`, natively."""
    contour = found.contour
    colours, texture, surface, area_px = native.looks(
        arrays_of(drawn),
        {"pixels": found.pixels, "normals": contour.normals, "inner_px": contour.inner_px},
        lens=lens_of(part_of(window, found.part)),
        kept=SURFACE,
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


def arrays_of(drawn: Rendering) -> DrawnArrays:
    """A drawing in the words of the native crate."""
    return {"rgb": drawn.rgb, "alpha": drawn.alpha, "depth": drawn.depth}


def rows_of(a_from_b: Pose) -> list[float]:
    """The twelve numbers of a pose's 3 × 4 matrix, row by row."""
    turned, place = a_from_b.rotation.tolist(), a_from_b.translation.tolist()
    return [value for row, shift in zip(turned, place, strict=True) for value in (*row, shift)]


def pose_of(rows: Sequence[float]) -> Pose:
    """Inverse of `rows_of`."""
    matrix = np.array(rows).reshape(3, 4)
    return Pose(matrix[:, :3], matrix[:, 3])
