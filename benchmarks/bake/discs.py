# pyright: standard
"""Flat discs that cover a textured surface and, blended, show its texture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from benchmarks.bake.spacing import (
    Limits,
    Sites,
    choose_sites,
    distance_from,
    neighbour_distances,
    tangent_frames,
)
from benchmarks.bake.surface import Edges, Soup, SurfacePoints, colours, find_edges
from scenes.rays import RayScene

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]

THIN_M = 0.0007
"""Deviation of a disc along its normal."""
COVER = 0.8
"""Deviation of a disc over the local spacing: neighbours overlap without a gap, and blur little."""
EDGE_ANGLE_RAD = 0.6
"""Angle between faces from which on their edge is sharp, radians."""
FOLD_ANGLE_RAD = 0.12
"""Angle from which on it is a fold that splats must not stick out of, radians."""
HIDDEN_M = 0.04
"""Height of free space above a point that a camera could see it from, metres."""
LOOKS = 10
"""Directions in which that is tried."""
HALO_REACH = 2.6
"""A disc is narrowed until points this many deviations out are near the surface."""
SHRINK = (1.0, 0.8, 0.64, 0.51, 0.41, 0.33, 0.26, 0.2, 0.15)
"""Factors by which a disc is made smaller until it does not stick out."""
FILL_SHARE = 0.15
"""Share of the splats kept back for gaps between the first."""
FILL_ROUNDS = 2
"""Rounds in which gaps are filled."""
CHECKS_PER_SPLAT = 2.5
"""Points of the surface a splat at which gaps are looked for."""
NEIGHBOURS = 10
"""Splats that a point's colour is blended of."""
PEAK_ALPHA = 0.95
"""Opacity in a splat's middle."""
HOLE = 0.04
"""Light that passes between the discs where another one is needed."""
COLOUR_ROUNDS = 3
"""Rounds in which colours are corrected for the blur of overlapping splats."""
SHARPEN = 0.2
"""Change of a colour (0..1) by that at most."""


@dataclass(frozen=True, slots=True, eq=False)
class Discs:
    """Splats without flaws.

    Attributes:
        means: (N, 3) metres.
        frames: (N, 3, 3) rows: tangent, tangent, normal.
        spread_m: (N, 3) deviations along them.
        colours: (N, 3) RGB, about 0..1.
    """

    means: FloatArray
    frames: FloatArray
    spread_m: FloatArray
    colours: FloatArray


def cover(
    soup: Soup, count: int, rng: np.random.Generator, *, silhouette_bias_m: float, limits: Limits
) -> Discs:
    """At most `count` discs over a surface.

    Args:
        soup: the surface.
        count: of discs; a few fewer where they are not needed.
        rng: source of the sampling.
        silhouette_bias_m: how far a disc's visible part may reach past the surface.
        limits: finest and widest spacing.
    """
    scene = RayScene(soup.corners)
    soup = _exposed_part(soup, scene, rng)
    edges = find_edges(soup, angle_rad=EDGE_ANGLE_RAD, step_m=0.008)
    folds = find_edges(soup, angle_rad=FOLD_ANGLE_RAD, step_m=0.008)
    wanted = max(1, round((1 - FILL_SHARE) * count))
    sites, pool, areas = choose_sites(soup, edges, folds, wanted, limits=limits, rng=rng)
    sites = sites.select(np.flatnonzero(_is_exposed(scene, sites.where, sites.frames[:, 2])))
    looseness = np.ones(len(sites))
    if len(sites) > NEIGHBOURS:
        distance = np.sort(neighbour_distances(sites, 10)[1], axis=1)
        looseness = np.clip(distance[:, 1:5].mean(axis=1) / 1.2, 0.75, 1.5)
    fitter = _Fitter(scene, folds, silhouette_bias_m)
    sites = fitter.fitted(replace(sites, spacing=COVER * sites.spacing * looseness[:, None]))
    keep = min(1.0, CHECKS_PER_SPLAT * count / len(pool))
    kept = np.flatnonzero(rng.random(len(pool)) < keep)
    kept = kept[_is_exposed(scene, pool.where[kept], pool.frames[kept, 2])]
    checks, areas = pool.select(kept), areas[kept]
    doubted = checks
    for _ in range(FILL_ROUNDS):
        bare, missing = _holes(sites, doubted, count - len(sites))
        if not len(missing):
            break
        more, doubted = doubted.select(missing), doubted.select(bare)
        sites = _join(sites, fitter.fitted(replace(more, spacing=COVER * more.spacing)))
    thickness = np.full((len(sites), 1), THIN_M)
    return Discs(
        sites.where,
        sites.frames,
        np.concatenate([sites.spacing, thickness], axis=1),
        _colours(soup, sites, checks, areas),
    )


