"""Training steps of splats, in the native crate: draw, compare with a photo, go back, move.

What a step does is spelt out in numpy in `tests.twins.training_step`; tests hold the two together.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.render.native import draw_of, lens_of
from scenes.render.renderer import RenderOptions
from scenes.render.request import check_view, refuse_exact, refuse_parts

SSIM_SHARE = 0.2
"""Share of 1 - SSIM in the loss, as in 3D Gaussian splatting (Kerbl et al. 2023, equation 7)."""

FARTHEST = np.float32(1e30)
"""A far bound that bounds nothing."""

Arrays = tuple[
    NDArray[np.float32],
    NDArray[np.float32],
    NDArray[np.float32],
    NDArray[np.uint32],
    NDArray[np.float32],
]


@dataclass(frozen=True, slots=True)
class Exposure:
    """Exposure of a photo: gain · falloff · colour + bias.

    Attributes:
        gain: per channel.
        bias: per channel.
        falloff: f₀ and f₁ of 1 + f₀ r² + f₁ r⁴, with r the distance from the picture's centre over
            that of its corners: how a lens darkens them.
    """

    gain: tuple[float, float, float] = (1.0, 1.0, 1.0)
    bias: tuple[float, float, float] = (0.0, 0.0, 0.0)
    falloff: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class DepthBounds:
    """Between which depths each pixel of a photo shows a surface.

    Attributes:
        near: (H, W) float32, depth as the lens measures it; 0 where nothing is known.
        far: (H, W) float32; `FARTHEST` where nothing is known.
    """

    near: NDArray[np.float32]
    far: NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Distance:
    """How far a drawn picture is from a photo.

    Attributes:
        l1: mean over pixels and channels of the absolute difference.
        dssim: 1 - mean SSIM (Wang et al. 2004; Gaussian window of 11 px, σ = 1.5, zero beyond the
            border).
        d_gain, d_bias, d_falloff: gradients of the loss by the exposure.
    """

    l1: float
    dssim: float
    d_gain: tuple[float, float, float]
    d_bias: tuple[float, float, float]
    d_falloff: tuple[float, float]

    @property
    def loss(self) -> float:
        """Value that training makes small."""
        return (1 - SSIM_SHARE) * self.l1 + SSIM_SHARE * self.dssim


class TrainingTarget:
    """A photo to train on, with what of its SSIM does not depend on the splats.

    Args:
        picture: (H, W, 3) uint8 RGB.
        camera: the lens that took it, of the picture's size.
        world_from_camera: where it was taken.
        bounds: where its surfaces are, if that is known; of the picture's size.

    Raises:
        ValueError: the picture is not of that type or not of the camera's size.
    """

    def __init__(
        self,
        picture: NDArray[np.uint8],
        camera: Pinhole | Fisheye,
        world_from_camera: Pose,
        bounds: DepthBounds | None = None,
    ) -> None:
        from scenes import _native

        wanted = (camera.height_px, camera.width_px, 3)
        if picture.dtype != np.uint8 or picture.shape != wanted:
            raise ValueError(
                f"TrainingTarget.picture: got {picture.dtype} {picture.shape}, "
                f"wanted uint8 {wanted}"
            )
        size = (camera.width_px, camera.height_px)
        self.native = _native.TrainingTarget(
            np.ascontiguousarray(picture).ravel(),
            size=size,
            bounds=None if bounds is None else _flat(bounds),
        )
        self.camera = camera
        matrix = world_from_camera.inverse().matrix()
        self.camera_from_world = tuple(float(value) for value in matrix[:3].ravel())

    @property
    def nbytes(self) -> int:
        """Memory held."""
        return self.native.nbytes

    def distance(
        self, rgb: NDArray[np.float32], exposure: Exposure
    ) -> tuple[Distance, NDArray[np.float32]]:
        """Distance of a drawn (H, W, 3) float32 picture, and the loss's gradient by it."""
        raw, d_rgb = self.native.distance(
            np.ascontiguousarray(rgb, dtype=np.float32).ravel(),
            ssim_share=SSIM_SHARE,
            gain=exposure.gain,
            bias=exposure.bias,
            falloff=exposure.falloff,
        )
        return Distance(*raw), d_rgb.reshape(rgb.shape)


class Trainee:
    """Splats in training; their rows are described in `scenes.prepare.train.optimiser.rows`.

    Args:
        arrays: values, first moments, second moments (all (N, 11 + 3K) float32), steps (N,) uint32
            and error (N,) float32; copied.
        portable: use no vector instructions beyond the platform's minimum (tests).

    Raises:
        ImportError: the native crate has not been built.
        ValueError: the arrays do not belong together.
    """

    def __init__(self, arrays: Arrays, *, portable: bool = False) -> None:
        from scenes import _native

        values, first, second, steps, error = arrays
        self._width = values.shape[1]
        self._native = _native.Trainee(
            np.ascontiguousarray(values).ravel(),
            np.ascontiguousarray(first).ravel(),
            np.ascontiguousarray(second).ravel(),
            np.ascontiguousarray(steps),
            np.ascontiguousarray(error),
            sh_count=(self._width - 11) // 3,
            portable=portable,
        )

    def arrays(self) -> Arrays:
        """Copies of what training keeps, as the constructor takes it."""
        values, first, second, steps, error = self._native.rows()
        shape = (-1, self._width)
        return values.reshape(shape), first.reshape(shape), second.reshape(shape), steps, error

    @property
    def spent_ns(self) -> tuple[int, int, int, int]:
        """Nanoseconds spent drawing, comparing, going back through the tiles, moving the splats."""
        return self._native.spent_ns

    def step(
        self,
        target: TrainingTarget,
        rates: NDArray[np.float32],
        exposure: Exposure,
        options: RenderOptions,
        depth_price: float = 0.0,
    ) -> Distance:
        """One step of Adam, for the splats that the picture shows, towards a photo.

        Args:
            target: the photo.
            rates: (11 + 3K,) float32, learning rate of each number of a row.
            exposure: of the photo.
            options: how to draw; the same bits for any number of threads.
            depth_price: of blend weight off a pixel's `DepthBounds`, by how far off it is (a share
                of its depth, spelt out in `tests/twins/loss.py`); mean over the
                pixels.

        Raises:
            ValueError: names the argument, what it got and what it wants.
        """
        check_view(target.camera, options)
        refuse_parts(options, "training compares the whole photo")
        refuse_exact(options, "gradients are those of EWA")
        raw = self._native.step(
            target.native,
            target.camera_from_world,
            rates,
            lens=lens_of(target.camera),
            draw=draw_of(options),
            ssim_share=SSIM_SHARE,
            gain=exposure.gain,
            bias=exposure.bias,
            falloff=exposure.falloff,
            depth_price=depth_price,
        )
        return Distance(*raw)


def _flat(bounds: DepthBounds) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    near, far = (
        np.ascontiguousarray(v, dtype=np.float32).ravel() for v in (bounds.near, bounds.far)
    )
    return near, far
