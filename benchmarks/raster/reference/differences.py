# pyright: standard
"""Gradients in readable float64: differences of a picture whose mask and order are frozen.

Renderings jump where a splat's alpha crosses 1/255 and where two splats swap places, so differences
of `ReferenceRenderer` say nothing about the gradients. `FrozenPicture` decides once, at a base
point, which splat reaches which pixel and in which order; it is then smooth in the values.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.raster.reference.renderer import (
    Footprints,
    draw_order,
    footprints_of,
    in_scope,
    inside_lens,
    is_sound,
    pixel_rays,
    squared_distances,
)
from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose, rotation_from_quaternion
from scenes.render.renderer import (
    ALPHA_MAX,
    ALPHA_MIN,
    TRANSMITTANCE_STOP,
    PosedSplats,
    RenderOptions,
)
from scenes.splats import SH_COUNTS, SplatCloud

FloatArray = NDArray[np.float64]

STEP = 1e-6
"""Half width of a difference, in metres, radians or units of the value."""


@dataclass(frozen=True, slots=True, eq=False)
class ExactCloud:
    """The values of a `SplatCloud` in float64, so that small steps are not rounded away."""

    means: FloatArray
    scales: FloatArray
    rotations: FloatArray
    opacities: FloatArray
    sh: FloatArray

    @staticmethod
    def of(cloud: SplatCloud) -> ExactCloud:
        """The same values."""
        arrays = (cloud.means, cloud.scales, cloud.rotations, cloud.opacities, cloud.sh)
        return ExactCloud(*(array.astype(np.float64) for array in arrays))

    def __len__(self) -> int:
        return len(self.means)

    @property
    def sh_degree(self) -> int:
        """0 to 3."""
        return SH_COUNTS.index(self.sh.shape[1])

    def select(self, index: NDArray[np.bool_]) -> ExactCloud:
        """The splats chosen by a mask."""
        arrays = (self.means, self.scales, self.rotations, self.opacities, self.sh)
        return ExactCloud(*(array[index] for array in arrays))

    def covariances(self) -> FloatArray:
        """(N, 3, 3), square metres."""
        factor = rotation_from_quaternion(self.rotations) * self.scales[:, None, :]
        return factor @ np.swapaxes(factor, 1, 2)


@dataclass(frozen=True, slots=True, eq=False)
class ExactPicture:
    """As `Rendering`, in float64."""

    rgb: FloatArray
    alpha: FloatArray
    depth: FloatArray


class FrozenPicture:
    """A picture as a smooth function of its splats' values and poses, about a base point.

    Memory and time grow with splats × pixels: for small scenes.

    Args:
        objects: base point; sound splats that are all drawn (see `drawable`).
        camera: the lens.
        world_from_camera: base point.
        options: what to draw.
    """

    def __init__(
        self,
        objects: Sequence[PosedSplats],
        camera: Pinhole | Fisheye,
        world_from_camera: Pose,
        options: RenderOptions,
    ) -> None:
        self._camera, self._options = camera, options
        self.clouds = tuple(ExactCloud.of(posed.cloud) for posed in objects)
        self.world_from_objects = tuple(posed.world_from_object for posed in objects)
        self.world_from_camera = world_from_camera
        self._rays = pixel_rays(camera)
        prints = self._project(self.clouds, self.world_from_objects, world_from_camera)
        self._order = draw_order(prints)
        alphas = self._raw_alphas(prints)
        self._is_limited = alphas >= ALPHA_MAX
        self._is_drawn = alphas >= ALPHA_MIN
        is_open = inside_lens(camera) & in_scope(camera, options)
        through = np.where(is_open, 1.0, 0.0)
        for k, alpha in enumerate(alphas):
            self._is_drawn[k] &= through >= TRANSMITTANCE_STOP
            through = through * np.where(self._is_drawn[k], 1.0 - np.minimum(alpha, ALPHA_MAX), 1.0)

    def draw(
        self,
        clouds: Sequence[ExactCloud] | None = None,
        world_from_objects: Sequence[Pose] | None = None,
        world_from_camera: Pose | None = None,
    ) -> ExactPicture:
        """The picture for other values than those of the base point, mask and order held."""
        weights, prints = self._blend(clouds, world_from_objects, world_from_camera)
        colours = np.array([prints[index].colours[i] for index, i in self._order])
        depths = np.array([prints[index].depths[i] for index, i in self._order])
        alpha = weights.sum(axis=0)
        rgb = np.einsum("khw,kc->hwc", weights, colours)
        rgb += (1.0 - alpha)[..., None] * np.asarray(self._options.background)
        depth = np.einsum("khw,k->hw", weights, depths) / np.where(alpha > 0, alpha, 1.0)
        return ExactPicture(rgb, alpha, depth)

    def light(
        self,
        clouds: Sequence[ExactCloud] | None = None,
        world_from_objects: Sequence[Pose] | None = None,
        world_from_camera: Pose | None = None,
    ) -> tuple[FloatArray, FloatArray]:
        """Blend weights (K, H, W) and depths (K,) that the picture's light comes from."""
        weights, prints = self._blend(clouds, world_from_objects, world_from_camera)
        return weights, np.array([prints[index].depths[i] for index, i in self._order])

    def _blend(
        self,
        clouds: Sequence[ExactCloud] | None,
        world_from_objects: Sequence[Pose] | None,
        world_from_camera: Pose | None,
    ) -> tuple[FloatArray, list[Footprints]]:
        prints = self._project(
            clouds or self.clouds,
            world_from_objects or self.world_from_objects,
            world_from_camera or self.world_from_camera,
        )
        alphas = np.where(self._is_limited, ALPHA_MAX, self._raw_alphas(prints))
        alphas = np.where(self._is_drawn, alphas, 0.0)
        after = np.cumprod(1.0 - alphas, axis=0)
        before = np.concatenate([np.ones_like(after[:1]), after[:-1]])
        return np.asarray(alphas * before, dtype=np.float64), prints

    def _project(
        self,
        clouds: Sequence[ExactCloud],
        world_from_objects: Sequence[Pose],
        world_from_camera: Pose,
    ) -> list[Footprints]:
        camera_from_world = world_from_camera.inverse()
        prints = []
        for cloud, world_from_object in zip(clouds, world_from_objects, strict=True):
            pose = camera_from_world @ world_from_object
            # An ExactCloud has everything that is asked of a SplatCloud there.
            found = footprints_of(cloud, pose, self._camera, self._options)  # type: ignore[arg-type]
            prints.append(found)
            if len(prints[-1].depths) != len(cloud):
                raise ValueError(
                    f"FrozenPicture: {len(prints[-1].depths)} of {len(cloud)} splats are drawn, "
                    "wanted all: choose them with `drawable` first"
                )
        return prints

    def _raw_alphas(self, prints: Sequence[Footprints]) -> FloatArray:
        """(splats in order, H, W) opacity · falloff, without limits."""
        whole = (slice(0, self._camera.height_px), slice(0, self._camera.width_px))
        alphas = []
        for index, i in self._order:
            p = prints[index]
            square = squared_distances(p, i, whole, self._rays)
            alphas.append(p.opacities[i] * np.exp(-0.5 * square))
        return np.array(alphas)


def drawable(
    cloud: SplatCloud,
    world_from_object: Pose,
    camera: Pinhole | Fisheye,
    world_from_camera: Pose,
    options: RenderOptions,
) -> NDArray[np.bool_]:
    """(N,) which splats a renderer keeps: sound, beyond the near limit, in the lens."""
    pose = world_from_camera.inverse() @ world_from_object
    sound = is_sound(cloud)
    kept = [
        bool(sound[i])
        and len(footprints_of(cloud.select(np.array([i])), pose, camera, options).depths) == 1
        for i in range(len(cloud))
    ]
    return np.array(kept, dtype=np.bool_)


def difference(loss: Callable[[float], float], step: float = STEP) -> float:
    """Slope of the loss at 0, by a central difference."""
    return (loss(step) - loss(-step)) / (2.0 * step)
