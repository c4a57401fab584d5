"""How well a small object that is drawn into the empty room explains the live picture.

The readable twin of the native `Setting`, with its constants; `tracking.likelihood.patch_fit`
asks the latter.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tracking.window.filters import bell_blurred

FloatArray = NDArray[np.float32]

LENS_BLUR_PX, LENS_REACH_PX = 0.6, 2
RESIDUAL_SCALE = 0.15
"""A colour farther off than this, of 0..1 channels, is something else: how far does not matter."""

ON_OBJECT = 0.1
"""Where at least so much of the object is drawn, with a pixel around it, its detail is compared."""

DETAIL_PX, DETAIL_REACH_PX = 3.0, 9
"""What differs from its surroundings of this size is detail."""

DOUBT_PX = 8.0
"""Where only so few pixels have changed, half of what they say counts."""

LIGHT_BLUR_PX, LIGHT_REACH_PX = 4.0, 12
"""How smoothly light changes from place to place of a room."""

CLOSE_PX, CLOSE_REACH_PX = 1.0, 3
"""The scale of detail where a pose is right to a pixel."""

ROUGHLY: Mapping[str, float | bool] = {
    "strange": RESIDUAL_SCALE,
    "on_object": ON_OBJECT,
    "doubt_px": DOUBT_PX,
    "closely": False,
}
CLOSELY: Mapping[str, float | bool] = {**ROUGHLY, "closely": True}
"""In the words of the native crate, which has the blurs of its own."""

BY_DETAIL: Mapping[str, float | bool] = {**ROUGHLY, "doubt_px": math.inf}
"""Only detail counts, whatever share of the pixels is explained: in doubtful light."""


@dataclass(frozen=True, slots=True, eq=False)
class Setting:
    """A part of the live picture, and what it would show without the object.

    Attributes:
        live: (H, W, 3) 0..1.
        empty: (H, W, 3) what the live picture would show there without anything new.
        free: (H, W) 0..1, not covered by a nearer object.
        closely: whether a drawn object is right to a pixel, so that small detail tells.
    """

    live: FloatArray
    empty: FloatArray
    free: FloatArray
    closely: bool = False

    def residual_px(self, rgb: FloatArray, alpha: FloatArray) -> float:
        """In how many pixels the live picture is not what a drawn object would make it.

        Args:
            rgb: (H, W, 3) the object alone, weighted with its alpha.
            alpha: (H, W) of it.
        """
        shown, _ = self.shown(rgb, alpha)
        return robust_residual_px(shown, self.live, self.free)

    def similarity(self, rgb: FloatArray, alpha: FloatArray) -> float:
        """How much a drawn object resembles the picture, at most 1, 0 for by chance.

        The mean of the share of pixels that it explains, and of how much more of the picture's
        detail there is its own than the empty room's.
        """
        shown, alpha = self.shown(rgb, alpha)
        on_object = self.free * (bell_blurred(alpha, LENS_BLUR_PX, LENS_REACH_PX) > ON_OBJECT)
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
        scale = (CLOSE_PX, CLOSE_REACH_PX) if self.closely else (DETAIL_PX, DETAIL_REACH_PX)
        return np.asarray(picture - bell_blurred(picture, *scale), dtype=np.float32)

    def _photometric_gain(self, shown: FloatArray) -> float:
        """1 if the picture is as shown, 0 if it is as near to what is there without the object.

        Something large that has changed is not explained by a small object, and a large object is
        not seen where little has changed: the larger of the two changes counts.
        """
        changed_px = robust_residual_px(self.empty, self.live, self.free)
        most = max(changed_px, robust_residual_px(self.empty, shown, self.free))
        return (most - robust_residual_px(shown, self.live, self.free)) / (most + DOUBT_PX)


def illumination_ratio(
    room: FloatArray, live: FloatArray, *, limits: tuple[float, float]
) -> FloatArray:
    """(H, W) how much lighter each part of an empty room is seen live: shadows are smooth.

    Args:
        room: (H, W, 3) its picture.
        live: (H, W, 3) the live picture there.
        limits: of the answer.
    """
    both = np.einsum("hwc,hwc->hw", room, live)
    power = np.einsum("hwc,hwc->hw", room, room)
    both = bell_blurred(both, LIGHT_BLUR_PX, LIGHT_REACH_PX)
    power = bell_blurred(power, LIGHT_BLUR_PX, LIGHT_REACH_PX)
    return np.clip(both / np.maximum(power, 1e-6), *limits).astype(np.float32)


def robust_residual_px(first: FloatArray, second: FloatArray, free: FloatArray) -> float:
    """In how many pixels two pictures differ, of those that are free."""
    apart = first - second
    apart2 = np.einsum("hwc,hwc->hw", apart, apart)
    return float((free * apart2 / (apart2 + RESIDUAL_SCALE**2)).sum())


def _detail_similarity(first: FloatArray, second: FloatArray, weight: FloatArray) -> float:
    """-1..1: how alike the fine structures of two pictures are, in strength as well.

    Light, shadows and faults of an empty room are smooth; flat floor is not like a plain object,
    which has an outline.
    """
    weights = np.repeat(weight.ravel(), 3)
    a, b = first.ravel(), second.ravel()
    power = float(weights @ (a * a + b * b))
    return 2.0 * float(weights @ (a * b)) / max(power, 1e-6)
