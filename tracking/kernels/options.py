"""The constants of the native kernels: one object for both languages.

The Rust kernels receive it once; the numpy twins read the same fields.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class KernelOptions:
    """Assumptions of the tracker's measurements about pictures, splats and each other.

    All values were chosen on the built-in rooms `lab` and `desk` unless a line says otherwise.
    Colour values are channels of 0..1; pixels are the window's own.
    """

    shadow_darkest: tuple[float, float] = (0.5, 0.7)
    """Shares of the light: another surface below the first, a shadow above the second."""

    shadow_gone: tuple[float, float] = (1.1, 1.3)
    """Shares of the light: below the first a lifted shadow, above the second another surface."""

    shadow_discount: float = 0.97
    """Share of a colour difference that a certain shadow accounts for."""

    shadow_hue: float = 0.02
    """Standard deviation of the colour difference between a place and its shadow."""

    neighbour_noise: float = 0.06
    """Standard deviation between a drawn neighbour and its live picture."""

    likeness_gain: float = 3.0
    """Colours with a third of the full colour similarity already count as the object's own."""

    sample_step_px: float = 0.5
    """Distance of the samples along a contour normal."""

    side_px: float = 4.0
    """Width beside the edge that is compared, where the part and the gap are that wide."""

    least_step: float = 0.3
    """An edge needs this much more foreground inside than outside, of -1..1."""

    distance_penalty: float = 0.25
    """An edge at the end of the reach must be this much clearer than one at the prediction."""

    foreign: float = 0.5
    """Share of foreground in other colours than the object's above which the point is occluded."""

    light_range: tuple[float, float] = (0.55, 1.6)
    """An object's side is this much darker or lighter than in its scan at most."""

    alike_sigma: float = 0.10
    """Colour difference, illumination removed, at which a colour becomes another one."""

    cut_px: float = 1.2
    """An edge of foreign colours this far inside the drawn contour belongs to an occluder."""

    weak_reach_px: float = 4.5
    """Reach in px within which the steepest place is used if the foreground shows no edge."""

    weak_slope: float = 0.05
    """Least slope of such a place, per pixel."""

    weak_sigma_px: float = 0.9
    """Standard deviation of an edge found by slope alone."""

    edge_sigma_px: float = 0.4
    """Standard deviation of an edge with a clear colour step."""

    coarse_sigma_px: float = 1.2
    """Standard deviation of an edge with a faint colour step."""

    faint_contrast: float = 0.07
    """Colour steps fainter than this leave an edge where the foreground put it."""

    texture_sigma: float = 0.07
    """Least standard deviation of a texture point's residual."""

    texture_correlation: float = 3.0
    """So many neighbouring texture points of a patterned object share their noise."""

    plain_correlation: float = 4.0
    """So many neighbouring surface points of a plain object share their noise."""

    contour_correlation: float = 3.0
    """So many neighbouring contour points share their noise."""

    texture_cutoff: float = 3.0
    """Tukey's constant for texture, in standard deviations."""

    judge_reach_px: float = 4.0
    """How far along the normals edges are looked for when a pose is judged."""

    agree_px: float = 1.6
    """An edge this near to the drawn one agrees with the pose."""

    misfit_cutoff: float = 5.0
    """Edges farther off than so many standard deviations all count the same."""

    together_px: float = 12.0
    """Residuals of contour points within this distance are compared for correlation."""

    least_together: int = 12
    """Correlation of residuals is estimated from so many points at least."""

    least_shown: int = 12
    """Colours are compared at so many points at least."""

    detail_px: float = 3.0
    """A pattern is what differs from its surroundings of this size."""

    def for_native(self) -> dict[str, float | tuple[float, float]]:
        """By name, for the native kernels; those that travel with each request are left out."""
        with_request = {"texture_correlation", "plain_correlation"}
        return {name: value for name, value in asdict(self).items() if name not in with_request}


OPTIONS = KernelOptions()
"""The options of the product."""