def _exposed_part(soup: Soup, scene: RayScene, rng: np.random.Generator) -> Soup:
    """The triangles of which at least a part can be seen."""
    triangles = len(soup.areas)
    owner = np.repeat(np.arange(triangles), 4)
    weights = rng.dirichlet(np.ones(3), len(owner))
    where = np.einsum("nk,nkd->nd", weights, soup.corners[owner])
    seen = _is_exposed(scene, where, soup.normals[owner]).reshape(triangles, 4).any(axis=1)
    return soup.select(np.flatnonzero(seen)) if seen.any() else soup


def _is_exposed(scene: RayScene, where: FloatArray, normals: FloatArray) -> NDArray[np.bool_]:
    """Whether points can be seen from higher than `HIDDEN_M` above them, in a few directions.

    Without this the wall behind a picture, black as no light gets there, would be scanned too, and
    its wide discs would shine through in slanting views.
    """
    frames = tangent_frames(normals)
    seen = np.zeros(len(where), dtype=np.bool_)
    for k in range(LOOKS):
        tilt, turn = np.arcsin(np.sqrt((k + 0.5) / LOOKS)), 2.399963 * k
        local = np.array([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)])
        left = np.flatnonzero(~seen)
        hits = scene.cast(where[left] + 1e-3 * normals[left], local @ frames[left])
        seen[left] = hits.distance * np.cos(tilt) > HIDDEN_M
    return seen


@dataclass(frozen=True, slots=True, eq=False)
class _Fitter:
    """Turns and narrows discs near edges and bends so that they hardly reach past the surface."""

    scene: RayScene
    folds: Edges
    silhouette_bias_m: float

    def fitted(self, sites: Sites) -> Sites:
        """The sites with `spacing` read, and returned, as deviations."""
        reach = HALO_REACH * sites.spacing
        longest = reach.max(axis=1)
        to_fold = self.folds.tree.query(
            sites.where, distance_upper_bound=1.3 * float(longest.max()), workers=-1
        )[0]
        doubtful = np.flatnonzero(to_fold < 1.3 * longest)
        if not len(doubtful):
            return sites
        where, frames = sites.where[doubtful], sites.frames[doubtful]
        reach = reach[doubtful]
        frames = self._along_the_surface(where, frames, reach)
        factors = np.stack([self._shrink(where, frames[:, k], reach[:, k]) for k in (0, 1)], axis=1)
        all_frames, spacing = sites.frames.copy(), sites.spacing.copy()
        all_frames[doubtful] = frames
        spacing[doubtful] = np.maximum(spacing[doubtful] * factors, THIN_M)
        return replace(sites, frames=all_frames, spacing=spacing)

    def _past(self, where: FloatArray, step: FloatArray) -> FloatArray:
        """How far from the surface the farther of two opposite points is."""
        distance = self.scene.distance(np.concatenate([where + step, where - step]))
        return np.maximum(*np.split(distance, 2))

    def _along_the_surface(
        self, where: FloatArray, frames: FloatArray, reach: FloatArray
    ) -> FloatArray:
        """Turn the long axis of a disc that sticks out to the way the surface is straightest."""
        out = np.maximum(*(self._past(where, frames[:, k] * reach[:, k : k + 1]) for k in (0, 1)))
        sticking = np.flatnonzero(out > self.silhouette_bias_m)
        best = np.full(len(sticking), np.inf)
        long_axis = frames[sticking, 1].copy()
        farthest = reach[sticking].max(axis=1, keepdims=True)
        for angle in np.linspace(0.0, np.pi, 4, endpoint=False):
            axis = np.sin(angle) * frames[sticking, 0] + np.cos(angle) * frames[sticking, 1]
            past = self._past(where[sticking], axis * farthest)
            better = past < best - 2e-4
            best[better], long_axis[better] = past[better], axis[better]
        turned = frames.copy()
        turned[sticking, 1] = long_axis
        turned[sticking, 0] = np.cross(long_axis, frames[sticking, 2])
        return turned

    def _shrink(self, where: FloatArray, axis: FloatArray, reach: FloatArray) -> FloatArray:
        factor = np.full(len(where), SHRINK[-1])
        left = np.arange(len(where))
        for shrink in SHRINK:
            step = axis[left] * (shrink * reach[left])[:, None]
            good = self._past(where[left], step) <= self.silhouette_bias_m
            factor[left[good]] = shrink
            left = left[~good]
            if not len(left):
                break
        return factor


