"""Measurements of a pose in one window, and the native solver's results.

`tests.twins.solver` is the readable twin of `refined`, `tracking.likelihood.contour_support`
that of `judged`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.render.native import lens_of
from tracking.kernels.arrays import pose_of, rows_of
from tracking.kernels.native import KERNELS, SeenWindow
from tracking.kernels.options import OPTIONS
from tracking.likelihood.contour_support import Judgement
from tracking.window.contour import Contour, Texture

if TYPE_CHECKING:
    from tracking.kernels.native import TrackProblem

Points = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Measurement:
    """Points of a rendering by which a pose is measured in one window.

    Attributes:
        camera: of the window.
        world_from_camera: its pose.
        outline: silhouette points.
        texture: surface points, or None to leave them out.
        textured: whether the object has a pattern; shading alone is trusted less.
        centre_m: (3,) of the object in its own frame.
        prior_world_from_object: mean of the pose's prior.
        prior_sigma: (7,) standard deviations: shift, turn about the world's axes, silhouette bias.
        prior_silhouette_bias_m: mean of its prior.
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
    prior_silhouette_bias_m: float
    low_pass_px: float
    is_round: bool

    def request(self) -> TrackProblem:
        """In the words of the native crate."""
        outline, texture = self.outline, self.texture
        camera = self.camera
        shared = OPTIONS.texture_correlation if self.textured else OPTIONS.plain_correlation
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
            "prior_halo": self.prior_silhouette_bias_m,
            "low_pass_px": self.low_pass_px,
            "is_round": self.is_round,
        }


def refined(
    seen: SeenWindow,
    measurement: Measurement,
    world_from_object: Pose,
    silhouette_bias_m: float,
    *,
    rounds: Sequence[tuple[float, int]],
) -> tuple[Pose, float, Points]:
    """A pose after Gauss-Newton, its silhouette bias, and the information (7, 7) behind them.

    Args:
        seen: the window.
        measurement: what to measure by.
        world_from_object: where to begin.
        silhouette_bias_m: where to begin.
        rounds: reach in pixels and number of steps, one after the other.
    """
    rows, silhouette_bias, information = KERNELS.refine(
        seen,
        measurement.request(),
        rows_of(world_from_object),
        silhouette_bias_m,
        rounds=list(rounds),
    )
    return pose_of(rows), silhouette_bias, np.array(information).reshape(7, 7)


def judged(
    seen: SeenWindow,
    measurement: Measurement,
    world_from_object: Pose,
    silhouette_bias_m: float,
    *,
    surface: Points,
    colours: NDArray[np.float32],
) -> Judgement:
    """`tracking.likelihood.contour_support.judged`, natively; of a measurement's outline.

    Args:
        seen: the window.
        measurement: what to measure by.
        world_from_object: the pose.
        silhouette_bias_m: how far the drawn contour lies outside the real one.
        surface: (N, 3) points evenly over the silhouette, in the object's frame.
        colours: (N, 3) drawn there.
    """
    found = KERNELS.judge(
        seen,
        measurement.request(),
        rows_of(world_from_object),
        silhouette_bias_m,
        surface=surface,
        colours=colours,
        is_textured=measurement.textured,
    )
    return Judgement(*found)
