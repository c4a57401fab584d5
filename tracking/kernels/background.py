"""Options of the kernel that learns background images.

The Rust kernel receives them once; the numpy twin reads the same fields. All values were chosen on
the rooms lab and desk.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class LearningOptions:
    """Options of learning a background image, and of its noise."""

    relit_ratio: tuple[float, float] = (0.35, 1.9)
    """Brightness ratios, lower and upper limit, of a place that is only relit."""

    relit_hue: float = 0.022
    """Remaining colour difference (channel of 0..1) of a place that is only relit."""

    blend: float = 0.25
    """Weight of the live picture in a pixel that was learned before."""

    noise_floor: float = 0.022
    """Standard deviation of sensor, codec and splat noise on a flat wall, channels of 0..1."""

    misalignment_px: float = 0.5
    """Misalignment of edges in px: adds that many pixels of local gradient to the noise."""

    def for_native(self) -> dict[str, float | tuple[float, float]]:
        """By the names of the native crate."""
        return asdict(self)


LEARNING = LearningOptions()
"""The options of the product."""
