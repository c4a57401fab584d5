"""Statistics of a pose in a window: contour, surface, colour correlation.

The readable twin of the native kernel `judge`, with its options.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from tracking.kernels.options import OPTIONS
from tracking.likelihood.edges import Edges, measure_contour
from tracking.window.contour import Contour

if TYPE_CHECKING:
    from tracking.evidence.evidence import Evidence

FloatArray = NDArray[np.float32]
Points = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Judgement:
    """Statistics of one pose in one window, in the order in which the native kernel returns them.

    Attributes:
        edge_inlier_ratio: 0..1, share of the contour points with an edge within `agree_px`.
        unoccluded_ratio: 0..1, share of the contour points that nothing occludes.
        contour_chi2: sum of the squared contour residuals in standard deviations under Tukey's
            loss; a point without an edge counts the loss's maximum.
        mean_edge_chi2: mean of those over the points with an edge, the only ones that enter the
            pose.
        variance_inflation: >= 1, factor by which spatial correlation of the residuals inflates the
            pose's variance beyond `contour_correlation`.
        visible: 0..1, share of the rendered silhouette that shows the object.
        covered: 0..1, share of the silhouette that shows an occluder.
        colour_correlation: -1..1, Pearson correlation of rendered and live colours; of their detail
            for a textured object.
    """

    edge_inlier_ratio: float
    unoccluded_ratio: float
    contour_chi2: float
    mean_edge_chi2: float
    variance_inflation: float
    visible: float
    covered: float
    colour_correlation: float


NOTHING_DRAWN = Judgement(0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)


def judged(
    evidence: Evidence,
    outline: Contour,
    surface: Points,
    colours: FloatArray,
    world_from_object: Pose,
    *,
    offset_px: float,
    is_textured: bool,
) -> Judgement:
    """How well a window supports a pose.

    Args:
        evidence: the window.
        outline: contour points of the object.
        surface: (N, 3) points evenly over its silhouette, in its frame.
        colours: (N, 3) drawn there.
        world_from_object: the pose.
        offset_px: by how much the drawn contour is known to lie outside the real one.
        is_textured: whether colours are compared by their detail.
    """
    edges = measure_contour(
        evidence, outline, world_from_object, reach_px=OPTIONS.judge_reach_px, offset_px=offset_px
    )
    camera_from_object = evidence.world_from_camera.inverse() @ world_from_object
    pixels, _ = evidence.camera.project(camera_from_object @ outline.points)
    on_surface, _ = evidence.camera.project(camera_from_object @ surface)
    visible, covered, colour_correlation = _surface_shown(
        evidence, on_surface, colours, is_textured=is_textured
    )
    return Judgement(*_contour_statistics(edges, pixels), visible, covered, colour_correlation)


def _contour_statistics(edges: Edges, pixels: Points) -> tuple[float, float, float, float, float]:
    """The first five of a `Judgement`."""
    offset, sigma, found, hidden = edges.offset_px, edges.sigma_px, edges.found, edges.hidden
    if len(offset) == 0:
        return 0.0, 0.0, 0.0, 0.0, 1.0
    agrees = found & (np.abs(offset) < OPTIONS.agree_px) & ~hidden
    relative = np.where(
        found, np.clip(np.abs(offset / sigma) / OPTIONS.misfit_cutoff, 0.0, 1.0), 1.0
    )
    # Tukey's loss, scaled to be a square near 0.
    loss = OPTIONS.misfit_cutoff**2 / 3 * (1.0 - (1.0 - relative**2) ** 3)
    contour_chi2 = float(loss[~hidden].sum()) / OPTIONS.contour_correlation
    seen = found & ~hidden
    mean_edge_chi2 = float(loss[seen].mean()) if seen.any() else OPTIONS.misfit_cutoff**2 / 3
    residuals = np.clip(offset / sigma, -OPTIONS.misfit_cutoff, OPTIONS.misfit_cutoff)[seen]
    variance_inflation = shared_errors(pixels[seen], residuals)
    return (
        float(agrees.mean()),
        float((~hidden).mean()),
        contour_chi2,
        mean_edge_chi2,
        variance_inflation,
    )


def shared_errors(pixels: Points, residuals: Points) -> float:
    """Variance inflation by correlated neighbouring residuals, at least 1.

    The mean of n independent residuals has 1/n of their variance; any excess comes from a scan's
    faults and shadows, whose correlation length exceeds that of noise.
    """
    if len(residuals) < OPTIONS.least_together:
        return 1.0
    x, y = pixels.astype(np.float32).T
    near = (x[:, None] - x) ** 2 + (y[:, None] - y) ** 2 < OPTIONS.together_px**2
    means = near @ residuals / near.sum(axis=1)
    power = float((residuals**2).mean())
    correlation = float((near.sum(axis=1) * means**2).mean()) / max(power, 1e-9)
    return max(correlation / OPTIONS.contour_correlation, 1.0)


def _surface_shown(
    evidence: Evidence, pixels: Points, colours: FloatArray, *, is_textured: bool
) -> tuple[float, float, float]:
    """Shares of the surface that show the object and an occluder; colour correlation."""
    seen = evidence.seen.sample(pixels).reshape(-1, 6)
    foreground, own, hidden = seen[:, :3].T
    visible = own * (1 - hidden) > 0.35
    covered = np.maximum(foreground - own, hidden) > 0.5
    shown = (own > 0.35) & (hidden < 0.5)
    if shown.sum() < OPTIONS.least_shown:
        return float(visible.mean()), float(covered.mean()), 0.0
    live, drawn = seen[shown, 3:], colours[shown]
    if is_textured:
        around = _surroundings(pixels[shown])
        live, drawn = live - around @ live, drawn - around @ drawn
    return float(visible.mean()), float(covered.mean()), _correlation(drawn, live)


def _surroundings(pixels: Points) -> FloatArray:
    """(N, N) weights that average each point's surroundings."""
    x, y = pixels.astype(np.float32).T
    apart2 = (x[:, None] - x) ** 2 + (y[:, None] - y) ** 2
    weight = np.exp(-0.5 / OPTIONS.detail_px**2 * apart2)
    return weight / weight.sum(axis=1, keepdims=True)


def _correlation(first: NDArray[np.floating], second: NDArray[np.floating]) -> float:
    """-1..1 of two lists of colours about their means."""
    a = (first - first.mean(axis=0)).astype(np.float64).ravel()
    b = (second - second.mean(axis=0)).astype(np.float64).ravel()
    norm = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / norm if norm > 1e-9 else 0.0
