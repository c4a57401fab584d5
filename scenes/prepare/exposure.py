"""How bright each photo is: a gain and a bias per view and channel, found while training."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scenes.render.training import Distance, Exposure

RATE = 1e-3
BETAS = (0.9, 0.99)
EPSILON = 1e-15
PULL = 0.01
"""Share of the way back to "as drawn" per step: a common gain would be nobody's."""


class Exposures:
    """Gains and biases of all views, moved by Adam a view at a time.

    Attributes:
        values: (V, 2, 3) float64, gain and bias.
        moments: (2, V, 2, 3) float64, Adam's.
        steps: (V,) int64.
    """

    def __init__(self, views: int) -> None:
        self.values = np.zeros((views, 2, 3))
        self.values[:, 0] = 1.0
        self.moments = np.zeros((2, views, 2, 3))
        self.steps = np.zeros(views, dtype=np.int64)

    def of(self, view: int) -> Exposure:
        """What a view shows of colours drawn."""
        gain, bias = self.values[view].tolist()
        return Exposure(tuple(gain), tuple(bias))

    def step(self, view: int, distance: Distance, rate: float) -> None:
        """One step against a view's gradients."""
        gradient = np.array([distance.d_gain, distance.d_bias])
        self.steps[view] += 1
        for moment, beta, value in zip(self.moments, BETAS, (gradient, gradient**2), strict=True):
            moment[view] = beta * moment[view] + (1 - beta) * value
        first, second = (
            moment[view] / (1 - beta ** self.steps[view])
            for moment, beta in zip(self.moments, BETAS, strict=True)
        )
        values = self.values[view]
        values -= rate * first / (np.sqrt(second) + EPSILON)
        values += PULL * rate / RATE * (np.array([[1.0], [0.0]]) - values)


def fitted(drawn: NDArray[np.float32], photo: NDArray[np.float32]) -> NDArray[np.float32]:
    """`drawn` with the gain and bias per channel that suit `photo` best; all (H, W, 3)."""
    out = np.empty_like(drawn)
    for channel in range(3):
        x, y = drawn[..., channel].astype(np.float64), photo[..., channel].astype(np.float64)
        variance = x.var()
        gain = ((x - x.mean()) * (y - y.mean())).mean() / variance if variance > 0 else 1.0
        out[..., channel] = gain * (x - x.mean()) + y.mean()
    return out
