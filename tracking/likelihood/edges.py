"""Positions of an object's contour and texture points in the live picture.

Along each contour normal the edge is found twice: first as the place where the object's foreground
ends (robust, a pixel or so), then by a fit of a two-colour step to the live picture (sub-pixel).

The readable twin of the native kernels `edges` and `refine` (`tracking.solve.measurement`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from tracking.kernels.options import OPTIONS
from tracking.window.contour import Contour, sample

if TYPE_CHECKING:
    from tracking.evidence.evidence import Evidence

FloatArray = NDArray[np.float32]
Points = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """Linearised measurements: `jacobian @ step ≈ residual`, a step being shift and turn.

    Attributes:
        jacobian: (N, 6).
        residual: (N,) pixels or colour, divided by its standard deviation together with `jacobian`.
        weight: (N,) 0..1.
    """

    jacobian: Points
    residual: Points
    weight: Points


@dataclass(frozen=True, slots=True, eq=False)
class Edges:
    """Contour measurements.

    Attributes:
        rows: linearised, one per contour point.
        offset_px: (N,) outward distance of the seen edge from the rendered one, bias removed.
        sigma_px: (N,) standard deviation of that.
        found: (N,) bool, whether an edge was found.
        hidden: (N,) bool, whether the point is covered by something known or foreign.
    """

    rows: Rows
    offset_px: Points
    sigma_px: Points
    found: NDArray[np.bool_]
    hidden: NDArray[np.bool_]


def projection(
    points: Points,
    world_from_object: Pose,
    camera: Pinhole | Fisheye,
    camera_from_world: Pose,
) -> tuple[Points, Points]:
    """Pixels (N, 2) of object points; their derivative (N, 2, 6) by shift and turn of the pose.

    Shifts are along the world's axes, turns about them through the object's origin.
    """
    turned = points @ world_from_object.rotation.T
    in_camera = (turned + world_from_object.translation) @ camera_from_world.rotation.T
    in_camera += camera_from_world.translation
    pixels, by_camera = _seen(in_camera, camera)
    by_world = by_camera @ camera_from_world.rotation
    by_turn = np.cross(turned[:, None, :], by_world)
    return pixels, np.concatenate([by_world, by_turn], axis=2)


def _seen(points: Points, camera: Pinhole | Fisheye) -> tuple[Points, Points]:
    """Pixels (N, 2) of camera points and their derivative (N, 2, 3) by those."""
    x, y, z = points.T
    jacobian = np.zeros((len(points), 2, 3))
    if isinstance(camera, Pinhole):
        jacobian[:, 0, 0], jacobian[:, 0, 2] = camera.fx / z, -camera.fx * x / (z * z)
        jacobian[:, 1, 1], jacobian[:, 1, 2] = camera.fy / z, -camera.fy * y / (z * z)
        return camera.project(points)[0], jacobian
    # r = f·d(θ) along (x, y)/ρ: its derivative along ρ, across it, and along z.
    rho, distance2 = np.hypot(x, y), x * x + y * y + z * z
    angle = np.arctan2(rho, z)
    slope = camera.f_px * camera.radius_slope(angle)
    across = camera.radius_px(angle) / np.maximum(rho, 1e-12)
    unit = np.stack([x, y], axis=1) / np.maximum(rho, 1e-12)[:, None]
    outward = unit[:, :, None] * unit[:, None, :]
    by_rho = (slope * z / distance2)[:, None, None] * outward
    jacobian[:, :, :2] = by_rho + across[:, None, None] * (np.eye(2) - outward)
    jacobian[:, :, 2] = -(slope * rho / distance2)[:, None] * unit
    return camera.project(points)[0], jacobian


def measure_contour(
    evidence: Evidence,
    contour: Contour,
    world_from_object: Pose,
    *,
    reach_px: float,
    offset_px: float,
) -> Edges:
    """Look for the object's edge along each contour normal.

    Args:
        evidence: the crop.
        contour: points drawn at a pose near `world_from_object`.
        world_from_object: where to look from.
        reach_px: how far to look, either way.
        offset_px: by how much the drawn contour is known to lie outside the real one.
    """
    pixels, by_pose = projection(
        contour.points, world_from_object, evidence.camera, evidence.world_from_camera.inverse()
    )
    normals = contour.normals
    by_pose_along = np.einsum("ni,nij->nj", normals, by_pose)
    coarse, found, foreign = _coarse_edges(evidence, contour, pixels, reach_px=reach_px)
    weak = np.zeros(len(found), dtype=np.bool_)
    if reach_px <= OPTIONS.weak_reach_px:
        steepest, slope = _steepest_edges(evidence.live, contour, pixels, reach_px=reach_px)
        weak = ~found & ~foreign & (slope > OPTIONS.weak_slope)
        coarse = np.where(weak, steepest, coarse)
    fine, contrast = _fine_edges(evidence.live, contour, pixels, coarse)
    sharp = np.clip(contrast / OPTIONS.faint_contrast - 0.5, 0.0, 1.0)
    position = np.where(sharp > 0, sharp * fine + (1 - sharp) * coarse, coarse)
    offset = position + offset_px
    sigma = OPTIONS.edge_sigma_px * sharp + OPTIONS.coarse_sigma_px * (1 - sharp)
    sigma = np.where(weak, OPTIONS.weak_sigma_px, sigma)
    found = found | weak
    covered = sample(evidence.hidden, pixels - 1.5 * normals) > 0.5
    weight = (found & ~covered & ~foreign).astype(np.float64) / OPTIONS.contour_correlation
    rows = Rows(by_pose_along / sigma[:, None], offset / sigma, weight)
    return Edges(rows, offset, sigma, found & ~foreign, covered | foreign)


def _coarse_edges(
    evidence: Evidence, contour: Contour, pixels: Points, *, reach_px: float
) -> tuple[Points, NDArray[np.bool_], NDArray[np.bool_]]:
    """Signed distance of the best step, whether there is one, whether it is foreign."""
    side = OPTIONS.side_px + OPTIONS.sample_step_px
    count = int(np.ceil((reach_px + side) / OPTIONS.sample_step_px))
    steps = np.arange(-count, count + 1) * OPTIONS.sample_step_px
    path = pixels[:, None, :] + steps[None, :, None] * contour.normals[:, None, :]
    palette = sample(evidence.own, path).astype(np.float64)
    own = palette * _colour_similarity(sample(evidence.live, path), contour.colours[:, None, :])
    foreground = sample(evidence.foreground, path).astype(np.float64)
    total = np.concatenate([np.zeros((len(own), 1)), np.cumsum(own, axis=1)], axis=1)
    foreign_share = np.maximum(foreground - palette, 0.0)
    total_foreign = np.concatenate(
        [np.zeros((len(own), 1)), np.cumsum(foreign_share, axis=1)], axis=1
    )
    first, last = (
        int(side / OPTIONS.sample_step_px),
        len(steps) - int(side / OPTIONS.sample_step_px),
    )
    candidates = np.arange(first, last)
    inner = np.clip(
        np.round(np.minimum(contour.inner_px, OPTIONS.side_px) / OPTIONS.sample_step_px), 2, None
    )
    outer = np.clip(
        np.round(np.minimum(contour.outer_px, OPTIONS.side_px) / OPTIONS.sample_step_px), 2, None
    )
    inner, outer = inner.astype(int)[:, None], outer.astype(int)[:, None]
    row = np.arange(len(own))[:, None]
    # Sample i is taken as the interval around it: an edge "at" i splits it, hence the mean.
    middle = 0.5 * (total[:, candidates] + total[:, candidates + 1])
    inside = (middle - total[row, candidates - inner]) / (inner + 0.5)
    outside = (total[row, candidates + 1 + outer] - middle) / (outer + 0.5)
    clear = inside - outside
    cost = OPTIONS.distance_penalty * (steps[candidates] / max(reach_px, 1.0)) ** 2
    best = np.argmax(clear - cost, axis=1)
    picked = np.arange(len(own))
    place = candidates[best]
    foreign_out = total_foreign[picked, place + 1 + outer[:, 0]] - total_foreign[picked, place + 1]
    foreign_in = total_foreign[picked, place] - total_foreign[picked, place - inner[:, 0]]
    # Someone behind the object shows outside its contour; someone in front cuts into it.
    cuts_in = (foreign_out / outer[:, 0] > OPTIONS.foreign) & (steps[place] < -OPTIONS.cut_px)
    foreign = cuts_in | (foreign_in / inner[:, 0] > OPTIONS.foreign)
    return steps[place].astype(np.float64), clear[picked, best] > OPTIONS.least_step, foreign


def _steepest_edges(
    picture: FloatArray, contour: Contour, pixels: Points, *, reach_px: float
) -> tuple[Points, Points]:
    """Steepest place of the live picture along each normal, and how steep it is."""
    count = int(np.ceil((reach_px + 1.0) / OPTIONS.sample_step_px))
    steps = np.arange(-count, count + 1) * OPTIONS.sample_step_px
    path = pixels[:, None, :] + steps[None, :, None] * contour.normals[:, None, :]
    colours = sample(picture, path)
    apart = int(1.0 / OPTIONS.sample_step_px)
    change = np.linalg.norm(colours[:, 2 * apart :] - colours[:, : -2 * apart], axis=2)
    middle = steps[apart:-apart]
    cost = 0.5 * (middle / reach_px) ** 2
    best = np.argmax(change * (1.0 - cost), axis=1)
    picked = np.arange(len(best))
    return middle[best].astype(np.float64), change[picked, best].astype(np.float64)


def _colour_similarity(seen: FloatArray, drawn: FloatArray) -> FloatArray:
    """(..., ) 0..1: a seen colour is the drawn one in another light."""
    power = np.einsum("...c,...c->...", drawn, drawn) + 1e-4
    ratio = np.einsum("...c,...c->...", seen, drawn) / power
    ratio = np.clip(ratio, *OPTIONS.light_range)
    apart = seen - ratio[..., None] * drawn
    return np.exp(-0.5 * np.einsum("...c,...c->...", apart, apart) / OPTIONS.alike_sigma**2)


def _fine_edges(
    picture: FloatArray, contour: Contour, pixels: Points, coarse: Points
) -> tuple[Points, Points]:
    """Sub-pixel edge positions by a two-colour step fit, and the colour contrast of each."""
    widest = np.minimum(contour.inner_px, contour.outer_px)
    half = np.clip(0.6 * widest, 1.0, 2.5)
    relative = np.linspace(-1.5, 1.5, 13)
    along = coarse[:, None] + relative[None, :] * half[:, None]
    path = pixels[:, None, :] + along[..., None] * contour.normals[:, None, :]
    colours = sample(picture, path).astype(np.float64)
    inside, outside = colours[:, :3].mean(axis=1), colours[:, -3:].mean(axis=1)
    step = inside - outside
    contrast = np.linalg.norm(step, axis=1)
    share = np.einsum("ntc,nc->nt", colours - outside[:, None, :], step)
    share = np.clip(share / np.maximum(contrast**2, 1e-6)[:, None], 0.0, 1.0)[:, 1:-1]
    area = (share[:, 1:-1].sum(axis=1) + 0.5 * (share[:, 0] + share[:, -1])) * 0.25
    return coarse + half * (area - 1.25), contrast
