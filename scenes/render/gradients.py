# pyright: standard
"""Gradients of a picture with respect to the splats and poses it was drawn from.

The loss L is any function of a `Rendering`; what is given are its derivatives with respect to the
picture's values. Which splat reaches which pixel (alpha above 1/255, transmittance above its stop)
and the order of the splats are held fixed, as in 3D Gaussian splatting (Kerbl et al. 2023, section
4); a limit (alpha at 0.99, colour at 0, opacity above 1) lets no gradient through. `ids` has none.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.render.pose_step import twists_of_camera, twists_of_object
from scenes.render.renderer import PosedSplats, Rendering, RenderOptions
from scenes.render.request import described

if TYPE_CHECKING:
    from scenes.render.native import Tape


@dataclass(frozen=True, slots=True, eq=False)
class ObjectGradients:
    """dL/d(an object's values), zero for splats that are not seen.

    Attributes:
        means: (N, 3) float32, per metre.
        scales: (N, 3) float32, per metre.
        rotations: (N, 4) float32, of the quaternions (w, x, y, z) as given, through their
            normalisation: at right angles to each quaternion.
        opacities: (N,) float32.
        sh: (N, K, 3) float32; zero above the degree drawn.
        world_from_object: (6,) float64, of a step as in `scenes.render.pose_step`: per metre and
            per radian, in world axes, turning about the object's origin.
    """

    means: NDArray[np.float32]
    scales: NDArray[np.float32]
    rotations: NDArray[np.float32]
    opacities: NDArray[np.float32]
    sh: NDArray[np.float32]
    world_from_object: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Gradients:
    """dL/d(everything a picture was drawn from).

    Attributes:
        objects: one per object drawn, in order.
        world_from_camera: (6,) float64, of a step as in `scenes.render.pose_step`, turning about
            the camera's centre.
    """

    objects: tuple[ObjectGradients, ...]
    world_from_camera: NDArray[np.float64]


class Recording:
    """A picture that remembers how it was drawn. Made by `record`.

    Attributes:
        rendering: the picture, equal to `NativeRenderer.render`'s to the bit.
    """

    def __init__(
        self,
        rendering: Rendering,
        tape: Tape,
        objects: Sequence[PosedSplats],
        world_from_camera: Pose,
    ) -> None:
        self.rendering = rendering
        self._tape = tape
        self._objects = tuple(objects)
        self._world_from_camera = world_from_camera

    def gradients(
        self,
        d_rgb: NDArray[np.float32] | None = None,
        d_alpha: NDArray[np.float32] | None = None,
        d_depth: NDArray[np.float32] | None = None,
    ) -> Gradients:
        """Gradients of a loss; the same to the bit for any number of threads.

        Args:
            d_rgb: (H, W, 3) float32, dL/d rendering.rgb; None where it does not matter.
            d_alpha: (H, W) float32, dL/d rendering.alpha.
            d_depth: (H, W) float32, dL/d rendering.depth, per metre; ignored where alpha is 0.

        Raises:
            ValueError: an array has the wrong shape or dtype or a value that is not finite.
        """
        shape = self.rendering.alpha.shape
        checked = checked_picture_gradients(shape, d_rgb=d_rgb, d_alpha=d_alpha, d_depth=d_depth)
        raw = self._tape.gradients(*(values.ravel() for values in checked))
        camera = np.zeros(6)
        objects = []
        for posed, (means, scales, rotations, opacities, sh, twist) in zip(
            self._objects, raw, strict=True
        ):
            n = len(posed.cloud)
            step = twists_of_object(self._world_from_camera, posed.world_from_object) @ twist
            camera += twists_of_camera(self._world_from_camera) @ twist
            objects.append(
                ObjectGradients(
                    means.reshape(n, 3),
                    scales.reshape(n, 3),
                    rotations.reshape(n, 4),
                    opacities,
                    sh.reshape(posed.cloud.sh.shape),
                    step,
                )
            )
        return Gradients(tuple(objects), camera)


def record(
    renderer: NativeRenderer,
    objects: Sequence[PosedSplats],
    camera: Pinhole | Fisheye,
    world_from_camera: Pose,
    options: RenderOptions | None = None,
) -> Recording:
    """Draw all objects so that the picture can be differentiated.

    Raises:
        ValueError: names the argument, what it got and what it wants.
    """
    options = options or RenderOptions()
    rendering, tape = renderer.record(objects, camera, world_from_camera, options)
    return Recording(rendering, tape, objects, world_from_camera)


def checked_picture_gradients(
    shape: tuple[int, ...],
    *,
    d_rgb: NDArray[np.float32] | None,
    d_alpha: NDArray[np.float32] | None,
    d_depth: NDArray[np.float32] | None,
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """(H, W, 3), (H, W) and (H, W) gradients of a picture's values; zeros in place of None.

    Args:
        shape: (H, W).
        d_rgb: dL/d rendering.rgb.
        d_alpha: dL/d rendering.alpha.
        d_depth: dL/d rendering.depth.

    Raises:
        ValueError: an array has the wrong shape or dtype or a value that is not finite.
    """
    return (
        _check("d_rgb", d_rgb, (*shape, 3)),
        _check("d_alpha", d_alpha, shape),
        _check("d_depth", d_depth, shape),
    )


def _check(
    name: str, values: NDArray[np.float32] | None, shape: tuple[int, ...]
) -> NDArray[np.float32]:
    if values is None:
        return np.zeros(shape, dtype=np.float32)
    if not isinstance(values, np.ndarray) or values.dtype != np.float32 or values.shape != shape:
        raise ValueError(f"{name}: got {described(values)}, wanted float32 {shape}")
    if not np.isfinite(values).all():
        count = int((~np.isfinite(values)).sum())
        raise ValueError(f"{name}: {count} of {values.size} values are not finite, wanted none")
    return np.ascontiguousarray(values)
