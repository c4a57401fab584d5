# pyright: standard
"""How bright each photo is, and how the lens darkens its corners: found while training.

A gain and a bias per view and channel, and one falloff for all views (see
`scenes.render.training.Exposure`). Without them every view would pull the splats to its own
brightness.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scenes.render.training import Distance, Exposure

RATE = 1e-3
"""Learning rate."""
BETAS = (0.9, 0.99)
"""Decay of Adam's two moments."""
EPSILON = 1e-15
"""Adam's guard against division by nothing."""
PULL = 0.01
"""Share of the way back to "as drawn" per step: a common gain would be nobody's."""
PER_VIEW = 6
"""Values of a view: gain and bias in red, green and blue."""
FALLOFF = 2
"""Values of the lens's falloff, shared by all views."""


class Exposures:
    """Exposures of all views, moved by Adam a view at a time.

    Attributes:
        values: (6 V + 2,) float64: gain and bias of each view, then the falloff.
        moments: (2, 6 V + 2) float64, Adam's.
        steps: (V + 1,) int64: of each view, and of all.
    """

    def __init__(self, views: int) -> None:
        size = PER_VIEW * views + FALLOFF
        self.values = np.zeros(size)
        self.values[:-FALLOFF].reshape(views, 2, 3)[:, 0] = 1.0
        self.moments = np.zeros((2, size))
        self.steps = np.zeros(views + 1, dtype=np.int64)

    def of(self, view: int) -> Exposure:
        """Exposure of a view."""
        r, g, b, red, green, blue = self.values[PER_VIEW * view : PER_VIEW * (view + 1)].tolist()
        return Exposure((r, g, b), (red, green, blue), self._falloff())

    def lens(self) -> Exposure:
        """Part of the exposure that all views share."""
        return Exposure(falloff=self._falloff())

    def step(self, view: int, distance: Distance) -> None:
        """One step against a view's gradients."""
        own = np.arange(PER_VIEW * view, PER_VIEW * (view + 1))
        self._move(own, np.array([*distance.d_gain, *distance.d_bias]), view)
        self.values[own] += PULL * (np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0]) - self.values[own])
        shared = np.arange(len(self.values) - FALLOFF, len(self.values))
        self._move(shared, np.array(distance.d_falloff), -1)

    def _move(self, places: NDArray[np.int64], gradient: NDArray[np.float64], counter: int) -> None:
        self.steps[counter] += 1
        corrected = []
        for moment, beta, value in zip(self.moments, BETAS, (gradient, gradient**2), strict=True):
            moment[places] = beta * moment[places] + (1 - beta) * value
            corrected.append(moment[places] / (1 - beta ** self.steps[counter]))
        first, second = corrected
        self.values[places] -= RATE * first / (np.sqrt(second) + EPSILON)

    def _falloff(self) -> tuple[float, float]:
        square, quartic = self.values[-FALLOFF:].tolist()
        return (square, quartic)


def fitted(
    drawn: NDArray[np.float32], photo: NDArray[np.float32], lens: Exposure
) -> NDArray[np.float32]:
    """`drawn` through the lens, with the gain and bias per channel that suit `photo` best.

    Args:
        drawn: (H, W, 3), as drawn.
        photo: (H, W, 3), 0..1.
        lens: its falloff.
    """
    seen = as_seen(drawn.astype(np.float64), lens)
    out = np.empty_like(drawn)
    for channel in range(3):
        x, y = seen[..., channel], photo[..., channel].astype(np.float64)
        variance = x.var()
        gain = ((x - x.mean()) * (y - y.mean())).mean() / variance if variance > 0 else 1.0
        out[..., channel] = gain * (x - x.mean()) + y.mean()
    return np.clip(out, 0, 1)


def as_seen(rgb: NDArray[np.float64], exposure: Exposure) -> NDArray[np.float64]:
    """(H, W, 3) what a photo shows of what is drawn."""
    _, falloff = falloff_of(rgb, exposure)
    return np.array(exposure.gain) * falloff * rgb + np.array(exposure.bias)


def falloff_of(
    rgb: NDArray[np.float64], exposure: Exposure
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(H, W, 2) r² and r⁴ of the pixels of a picture, and (H, W, 1) its falloff."""
    height, width, _ = rgb.shape
    x = np.arange(width) + 0.5 - width / 2
    y = np.arange(height) + 0.5 - height / 2
    square = (x**2 + y[:, None] ** 2) / (width**2 / 4 + height**2 / 4)
    powers = np.stack([square, square**2], axis=2)
    return powers, 1 + powers @ np.array(exposure.falloff)[:, None]
