# pyright: standard
"""How densely, in which direction and where splats lie on a textured surface.

Every point of a surface gets a frame and two spacings: close where the texture changes fast, longer
along lines than across them, and close across sharp edges, so that no splat reaches over one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from benchmarks.bake.surface import (
    Edges,
    Soup,
    SurfacePoints,
    lookup,
    pixel_axes,
    positions,
    scatter,
)
from scenes.render.reduction import z_order

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]

PER_TRIANGLE = 4
"""Points in every triangle at which texture and edges are measured."""
CANDIDATES_PER_SPLAT = 4
"""Random places per splat, out of which the best spaced are kept."""
CHUNK = 40_000
"""Points that are worked on at once, for the memory."""
SAME_SURFACE_M = 0.004
"""Sites farther apart along the normal belong to different surfaces."""
GROWTH = 0.6
"""How fast spacing may grow with distance: a wide disc beside fine ones would cover them in
slanting views, where the nearer of two discs wins."""
CROWD = 1.5
"""Splats chosen first, per splat wanted; the most crowded are then left out."""
GRADIENT_NOISE = 3.0
"""Texture slope, grey levels per pixel, that is grain and not worth a splat."""
PLAIN_SLOPE = 900.0
"""Grey levels per metre added to every slope: it sets how sparse plain surfaces get."""
SLOPE_POWER = 0.68
"""Spacing falls with slope to this power: 0.5 is the least mean square error, 1 an even error."""
MAX_RATIO = 3.0
MAX_RATIO_AT_EDGES = 9.0
"""Largest ratios of the two spacings."""
EDGE_SHARE = 0.9
"""Spacing across a sharp edge over the distance to it."""


@dataclass(frozen=True, slots=True)
class Limits:
    """Spacings in metres: finest, widest, finest across edges, and across gentle bends."""

    finest_m: float
    widest_m: float
    edge_m: float
    fold_m: float


@dataclass(frozen=True, slots=True, eq=False)
class Sites:
    """N places on a surface.

    Attributes:
        points: triangle and weights.
        where: (N, 3) metres.
        frames: (N, 3, 3) rows: first tangent (the short way), second tangent, normal.
        spacing: (N, 2) metres along the tangents.
    """

    points: SurfacePoints
    where: FloatArray
    frames: FloatArray
    spacing: FloatArray

    def __len__(self) -> int:
        return len(self.where)

    def select(self, index: IndexArray) -> Sites:
        """The places with these indices."""
        return Sites(
            self.points.select(index),
            self.where[index],
            self.frames[index],
            self.spacing[index],
        )


@dataclass(frozen=True, slots=True, eq=False)
class _Wishes:
    """Spacings that texture and edges ask for, before the splat count sets the scale."""

    turned: FloatArray
    slopes: FloatArray
    edge_limit: FloatArray
    edge_axis: FloatArray


def choose_sites(
    soup: Soup,
    edges: Edges,
    folds: Edges,
    count: int,
    *,
    limits: Limits,
    rng: np.random.Generator,
) -> tuple[Sites, Sites, FloatArray]:
    """About `count` well-spread sites.

    Args:
        soup: the surface.
        edges: its sharp edges.
        folds: where it bends gently, as on a round leg.
        count: how many sites.
        limits: of the spacing.
        rng: source of the sampling.

    Returns:
        The sites, the larger pool of candidates that they come from, and the share of the surface
        that each candidate stands for.
    """
    structure = tuple(texture_structure(t) for t in soup.textures)
    triangles = len(soup.areas)
    probes = SurfacePoints(
        np.repeat(np.arange(triangles), PER_TRIANGLE),
        rng.dirichlet(np.ones(3), triangles * PER_TRIANGLE),
    )
    wishes = _wishes(soup, structure, edges, folds, points=probes, limits=limits)
    share = np.repeat(soup.areas / PER_TRIANGLE, PER_TRIANGLE)
    scale = _solve_scale(wishes, share, count, limits)
    _, spacing = _spacing(wishes, scale, limits)
    density = (1.0 / spacing.prod(axis=1)).reshape(triangles, PER_TRIANGLE).mean(axis=1)
    pull = soup.areas * (density + 0.2 * np.average(density, weights=soup.areas))
    points = scatter(soup, count * CANDIDATES_PER_SPLAT, rng, pull=pull)
    frames, spacing = _spacing(
        _wishes(soup, structure, edges, folds, points=points, limits=limits), scale, limits
    )
    pool = Sites(points, positions(soup, points), frames, spacing)
    stands_for = (soup.areas / pull)[points.triangle]
    chosen = _systematic(pool, stands_for / spacing.prod(axis=1), round(CROWD * count), rng)
    return _uncrowded(pool.select(chosen), count), pool, stands_for


def texture_structure(picture: NDArray[np.uint8]) -> NDArray[np.float32]:
    """(H, W, 3) structure tensor xx, xy, yy in (grey levels per pixel)², grain taken off."""
    grey = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY).astype(np.float32)
    smooth = cv2.GaussianBlur(grey, (0, 0), 0.8)
    dx = cv2.Sobel(smooth, cv2.CV_32F, 1, 0, scale=0.125)
    dy = cv2.Sobel(smooth, cv2.CV_32F, 0, 1, scale=0.125)
    slope = np.sqrt(dx * dx + dy * dy)
    kept = np.maximum(slope - GRADIENT_NOISE, 0.0) / np.maximum(slope, 1e-6)
    dx, dy = dx * kept, dy * kept
    tensor = np.stack([dx * dx, dx * dy, dy * dy], axis=2)
    return np.asarray(cv2.GaussianBlur(tensor, (0, 0), 3.5), dtype=np.float32)


def tangent_frames(normals: FloatArray) -> FloatArray:
    """(N, 3, 3) with rows tangent, tangent, normal, right-handed."""
    hint = np.where(np.abs(normals[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])
    first = np.cross(hint, normals)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(normals, first), normals], axis=1).astype(np.float64)


def neighbour_distances(sites: Sites, k: int) -> tuple[IndexArray, FloatArray]:
    """(N, k) nearest other sites and their distances in units of each site's own spacing."""
    k = min(k, len(sites) - 1)
    found = KDTree(sites.where).query(sites.where, k=k + 1, workers=-1)[1]
    index = np.asarray(found, dtype=np.int64)[:, 1:]
    where = sites.where.astype(np.float32)
    local = (where[index] - where[:, None, :]) @ np.swapaxes(_in_units(sites), 1, 2)
    return index, np.sqrt(np.einsum("nka,nka->nk", local, local)).astype(np.float64)


