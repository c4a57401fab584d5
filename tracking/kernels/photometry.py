"""Options of the photometric kernels: similarity to the picture, and light.

The Rust kernels receive them once; the numpy twins read the same fields. All values were chosen on
the rooms lab and desk.
"""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True, slots=True, kw_only=True)
class SimilarityOptions:
    """Options of the similarity of a composited object to the live picture."""

    residual_scale: float = 0.15
    """Scale (channels of 0..1) of the Geman-McClure photometric residual."""

    on_object: float = 0.1
    """Alpha from which a pixel's detail is compared."""

    doubt_px: float = 8.0
    """Number of changed pixels at which the photometric gain has half its weight."""

    closely: bool = False
    """Whether poses are right to a pixel, so that finer detail is compared."""

    def for_native(self) -> dict[str, float | bool]:
        """By the names of the native crate."""
        return {
            "strange": self.residual_scale,
            "on_object": self.on_object,
            "doubt_px": self.doubt_px,
            "closely": self.closely,
        }


ROUGHLY = SimilarityOptions()
"""For poses near the right one."""

CLOSELY = replace(ROUGHLY, closely=True)
"""For poses that are right to a pixel."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RelightingOptions:
    """Options of the fit of an object's light."""

    residual_scale: float = ROUGHLY.residual_scale
    """Scale (channels of 0..1) of the Geman-McClure residual of the fit."""

    even: float = 0.001
    """Weight of the prior that light is the same on all sides, relative to the data."""

    white: float = 0.01
    """Weight of the prior that light has no colour, relative to the data."""

    fits: int = 3
    """Iterations of reweighting."""

    light_range: tuple[float, float] = (0.3, 3.5)
    """Gain of a side relative to its scan, lower and upper limit."""

    enough_px: int = 400
    """Pixels used in the fit; more than twice as many are subsampled."""

    seen: float = 0.05
    """Weight of a pixel below which it is left out."""

    least_power: float = 1e-9
    """Regularisation that keeps the fit solvable where all is black."""

    def for_native(self) -> dict[str, float | int | tuple[float, float]]:
        """By the names of the native crate."""
        return {
            "residual_scale": self.residual_scale,
            "even": self.even,
            "white": self.white,
            "fits": self.fits,
            "range": self.light_range,
            "enough_px": self.enough_px,
            "seen": self.seen,
            "least_power": self.least_power,
        }


RELIGHTING = RelightingOptions()
"""The options of the product."""
