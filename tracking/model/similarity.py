"""Photometric similarity of a small object, composited over the empty room, to the live picture.

The readable twin of the native `Setting`; `tracking.likelihood.patch_fit` uses the latter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tracking.kernels.photometry import ROUGHLY, SimilarityOptions
from tracking.window.filters import bell_blurred

FloatArray = NDArray[np.float32]

LENS_BLUR_PX = 0.6
"""Gaussian blur in px of the lens."""

LENS_REACH_PX = 2
"""Radius in px at which that blur is cut off."""


DETAIL_PX = 3.0
"""Gaussian blur in px that separates detail from its surroundings."""

DETAIL_REACH_PX = 9
"""Radius in px at which that blur is cut off."""


CLOSE_PX = 1.0
"""Gaussian blur in px that separates detail where a pose is right to a pixel."""

CLOSE_REACH_PX = 3
"""Radius in px at which that blur is cut off."""


@dataclass(frozen=True, slots=True, eq=False)
class Setting:
    """A part of the live picture, and the same without the object.

    Attributes:
        live: (H, W, 3) 0..1.
        empty: (H, W, 3) the empty room as the live camera records it.
        free: (H, W) 0..1, not occluded by a nearer object.
        options: of the comparison.
    """

    live: FloatArray
    empty: FloatArray
    free: FloatArray
    options: SimilarityOptions = ROUGHLY

    def residual_px(self, rgb: FloatArray, alpha: FloatArray) -> float:
        """Robust photometric residual, in pixels, of the live picture to the composited object.

        Args:
            rgb: (H, W, 3) the object alone, premultiplied by alpha.
            alpha: (H, W) of it.
        """
        shown, _ = self.shown(rgb, alpha)
        return robust_residual_px(shown, self.live, self.free)

    def similarity(self, rgb: FloatArray, alpha: FloatArray) -> float:
        """Similarity of a rendered object to the picture, at most 1, 0 by chance.

        The mean of the photometric gain over the empty room and of the gain in detail similarity.
        """
        shown, alpha = self.shown(rgb, alpha)
        on_object = self.free * (
            bell_blurred(alpha, LENS_BLUR_PX, LENS_REACH_PX) > self.options.on_object
        )
        live = self._detail(self.live)
        shared = _detail_similarity(self._detail(shown), live, on_object)
        without = max(_detail_similarity(self._detail(self.empty), live, on_object), 0.0)
        return 0.5 * (self._photometric_gain(shown) + shared - without)

    def shown(self, rgb: FloatArray, alpha: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The object over the empty room; its alpha."""
        rgb = bell_blurred(rgb, LENS_BLUR_PX, LENS_REACH_PX)
        alpha = bell_blurred(alpha, LENS_BLUR_PX, LENS_REACH_PX)
        shown = rgb + (1.0 - alpha)[..., None] * self.empty
        return np.asarray(shown, dtype=np.float32), alpha

    def _detail(self, picture: FloatArray) -> FloatArray:
        """(H, W, 3) fine structure of a picture."""
        scale = (CLOSE_PX, CLOSE_REACH_PX) if self.options.closely else (DETAIL_PX, DETAIL_REACH_PX)
        return np.asarray(picture - bell_blurred(picture, *scale), dtype=np.float32)

    def _photometric_gain(self, shown: FloatArray) -> float:
        """1 where the picture equals the composite, 0 where it is as near to the empty room.

        The larger of the observed and the rendered change normalises it: a small object does not
        account for a large change, nor a large object for a small one.
        """
        changed_px = robust_residual_px(self.empty, self.live, self.free)
        most = max(changed_px, robust_residual_px(self.empty, shown, self.free))
        return (most - robust_residual_px(shown, self.live, self.free)) / (
            most + self.options.doubt_px
        )


def robust_residual_px(first: FloatArray, second: FloatArray, free: FloatArray) -> float:
    """Number of free pixels in which two pictures differ (Geman-McClure)."""
    apart = first - second
    apart2 = np.einsum("hwc,hwc->hw", apart, apart)
    return float((free * apart2 / (apart2 + ROUGHLY.residual_scale**2)).sum())


def _detail_similarity(first: FloatArray, second: FloatArray, weight: FloatArray) -> float:
    """-1..1 similarity of the detail of two pictures, in strength as well.

    Illumination, shadows and faults of an empty room are smooth and have no detail.
    """
    weights = np.repeat(weight.ravel(), 3)
    a, b = first.ravel(), second.ravel()
    power = float(weights @ (a * a + b * b))
    return 2.0 * float(weights @ (a * b)) / max(power, 1e-6)
