"""How well an object was cut out: what is missing of it, what is foreign, what the room keeps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from benchmarks.evaluate.cutouts import overlap
from benchmarks.evaluate.cuts.cutting import Cutting
from benchmarks.evaluate.cuts.true_outlines import TrueOutline, outline_overlap
from scenes.pose import rotation_from_quaternion
from scenes.rays import RayScene
from scenes.render.native import NativeRenderer
from scenes.splats import SplatCloud

FloatArray = NDArray[np.float64]

NEAR_M = 0.02
"""Of the true surface: what is farther is foreign, and surface with nothing nearer is missing; the
issue's figure, and the worst box that it allows."""

FAINT = 0.04
"""Opacity that shows nothing: of the 50 grey levels by which an object usually differs from what is
behind it, it changes a picture by two, the phone's noise."""

DISC_STEP_M = 0.01
"""Between points that a splat's disc is sampled with: half of what a point judges."""

MAX_STEPS = 12
"""Of those, from a splat's middle outwards: wider splats than 12 cm are sampled more coarsely."""


@dataclass(frozen=True, slots=True, eq=False)
class TrueCut:
    """Truth that an object's cut is held against.

    Attributes:
        labels: (N,) the splats that paint the object.
        by_mesh: (N,) those that lie nearest to its surface.
        triangles: (T, 3, 3) its surface.
        seen: (K, 3) points of it that photos saw.
        box_m: (3,) extents of its box.
        outlines: in the photos that show it.
    """

    labels: NDArray[np.bool_]
    by_mesh: NDArray[np.bool_]
    triangles: FloatArray
    seen: FloatArray
    box_m: FloatArray
    outlines: tuple[TrueOutline, ...] = ()


@dataclass(frozen=True, slots=True)
class Figures:
    """Figures of one cut.

    Attributes:
        iou: overlap of the object's splats with those that paint it, by count.
        iou_by_mesh: the same with those that lie nearest to its surface, whatever they paint.
        outline: overlap of what the object's splats draw alone with its outline; NaN if no photo
            shows it whole.
        missing: share of the true surface that photos saw with no splat of the cut near it.
        foreign: share of the cut's splats, by area and opacity, that are far from its true surface.
        taken: share of the cut's splats, by area and opacity, that are truly something else's: what
            is foreign though the labels are right, lies off the surface that it paints.
        box_cm: largest error of the box's extents; its whole size if refused, NaN without a box.
        left: share of the object's true splats that stay in the room.
    """

    iou: float
    iou_by_mesh: float
    outline: float
    missing: float
    foreign: float
    taken: float
    box_cm: float
    left: float


@dataclass(frozen=True, slots=True, kw_only=True)
class CutScore(Figures):
    """How well one object was cut out, one way.

    Attributes:
        room: name of the capture.
        object_id: of the object.
        family: of the object.
        way: of marking.
        photos: how many were marked; fewer than wanted where no more show the object.
        seconds: that the cut took.
        refused: why there was none; empty if there was one.
    """

    room: str
    object_id: str
    family: str
    way: str
    photos: int
    seconds: float
    refused: str = ""


def figures(truth: TrueCut, cutting: Cutting | None, *, room: SplatCloud) -> Figures:
    """How near a cut of a room's splats comes to the truth; None was refused: all is missing."""
    if cutting is None:
        none = 0.0 if truth.outlines else float("nan")
        return Figures(0.0, 0.0, none, 1.0, 0.0, 0.0, 100.0 * float(truth.box_m.max()), 1.0)
    own = truth.labels
    return Figures(
        iou=overlap(cutting.labels, own),
        iou_by_mesh=overlap(cutting.labels, truth.by_mesh),
        outline=outline_overlap(truth.outlines, cutting.splats, renderer=NativeRenderer()),
        missing=missing_share(truth.seen, cutting.splats),
        foreign=foreign_share(truth.triangles, cutting.splats),
        taken=_share_of(_weights(room), cutting.labels & ~own, whole=cutting.labels),
        box_cm=box_error_cm(truth.box_m, cutting.box_m),
        left=float((own & ~cutting.gone).sum() / max(own.sum(), 1)),
    )


def missing_share(points: FloatArray, splats: SplatCloud) -> float:
    """Share of points (K, 3) with nothing of any splat near them that a picture would show."""
    if not len(points):
        return 0.0
    drawn = _drawn_points(splats)
    if not len(drawn):
        return 1.0
    distance, _ = KDTree(drawn).query(points, distance_upper_bound=NEAR_M)
    return float(np.isinf(distance).mean())


def foreign_share(triangles: FloatArray, splats: SplatCloud) -> float:
    """Share of the splats, by area and opacity, whose middles are far from a surface (T, 3, 3)."""
    if not len(splats):
        return 0.0
    far = RayScene(triangles).distance(splats.means) > NEAR_M
    return _share_of(_weights(splats), far, whole=np.ones_like(far))


def box_error_cm(true_m: FloatArray, found_m: tuple[float, float, float] | None) -> float:
    """Largest error of an upright box's extents; its sides may be in either order."""
    if found_m is None:
        return float("nan")
    sides = np.abs(np.sort(found_m[:2]) - np.sort(true_m[:2])).max()
    return 100.0 * float(max(sides, abs(found_m[2] - true_m[2])))


def _weights(splats: SplatCloud) -> FloatArray:
    """(N,) area of each splat's disc times its opacity."""
    wide = np.sort(splats.scales.astype(np.float64), axis=1)[:, 1:]
    return np.asarray(wide.prod(axis=1) * splats.opacities, dtype=np.float64)


def _share_of(weights: FloatArray, part: NDArray[np.bool_], *, whole: NDArray[np.bool_]) -> float:
    """Share of the whole's weight that is the part's."""
    return float(weights[part].sum() / max(float(weights[whole].sum()), 1e-12))


def _drawn_points(splats: SplatCloud) -> FloatArray:
    """(M, 3) points all over the splats' discs, as far out as a picture shows them."""
    shown = splats.select(splats.opacities > FAINT)
    if not len(shown):
        return np.zeros((0, 3))
    axes = rotation_from_quaternion(shown.rotations.astype(np.float64))
    scales = shown.scales.astype(np.float64)
    order = np.argsort(-scales, axis=1)[:, :2]
    wide = np.take_along_axis(scales, order, axis=1)
    across = np.take_along_axis(axes, order[:, None, :], axis=2)
    # Where a Gaussian's opacity has fallen to what is faint, in standard deviations.
    reach = np.sqrt(2.0 * np.log(shown.opacities.astype(np.float64) / FAINT))
    half = reach[:, None] * wide
    steps = np.clip(np.ceil(half[:, 0] / DISC_STEP_M), 1, MAX_STEPS).astype(int)
    means = shown.means.astype(np.float64)
    points = [means]
    for count in np.unique(steps):
        chosen = np.flatnonzero(steps == count)
        line = np.arange(-count, count + 1) / count
        u, v = (grid.ravel() for grid in np.meshgrid(line, line))
        inside = u * u + v * v <= 1.0
        disc = np.stack([u[inside], v[inside]], axis=1)
        offsets = np.einsum("kxc,kc,dc->kdx", across[chosen], half[chosen], disc)
        points.append((means[chosen, None, :] + offsets).reshape(-1, 3))
    return np.concatenate(points)