def _alphas(sites: Sites, checks: Sites) -> tuple[IndexArray, NDArray[np.float32]]:
    """(M, K) discs around each check point and their alpha there, seen straight on."""
    k = min(NEIGHBOURS, len(sites))
    index = KDTree(sites.where).query(checks.where, k=k, workers=-1)[1].reshape(len(checks), k)
    distance = distance_from(sites, index, checks.where)
    normals = sites.frames[:, 2].astype(np.float32)
    facing = (normals[index] @ checks.frames[:, 2, :, None].astype(np.float32))[..., 0]
    alpha = PEAK_ALPHA * np.exp(-0.5 * distance**2)
    return index, np.where(facing > 0.5, alpha, 0.0)


def _holes(sites: Sites, checks: Sites, allowed: int) -> tuple[IndexArray, IndexArray]:
    """Check points that nothing covers, and those of them where discs would not pile up."""
    passing = np.prod(1.0 - _alphas(sites, checks)[1], axis=1)
    bare = np.flatnonzero(passing > HOLE)
    bare = bare[np.argsort(-passing[bare], kind="stable")]
    level = np.ceil(np.log2(checks.spacing[bare].max(axis=1)))
    cell = np.floor(checks.where[bare] / np.exp2(level)[:, None])
    side = np.round(checks.frames[bare, 2] * 2)
    first = np.unique(np.column_stack([level, cell, side]), axis=0, return_index=True)[1]
    return bare, bare[np.sort(first)][: max(0, allowed)]


def _colours(soup: Soup, sites: Sites, checks: Sites, areas: FloatArray) -> FloatArray:
    """(N, 3) the texture under each disc, sharpened so that the blend comes closer to it.

    The sharpening stays small: discs blend in another order from every side.
    """
    index, alpha = _alphas(sites, checks)
    total = alpha.sum(axis=1, keepdims=True)
    share = alpha / np.maximum(total, 1e-3)
    target = colours(soup, checks.points) / np.float32(255.0)
    flat = index.ravel()
    own_area = np.sqrt(sites.spacing.prod(axis=1))[index]
    core = np.where(alpha > 0.6 * PEAK_ALPHA, alpha, 0.0) * areas[:, None] / own_area**2
    blend = share * areas[:, None] / own_area**2

    def mean(values: NDArray[np.float32], weights: FloatArray, rest: FloatArray) -> FloatArray:
        weight = weights.ravel().astype(np.float64)
        received = np.bincount(flat, weight, len(sites))
        sums = [
            np.bincount(flat, weight * np.repeat(values[:, c], index.shape[1]), len(sites))
            for c in range(3)
        ]
        average = np.stack(sums, axis=1) / np.maximum(received, 1e-12)[:, None]
        return np.where((received > 1e-6)[:, None], average, rest)

    plain = mean(target, core, colours(soup, sites.points).astype(np.float64) / 255.0)
    colour = plain
    for _ in range(COLOUR_ROUNDS):
        shown = np.einsum("nk,nkc->nc", share, colour.astype(np.float32)[index])
        step = mean(target - shown, blend, np.zeros_like(plain))
        colour = np.clip(colour + step, plain - SHARPEN, plain + SHARPEN).clip(0.0, 1.0)
    return colour


def _join(a: Sites, b: Sites) -> Sites:
    def both(x: NDArray[Any], y: NDArray[Any]) -> NDArray[Any]:
        parts: Sequence[NDArray[Any]] = (x, y)
        return np.concatenate(parts)

    points = SurfacePoints(
        both(a.points.triangle, b.points.triangle), both(a.points.barycentric, b.points.barycentric)
    )
    return Sites(
        points, both(a.where, b.where), both(a.frames, b.frames), both(a.spacing, b.spacing)
    )
