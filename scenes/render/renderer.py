"""The protocol every splat renderer implements, and the semantics they share.

A splat's alpha at a pixel is `min(0.99, opacity · exp(-½ dᵀ Σ⁻¹ d))`, skipped below 1/255, with Σ
the EWA-projected covariance plus 0.3 px² (the lens's own Jacobian). Splats of all objects are
blended front to back in one global order of depth: z for a pinhole, range for a fisheye. A pixel
stops when its transmittance falls below 1e-4.

A splat is *wide* where its largest standard deviation over the range of its mean is more than
`RenderOptions.exact_above_rad`. EWA puts the alpha of such a splat wrong, by about 0.017 per degree
of that angle. Instead of the flat ellipse it takes the 3D Gaussian's peak along the pixel's ray
(3DGUT, Wu et al. 2024, section 4.2): `exp(-½ |m|² sin²(m, w))` with m the mean and w the ray, both
whitened, and `exp(-½ |m|²)` for rays that lead away from it, so that an eye inside a splat is in a
fog. Its variances are first enlarged by `0.3 · (range / f)²`, the low pass as seen from the mean;
`antialias` leaves its opacity alone. It is drawn wherever its mean lies beyond the near limit, also
behind a fisheye.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.splats import SplatCloud

ALPHA_MAX = 0.99
ALPHA_MIN = 1.0 / 255.0
TRANSMITTANCE_STOP = 1e-4
LOW_PASS_PX2 = 0.3
WIDE_RAD = math.radians(2.0)
"""Angle from which on EWA's error, 0.033 of alpha, shows: a value for `exact_above_rad` if near
splats must be right. It is not the default for what it costs: 1.1 times EWA's time through a
pinhole in the midst of a room, 1.7 times through the two lenses of a 360° camera
(docs/benchmarks.md)."""
TILE_PX = 16
"""Side of the squares a picture is drawn in."""


@dataclass(frozen=True, slots=True, eq=False)
class PosedSplats:
    """One splat object and where it is.

    Attributes:
        cloud: splats in the object's frame.
        world_from_object: its pose.
    """

    cloud: SplatCloud
    world_from_object: Pose


@dataclass(frozen=True, slots=True, eq=False)
class RenderOptions:
    """Options of a rendering.

    Pixels inside `region` and `tile_mask` are those of the whole picture to the bit; all others
    show the background, with alpha 0, depth 0 and id -1. Both at once: where both allow it.

    Attributes:
        background: RGB behind everything, 0..1; one colour, or a picture (H, W, 3) float32.
        region: left, top, width and height in pixels of the only part to draw, which costs about
            its share of the picture; None draws all.
        tile_mask: (ceil(H / TILE_PX), ceil(W / TILE_PX)) bool, the only tiles to draw.
        sh_degree: highest spherical-harmonic degree to evaluate, 0..3.
        near_m: splats nearer than this (z for pinhole, range for fisheye) are skipped.
        antialias: multiply opacity by sqrt(det Σ_2D / det Σ_2D blurred) (Mip 2D filter).
        exact_above_rad: where splats begin to be wide (see above), radians, such as `WIDE_RAD`; inf
            draws all by EWA. Gradients are EWA's, and refuse another value; pose steps ignore it.
        threads: worker threads; 0 means one per core. Never changes the picture.
    """

    background: tuple[float, float, float] | NDArray[np.float32] = (0.0, 0.0, 0.0)
    region: tuple[int, int, int, int] | None = None
    tile_mask: NDArray[np.bool_] | None = None
    sh_degree: int = 3
    near_m: float = 0.05
    antialias: bool = False
    exact_above_rad: float = math.inf
    threads: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class Rendering:
    """A drawn picture.

    Attributes:
        rgb: (H, W, 3) float32, 0..1 where in gamut, background blended in.
        alpha: (H, W) float32, 0..1.
        depth: (H, W) float32, metres; alpha-weighted mean of z (pinhole) or range (fisheye) over
            what was hit; 0 where alpha is 0.
        ids: (H, W) int32 index of the object with the largest blend weight, -1 where none;
            optional.
    """

    rgb: NDArray[np.float32]
    alpha: NDArray[np.float32]
    depth: NDArray[np.float32]
    ids: NDArray[np.int32] | None = None


def tiles_of(camera: Pinhole | Fisheye) -> tuple[int, int]:
    """Rows and columns of the tiles of a picture."""
    return -(-camera.height_px // TILE_PX), -(-camera.width_px // TILE_PX)


class Renderer(Protocol):
    """Draws posed splat objects through a camera."""

    def render(
        self,
        objects: Sequence[PosedSplats],
        camera: Pinhole | Fisheye,
        world_from_camera: Pose,
        options: RenderOptions = ...,
    ) -> Rendering:
        """Draw all objects in one global order.

        Raises:
            ValueError: names the argument, what it got and what it wants.
        """
        ...