def distance_from(sites: Sites, index: IndexArray, where: FloatArray) -> NDArray[np.float32]:
    """Distances (M, k) of points from sites `index` (M, k), in units of the sites' spacings."""
    units = _in_units(sites)
    centres, points = sites.where.astype(np.float32), where.astype(np.float32)
    distance = np.empty(index.shape, dtype=np.float32)
    for first in range(0, len(index), CHUNK):
        part = slice(first, first + CHUNK)
        offset = points[part, None, :] - centres[index[part]]
        local = (units[index[part]] @ offset[..., None])[..., 0]
        distance[part] = np.sqrt(np.einsum("nka,nka->nk", local, local))
    return distance


def _in_units(sites: Sites) -> NDArray[np.float32]:
    """(N, 3, 3) that take an offset in metres to one in spacings along tangents and normal."""
    thin = np.full((len(sites), 1), SAME_SURFACE_M)
    units = np.concatenate([sites.spacing, thin], axis=1)
    return (sites.frames / units[:, :, None]).astype(np.float32)


def _wishes(
    soup: Soup,
    structure: tuple[NDArray[np.float32], ...],
    edges: Edges,
    folds: Edges,
    *,
    points: SurfacePoints,
    limits: Limits,
) -> _Wishes:
    frames = tangent_frames(soup.normals[points.triangle])
    axes = pixel_axes(soup)[points.triangle]
    in_plane = np.einsum("nak,nbk->nab", frames[:, :2], axes)
    (a, b), (c, d) = np.moveaxis(in_plane, 0, 2)
    det = a * d - b * c
    det = np.where(np.abs(det) > 1e-15, det, 1.0)
    p, q, r, t = d / det, -b / det, -c / det, a / det
    xx, xy, yy = lookup(soup, points, structure).astype(np.float64).T
    m00 = p * p * xx + 2 * p * r * xy + r * r * yy
    m01 = p * q * xx + (p * t + q * r) * xy + r * t * yy
    m11 = q * q * xx + 2 * q * t * xy + t * t * yy
    half_trace = (m00 + m11) / 2
    spread = np.hypot((m00 - m11) / 2, m01)
    angle = 0.5 * np.arctan2(2 * m01, m00 - m11)
    slopes = PLAIN_SLOPE + np.sqrt(
        np.maximum(np.stack([half_trace + spread, half_trace - spread], axis=1), 0.0)
    )
    where = positions(soup, points)
    limit = np.full(len(where), np.inf)
    axis = frames[:, 0].copy()
    for bends, floor_m in ((edges, limits.edge_m), (folds, limits.fold_m)):
        across, wanted = _across(bends, where, frames, floor_m=floor_m, widest_m=limits.widest_m)
        nearer = wanted < limit
        limit[nearer], axis[nearer] = wanted[nearer], across[nearer]
    return _Wishes(_turn(frames, angle), slopes, limit, axis)


