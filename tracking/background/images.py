"""Background images: the empty room as each lens would see it, and the live picture's difference.

The object-less room splats are rendered once per lens and camera pose. A live picture is compared
with its background image after a robust fit of exposure and vignetting; a pixel that only got
darker while its chromaticity and gradient stay is shadow, not an object.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Rig
from scenes.pose import Pose, rotation_angle
from scenes.render.renderer import PosedSplats, Renderer, RenderOptions
from scenes.splats import SplatCloud
from tracking.background.strips import Strips
from tracking.kernels import native
from tracking.kernels.background import LEARNING
from tracking.kernels.options import OPTIONS
from tracking.window.filters import bell_blurred, box_blurred, grey, slopes

FloatArray = NDArray[np.float32]
BoolArray = NDArray[np.bool_]

SAME_PLACE_M = 1e-4
"""Camera displacement in m below which background images are kept."""

SAME_ANGLE_RAD = 1e-5
"""Camera turn in rad below which background images are kept."""

KNOWN_COVERAGE = 0.5
"""Alpha of the room from which its drawn distance is that of a surface: most of the light that
reaches the pixel comes from it."""

MIN_GAIN = 0.2
"""Gain of an exposure below which nothing is seen: the least that a fit is trusted with."""


@dataclass(frozen=True, slots=True, eq=False)
class BackgroundImages:
    """The empty room as each lens would see it from one camera pose.

    Attributes:
        world_from_rig: the camera pose.
        images: one (H, W, 3) float32 0..1 picture per lens.
        noise: one (H, W) float32 standard deviation per lens, in channels of 0..1.
        coverage: one (H, W) float32 alpha per lens; the room is unknown where it is low.
        learned: one (H, W) bool per lens: the pixel was observed live
            (`tracking.background.learning`).
        ranges_m: one (H, W) float32 per lens, distance of the room; 0 where it is unknown.
    """

    world_from_rig: Pose
    images: tuple[Strips[np.float32], ...]
    noise: tuple[Strips[np.float32], ...]
    coverage: tuple[FloatArray, ...]
    learned: tuple[Strips[np.bool_], ...]
    ranges_m: tuple[FloatArray, ...]

    @staticmethod
    def of_pictures(
        world_from_rig: Pose,
        images: Sequence[FloatArray],
        coverage: Sequence[FloatArray],
        *,
        ranges_m: Sequence[FloatArray] | None = None,
    ) -> BackgroundImages:
        """Background images before any learning, from one picture and its alpha per lens.

        Args:
            world_from_rig: the camera pose.
            images: (H, W, 3) empty room, 0..1.
            coverage: (H, W) its alpha.
            ranges_m: (H, W) its distance; unknown if None.
        """
        if ranges_m is None:
            ranges_m = [np.zeros(image.shape[:2], np.float32) for image in images]
        return BackgroundImages(
            world_from_rig,
            tuple(Strips[np.float32].of(image) for image in images),
            tuple(Strips[np.float32].of(background_noise(image)) for image in images),
            tuple(coverage),
            tuple(Strips[np.bool_].of(np.zeros(image.shape[:2], np.bool_)) for image in images),
            tuple(ranges_m),
        )

    def is_at(self, world_from_rig: Pose) -> bool:
        """Whether the images are valid for a camera at this pose."""
        moved = self.world_from_rig.inverse() @ world_from_rig
        return (
            float(np.linalg.norm(moved.translation)) < SAME_PLACE_M
            and rotation_angle(moved.rotation) < SAME_ANGLE_RAD
        )


@dataclass(frozen=True, slots=True, eq=False)
class Exposure:
    """Photometric response of a lens: `live = background · (gain + falloff · r²) + offset`.

    Attributes:
        gain: (3,) per channel.
        falloff: (3,) vignetting per channel; r = 1 at the border of the lens circle.
        offset: (3,) per channel, in channels of 0..1.
    """

    gain: NDArray[np.float64]
    falloff: NDArray[np.float64]
    offset: NDArray[np.float64]

    def rows(self) -> list[list[float]]:
        """Gain, falloff and offset as the native kernel wants them."""
        return [self.gain.tolist(), self.falloff.tolist(), self.offset.tolist()]


@dataclass(frozen=True, slots=True, eq=False)
class Difference:
    """How a view differs from the empty room.

    Attributes:
        probability: (H, W) float32, 0..1, that a pixel shows something that isn't in the room scan.
        expected: (H, W, 3) float32 0..1, the empty room at the live picture's exposure.
        live: (H, W, 3) float32 0..1, the live picture.
    """

    probability: FloatArray
    expected: FloatArray
    live: FloatArray

    def mask(self) -> BoolArray:
        """(H, W) bool: more likely foreground than not."""
        return self.probability > 0.5


def render_background(
    renderer: Renderer, room: SplatCloud, rig: Rig, world_from_rig: Pose, *, threads: int = 0
) -> BackgroundImages:
    """Draw the empty room through every lens of a rig."""
    posed = (PosedSplats(room, Pose.identity()),)
    images: list[FloatArray] = []
    coverage: list[FloatArray] = []
    ranges_m: list[FloatArray] = []
    for lens, rig_from_lens in zip(rig.lenses, rig.rig_from_lens, strict=True):
        drawn = renderer.render(
            posed, lens, world_from_rig @ rig_from_lens, RenderOptions(threads=threads)
        )
        images.append(np.clip(drawn.rgb, 0.0, 1.0))
        coverage.append(drawn.alpha)
        ranges_m.append(np.where(drawn.alpha > KNOWN_COVERAGE, drawn.depth, 0.0).astype(np.float32))
    return BackgroundImages.of_pictures(world_from_rig, images, coverage, ranges_m=ranges_m)


def background_noise(image: FloatArray) -> FloatArray:
    """(H, W) standard deviation expected between a background image and a live picture."""
    gx, gy = slopes(grey(image))
    slope = box_blurred(np.hypot(gx, gy).astype(np.float32), 5)
    return np.sqrt(LEARNING.noise_floor**2 + (LEARNING.misalignment_px * slope) ** 2).astype(
        np.float32
    )


def fit_exposure(
    live: NDArray[np.uint8],
    background_image: FloatArray | Strips[np.float32],
    coverage: FloatArray,
    *,
    samples: int = 32,
    iterations: int = 6,
) -> Exposure:
    """Robust fit of a lens's gain, vignetting and offset, insensitive to people and objects.

    Args:
        live: (H, W, 3) uint8 lens picture.
        background_image: (H, W, 3) empty room.
        coverage: (H, W) its alpha.
        samples: about this many pixels per side are used.
        iterations: of reweighting (Geman-McClure with a shrinking scale).
    """
    height, width = background_image.shape[:2]
    step = max(1, min(height, width) // samples)
    rows, columns = slice(step // 2, None, step), slice(step // 2, None, step)
    used = coverage[rows, columns] > 0.95
    observed = live[rows, columns][used].astype(np.float64) / 255.0
    model = background_image[rows, columns][used].astype(np.float64)
    x = (np.arange(width)[columns] + 0.5) / width - 0.5
    y = (np.arange(height)[rows] + 0.5) / height - 0.5
    radius2 = (x[None, :] ** 2 + y[:, None] ** 2)[used] * 4.0
    neutral = Exposure(np.ones(3), np.zeros(3), np.zeros(3))
    if len(observed) < 50:
        return neutral
    fits = [
        native.exposure(
            np.ascontiguousarray(model[:, c]),
            radius2,
            np.ascontiguousarray(observed[:, c]),
            iterations,
        )
        for c in range(3)
    ]
    gain, falloff, offset = np.array(fits).T
    if not np.isfinite(fits).all() or (gain < MIN_GAIN).any() or (gain > 5.0).any():
        return neutral
    return Exposure(gain, falloff, offset)


class LensExposures:
    """Exposure of every lens of a frame, fitted when first needed and then kept for that frame.

    Args:
        images: (H, W, 3) uint8 live pictures, one per lens.
        background: the empty room.
    """

    def __init__(self, images: Sequence[NDArray[np.uint8]], background: BackgroundImages) -> None:
        self._lenses = tuple(zip(images, background.images, background.coverage, strict=True))
        self._fitted: dict[int, Exposure] = {}

    def __getitem__(self, lens: int) -> Exposure:
        """Of one lens, by its index."""
        if lens not in self._fitted:
            self._fitted[lens] = fit_exposure(*self._lenses[lens])
        return self._fitted[lens]


def expose(background_image: FloatArray, exposure: Exposure, *, radius2: FloatArray) -> FloatArray:
    """A background image as the live camera would record it.

    Args:
        background_image: (H, W, 3) empty room, in any view.
        exposure: of the lens it comes from.
        radius2: (H, W) squared distance from the lens's centre, 1 at the border.
    """
    falloff, offset = exposure.falloff.astype(np.float32), exposure.offset.astype(np.float32)
    gain, radius2 = exposure.gain.astype(np.float32), radius2.astype(np.float32)
    exposed = np.empty(background_image.shape, dtype=np.float32)
    # By channel: numpy takes thrice as long where its innermost loop runs over three values.
    for channel in range(3):
        here = gain[channel] + radius2 * falloff[channel]
        exposed[..., channel] = background_image[..., channel] * here + offset[channel]
    return exposed


def unexposed(shown: FloatArray, exposure: Exposure, *, radius2: FloatArray) -> FloatArray:
    """(N, 3) colours of a background image that `expose` would show as some live pixels.

    Args:
        shown: (N, 3) those pixels, 0..1.
        exposure: of the lens they come from.
        radius2: (N,) squared distance from the lens's centre, 1 at the border.
    """
    gain = exposure.gain + radius2[:, None] * exposure.falloff
    colours = (shown - exposure.offset) / np.maximum(gain, MIN_GAIN)
    return np.clip(colours, 0.0, 1.0).astype(np.float32)


def difference(live: FloatArray, expected: FloatArray, noise: FloatArray) -> Difference:
    """Soft foreground probability of a view; a part of the native kernel `change`.

    Args:
        live: (H, W, 3) float32 0..1.
        expected: (H, W, 3) float32, the empty room at the same exposure.
        noise: (H, W) float32 standard deviation per channel.
    """
    residual = bell_blurred(live - expected, 0.8, 1)
    distance2 = np.einsum("hwc,hwc->hw", residual, residual) / (noise * noise)
    shadow = _shadow_likelihood(live, expected, noise)
    weighed = distance2 * (1.0 - OPTIONS.shadow_discount * shadow)
    probability = 1.0 - np.exp(-0.5 * weighed / 9.0)
    return Difference(probability.astype(np.float32), expected, live)


def _shadow_likelihood(live: FloatArray, expected: FloatArray, noise: FloatArray) -> FloatArray:
    """(H, W) 0..1: the pixel looks like the same surface in other light."""
    live, expected = bell_blurred(live, 1.2, 3), bell_blurred(expected, 1.2, 3)
    power = np.einsum("hwc,hwc->hw", expected, expected) + 1e-4
    ratio = np.einsum("hwc,hwc->hw", live, expected) / power
    hue = live - ratio[..., None] * expected
    sigma2 = OPTIONS.shadow_hue**2 + 0.1 * noise * noise
    hue2 = np.einsum("hwc,hwc->hw", hue, hue) / sigma2
    dark, darker = OPTIONS.shadow_darkest[1], OPTIONS.shadow_darkest[0]
    light, lighter = OPTIONS.shadow_gone
    plausible = np.clip((ratio - darker) / (dark - darker), 0.0, 1.0)
    plausible *= np.clip((lighter - ratio) / (lighter - light), 0.0, 1.0)
    grey_live = np.log(np.maximum(live.mean(axis=2), 0.02))
    grey_expected = np.log(np.maximum(expected.mean(axis=2), 0.02))
    detail = grey_live - grey_expected
    gx, gy = slopes(detail)
    texture_change2 = box_blurred((gx * gx + gy * gy).astype(np.float32), 3) / 0.05**2
    return (plausible * np.exp(-0.5 * hue2) * np.exp(-0.5 * texture_change2)).astype(np.float32)
