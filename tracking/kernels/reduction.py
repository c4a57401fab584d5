"""Options of the kernels that reduce a rendering to points.

The Rust kernels receive them with each request; the numpy twins read the same fields. All values
were chosen on the rooms lab and desk.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class ReductionOptions:
    """Options of the reduction to contour, texture and surface points."""

    trim_px: int = 8
    """Margin in px kept around the rendered pixels."""

    fewest_points: int = 40
    """Least number of contour points."""

    most_points: int = 200
    """Largest number of contour points."""

    around_px2: float = 25.0
    """Squared length of a typical contour over the silhouette's area: about a point a pixel."""

    reach_px: float = 6.0
    """Distance in px to which the widths of parts and gaps beside a contour are measured."""

    texture_points: int = 300
    """Largest number of texture points."""

    surface_points: int = 240
    """Largest number of surface points."""

    least_slope: float = 0.012
    """Least gradient (channel of 0..1) per px of a texture point."""

    def outline_for_native(self, *, finer: int) -> dict[str, int | float | tuple[int, int]]:
        """Of the contour, by the names of the native crate; with the supersampling."""
        return {
            "finer": finer,
            "trim_px": self.trim_px,
            "points": (self.fewest_points, self.most_points),
            "around_px2": self.around_px2,
            "reach_px": self.reach_px,
        }

    def surface_for_native(self) -> dict[str, int | float]:
        """Of the points inside, by the names of the native crate."""
        return {
            "texture_points": self.texture_points,
            "surface_points": self.surface_points,
            "least_slope": self.least_slope,
        }


REDUCTION = ReductionOptions()
"""The options of the product."""
