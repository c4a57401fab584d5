"""How every pixel of a silhouette is accounted for: what the likelihood's kernel and twin share."""

from __future__ import annotations

from dataclasses import dataclass

from tracking.kernels.photometry import RELIGHTING
from tracking.model.misfit import MAX_MISFIT, RESIDUAL_SIGMA
from tracking.model.relighting import LIGHT_SIGMA

OCCLUDED = 0.3
"""Prior probability that a pixel of a silhouette is hidden by something in no scan, where nothing
around it says more."""

FOREIGN = 0.3
"""Prior probability that a pixel shows something in no scan, if not the object, where nothing
around it says more. Before absence was judged in another light, with 0.3, 0.5, 0.6 and 0.85, of 93
objects in three random rooms 68, 67, 70 and 54 were right and 24, 16, 10 and 4 wrong unnoticed; of
198 in a foreign room 194, 194, 188 and 167, and 4, 2, 1 and none. At 0.5 a plain mug on a table was
found 20 cm off."""

UNKNOWN_EDGE = 0.1
"""Difference of two neighbouring colours, channels of 0..1, past which e^-½ of something unknown
goes on: a lens blurs an outline of 0.4 over four pixels to steps of this. In labelled windows of a
rehearsal, chairs that a person covers have 39 nats at their true pose with 0.1, 38 with 0.15, 91
with 0.07 (patterned clothes end everywhere) and 130 without surroundings; visible ones keep
theirs."""

UNKNOWN_REACH = 1.0
"""Distance over which surroundings lose a factor e of their weight, in radii of the object: between
half of it and all nothing changes by more than a tenth."""

UNKNOWN_PRIOR = 0.01
"""Weight of `FOREIGN` and `OCCLUDED` against surroundings that reach a pixel without an edge: those
behind an outline of 0.3 reach it by less."""

UNKNOWN_RANGE = (0.03, 0.97)
"""Lowest and highest probability that a pixel shows something unknown: outlines of scans are off by
about so many pixels of a hundred."""

MOSTLY_UNKNOWN = 0.6
"""Share of a silhouette from which something unknown hides most of an object: what is left of it is
as much as the outlines of a scan are off by."""

UNKNOWN_GAP_PX = 2
"""Pixels around a silhouette that belong to neither side: what the lens blurs."""

BEHIND_M = 0.05
"""How much farther than the static room a surface must be to be behind it, m: the error of a
scan's depth on a surface seen face on."""

BEHIND_SHARE = 0.02
"""The same as a share of the distance, for surfaces seen at a slant."""

MIN_PX = 4.0
"""Visible silhouette below which nothing is said of a pose, px²."""

MIN_CHANGED = 0.05
"""Weight in the fit of light, 0..1, of a pixel that shows the empty room for sure: no more than the
share of pixels at which an object happens to look like what is behind it."""

MIN_LIT = 12
"""Pixels from which light is fitted; with fewer it is as in the scan."""


@dataclass(frozen=True, slots=True)
class Tolerance:
    """How exactly a pose has to be right before it differs from a wrong one.

    Attributes:
        sigma: standard deviation of a pixel about the composite, channels of 0..1.
        most_misfit: largest misfit of a pixel, nats.
        occluded: prior probability that a pixel is hidden by something in no scan.
    """

    sigma: float
    most_misfit: float
    occluded: float


EXACTLY = Tolerance(RESIDUAL_SIGMA, MAX_MISFIT, OCCLUDED)
"""For poses that were refined: the likelihood itself."""

ROUGHLY = Tolerance(0.12, 0.5 * MAX_MISFIT, 0.4)
"""For poses that are off by a part of the object, whose edges fall on wrong pixels: the likelihood
annealed, so that such pixels count half. On foreign stills the right place was among the best
eight of 80 with a largest misfit from 1.5 to 2.6 nats, and was missed at 5.2."""


@dataclass(frozen=True, slots=True)
class PoseSupport:
    """Support of a window for an object at a pose.

    Attributes:
        nats: log likelihood ratio of the object there against its absence.
        samples: number of independent samples that the visible silhouette is worth.
        open_fraction: 0..1, share of the silhouette inside the picture that neither the room nor
            a tracked object hides.
        matched_fraction: 0..1, share of that which the object accounts for.
        unknown_fraction: 0..1, share of that which something in no scan is known to hide.
        area_px: silhouette inside the picture, px².
    """

    nats: float
    samples: float
    open_fraction: float
    matched_fraction: float
    unknown_fraction: float
    area_px: float

    @property
    def nats_a_sample(self) -> float:
        """Nats of an independent sample that nothing unknown hides, on average."""
        return self.nats / max(self.samples * (1.0 - self.unknown_fraction), 1.0)

    @property
    def is_covered(self) -> bool:
        """Whether something in no scan is known to hide most of what could be seen of it."""
        return self.unknown_fraction > MOSTLY_UNKNOWN

    @property
    def is_mostly_hidden(self) -> bool:
        """Whether the room, tracked objects and something in no scan hide most of it together."""
        return self.open_fraction * (1.0 - self.unknown_fraction) < 1.0 - MOSTLY_UNKNOWN


NOT_IN_VIEW = PoseSupport(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def for_native() -> dict[str, object]:
    """The constants by the names of the native crate."""
    return {
        "light": RELIGHTING.for_native(),
        "light_sigma": LIGHT_SIGMA,
        "foreign": FOREIGN,
        "unknown_edge": UNKNOWN_EDGE,
        "unknown_prior": UNKNOWN_PRIOR,
        "unknown_range": UNKNOWN_RANGE,
        "unknown_gap_px": UNKNOWN_GAP_PX,
        "behind_m": BEHIND_M,
        "behind_share": BEHIND_SHARE,
        "least_px": MIN_PX,
        "least_changed": MIN_CHANGED,
        "least_lit": MIN_LIT,
        "residual_sigma": RESIDUAL_SIGMA,
        "most_misfit": MAX_MISFIT,
    }
