"""Windows: the part of a lens picture that shows one object, at the lens's own pixels.

Nothing is remapped: a window is a rectangle of the lens picture, averaged over whole pixels where
the object is near, and its camera is the lens with another origin.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scenes.cameras import Fisheye, Rig
from scenes.pose import Pose
from scenes.warp import best_lens

if TYPE_CHECKING:
    from tracking.kernels.native import TrackLayer

MARGIN = 1.4
"""Side of a window over the angular size of the object in it."""

MIN_SIDE_PX = 112
LARGEST_SIDE_PX = 288
"""Sides of a window in its own pixels; larger ones are shrunk by a whole number."""


@dataclass(frozen=True, slots=True, eq=False)
class Window:
    """A rectangle of a lens picture.

    Attributes:
        lens: index of the lens.
        left: of the first lens pixel.
        top: of the first lens pixel.
        shrink: lens pixels per pixel of the window, each way.
        camera: the lens as the window shows it; depth is range.
        world_from_camera: pose of the lens.
        target: (3,) world point that the window is about.
    """

    lens: int
    left: int
    top: int
    shrink: int
    camera: Fisheye
    world_from_camera: Pose
    target: NDArray[np.float64]

    @property
    def corner_and_size(self) -> tuple[int, int, int, int]:
        """Left and top in lens pixels, width and height in the window's own."""
        return self.left, self.top, self.camera.width_px, self.camera.height_px

    @property
    def part(self) -> tuple[slice, slice]:
        """Rows and columns of the lens picture."""
        width, height = self.camera.width_px * self.shrink, self.camera.height_px * self.shrink
        return slice(self.top, self.top + height), slice(self.left, self.left + width)

    @property
    def target_range_m(self) -> float:
        """Distance of the target from the lens."""
        return float(np.linalg.norm(self.target - self.world_from_camera.translation))

    def lens_pixels(self, pixels: NDArray[np.float64]) -> NDArray[np.float64]:
        """(N, 2) pixels of the whole lens picture that are at pixels of the window."""
        return pixels * self.shrink + (self.left, self.top)


def window_around(
    rig: Rig,
    world_from_rig: Pose,
    centre_in_world: ArrayLike,
    *,
    radius_m: float,
    box_in_world: NDArray[np.float64] | None = None,
    lens: int | None = None,
    shrink: int = 1,
) -> Window:
    """The window of one object.

    Args:
        rig: the 360° camera.
        world_from_rig: its pose.
        centre_in_world: (3,) centre of the object.
        radius_m: of the sphere around the object.
        box_in_world: (N, 3) corners of its box where its pose is known; what lies far beside them
            is left out.
        lens: take this lens instead of the one that sees the centre best.
        shrink: lens pixels per pixel at least.
    """
    centre = np.asarray(centre_in_world, dtype=np.float64)
    chosen = best_lens(rig, world_from_rig, centre) if lens is None else lens
    world_from_lens = world_from_rig @ rig.rig_from_lens[chosen]
    source = rig.lenses[chosen]
    in_lens = world_from_lens.inverse() @ centre
    distance = max(float(np.linalg.norm(in_lens)), 1.05 * radius_m)
    half_angle = math.asin(min(0.8, radius_m / distance))
    wanted = max(2.0 * MARGIN * half_angle * source.f_px, MIN_SIDE_PX)
    shrink = max(shrink, math.ceil(wanted / LARGEST_SIDE_PX))
    middle = source.project(in_lens[None])[0][0]
    spans = np.stack([middle - 0.5 * wanted, middle + 0.5 * wanted])
    if box_in_world is not None:
        margin_px = (MARGIN - 1.0) * half_angle * source.f_px
        spans = _narrowed(
            spans, source.project(world_from_lens.inverse() @ box_in_world)[0], margin_px
        )
    return _cut(source, spans, shrink, lens=chosen, pose=world_from_lens, target=centre)


def _narrowed(
    spans: NDArray[np.float64], pixels: NDArray[np.float64], margin_px: float
) -> NDArray[np.float64]:
    """Spans without what lies farther than a margin beside some pixels, but no side too short."""
    low = np.maximum(spans[0], pixels.min(axis=0) - margin_px)
    high = np.minimum(spans[1], pixels.max(axis=0) + margin_px)
    missing = np.maximum(MIN_SIDE_PX - (high - low), 0.0)
    return np.stack([low - 0.5 * missing, high + 0.5 * missing])


def _cut(
    source: Fisheye,
    spans: NDArray[np.float64],
    shrink: int,
    *,
    lens: int,
    pose: Pose,
    target: NDArray[np.float64],
) -> Window:
    """The window over some columns and rows, moved so that it lies within the lens picture."""
    corner: list[int] = []
    size: list[int] = []
    for low, high, limit in zip(*spans, (source.width_px, source.height_px), strict=True):
        side = min(int(high - low), limit) // shrink * shrink
        first = round(0.5 * float(low + high) - 0.5 * side)
        corner.append(int(min(max(first, 0), limit - side)))
        size.append(side // shrink)
    camera = replace(
        source,
        width_px=size[0],
        height_px=size[1],
        f_px=source.f_px / shrink,
        cx=(source.cx - corner[0]) / shrink,
        cy=(source.cy - corner[1]) / shrink,
    )
    return Window(lens, corner[0], corner[1], shrink, camera, pose, target)


@dataclass(frozen=True, slots=True, eq=False)
class Layer:
    """An object drawn alone into a rectangle of a lens picture.

    Attributes:
        left: of the first lens pixel.
        top: of the first lens pixel.
        rgb: (H, W, 3) float32 over black.
        alpha: (H, W) float32.
        range_m: (H, W) float32, 0 where nothing was drawn.
    """

    left: int
    top: int
    rgb: NDArray[np.float32]
    alpha: NDArray[np.float32]
    range_m: NDArray[np.float32]

    def request(self, own_range_m: float) -> TrackLayer:
        """In the words of the native crate; what is nearer than a range hides what is there."""
        height, width = self.alpha.shape
        nearer = (self.range_m > 0) & (self.range_m < own_range_m)
        return {
            "corner": (self.left, self.top),
            "size": (width, height),
            "rgb": self.rgb,
            "alpha": self.alpha,
            "nearer": nearer.astype(np.float32),
        }