def _across(
    edges: Edges, where: FloatArray, frames: FloatArray, *, floor_m: float, widest_m: float
) -> tuple[FloatArray, FloatArray]:
    """Unit tangents across the nearest edge, and the spacing wanted that way (inf: none)."""
    distance, nearest = edges.tree.query(
        where, distance_upper_bound=widest_m / EDGE_SHARE, workers=-1
    )
    direction = edges.directions[np.minimum(nearest, len(edges.directions) - 1)]
    across = np.cross(frames[:, 2], direction)
    length = np.linalg.norm(across, axis=1, keepdims=True)
    across = np.where(length > 0.3, across / np.maximum(length, 1e-9), frames[:, 0])
    return across, np.maximum(EDGE_SHARE * distance, floor_m)


def _turn(frames: FloatArray, angle: FloatArray) -> FloatArray:
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    first = c * frames[:, 0] + s * frames[:, 1]
    return np.stack([first, np.cross(frames[:, 2], first), frames[:, 2]], axis=1)


def _solve_scale(wishes: _Wishes, areas: FloatArray, count: int, limits: Limits) -> float:
    """The factor on the spacings at which the surface takes `count` sites."""
    step = max(1, len(areas) // 60_000)
    few = _Wishes(
        *(a[::step] for a in (wishes.turned, wishes.slopes, wishes.edge_limit, wishes.edge_axis))
    )
    stand_in = areas[::step] * (areas.sum() / areas[::step].sum())
    low, high = 1e-3, 1e4
    for _ in range(30):
        middle = float(np.sqrt(low * high))
        sites = float((stand_in / _spacing(few, middle, limits)[1].prod(axis=1)).sum())
        low, high = (middle, high) if sites > count else (low, middle)
    return float(np.sqrt(low * high))


def _spacing(wishes: _Wishes, scale: float, limits: Limits) -> tuple[FloatArray, FloatArray]:
    """Frames and spacings at a scale: texture first, edges where they ask for less."""
    wanted = np.clip(scale * wishes.slopes**-SLOPE_POWER, limits.finest_m, limits.widest_m)
    wanted[:, 1] = np.minimum(wanted[:, 1], MAX_RATIO * wanted[:, 0])
    frames = wishes.turned.copy()
    c = np.einsum("nd,nd->n", wishes.edge_axis, frames[:, 0])
    s = np.einsum("nd,nd->n", wishes.edge_axis, frames[:, 1])
    across = 1.0 / np.hypot(c / wanted[:, 0], s / wanted[:, 1])
    along = 1.0 / np.hypot(s / wanted[:, 0], c / wanted[:, 1])
    limit = wishes.edge_limit
    tight = limit < across
    frames[tight, 0] = wishes.edge_axis[tight]
    frames[tight, 1] = np.cross(frames[tight, 2], frames[tight, 0])
    wanted[tight, 0] = limit[tight]
    wanted[tight, 1] = np.minimum(along[tight], MAX_RATIO_AT_EDGES * limit[tight])
    return frames, wanted


def _systematic(
    pool: Sites, weight: FloatArray, count: int, rng: np.random.Generator
) -> IndexArray:
    """Indices drawn in proportion to `weight` at even steps along a space-filling curve."""
    order = z_order(pool.where)
    cumulative = np.cumsum(weight[order])
    ticks = (np.arange(count) + rng.uniform(0.2, 0.8, count)) / count * cumulative[-1]
    return order[np.unique(np.searchsorted(cumulative, ticks).clip(0, len(order) - 1))]


def _uncrowded(sites: Sites, count: int) -> Sites:
    """Leaves out the most crowded sites until `count` are left (after Yuksel 2015)."""
    if len(sites) <= count:
        return sites
    index, distance = neighbour_distances(sites, 12)
    apart = np.linalg.norm(sites.where[index] - sites.where[:, None, :], axis=2)
    widest = (sites.spacing.max(axis=1)[index] + GROWTH * apart).min(axis=1)
    before = sites.spacing[:, 0].copy()
    sites = replace(sites, spacing=np.minimum(sites.spacing, widest[:, None]))
    distance *= (before / sites.spacing[:, 0])[:, None]
    push = np.maximum(1.0 - distance / 1.5, 0.0) ** 4
    alive = np.ones(len(sites), dtype=np.bool_)
    for _ in range(60):
        surplus = int(alive.sum()) - count
        if surplus <= 0:
            break
        crowd = np.where(alive, (push * alive[index]).sum(axis=1), -1.0)
        rival = np.where(push > 0, crowd[index], -1.0).max(axis=1)
        worst = np.flatnonzero(alive & (crowd >= rival))
        worst = worst[np.argsort(-crowd[worst], kind="stable")][: min(surplus, len(sites) // 12)]
        if not len(worst):
            break
        alive[worst] = False
    return sites.select(np.flatnonzero(alive))
