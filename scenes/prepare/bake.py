"""A surface bake: textured meshes to a splat scan, with the imperfections that a real scan has.

The scan stands in for a trained one. It is never what a camera sees: pictures come from the meshes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from scenes.mesh import PhysicalObject, PhysicalRoom, TexturedMesh
from scenes.pose import Pose
from scenes.prepare.surface import (
    Soup,
    SurfacePoints,
    colours,
    nearby,
    positions,
    scatter,
    sharp_edges,
    soup_of,
    texture_detail,
)
from scenes.splats import SH_C0, SplatCloud, concatenate
from scenes.state import ObjectModel

FloatArray = NDArray[np.float64]

CANDIDATES_PER_SPLAT = 6
COVER = 0.74
"""Tangential deviation over local spacing: neighbours overlap without a gap, and blur little more."""
EDGE_ANGLE_RAD = 0.6
HALO_REACH = 1.5
"""A splat is shrunk until points this many deviations out are near the surface."""
PROBE_SHRINK = (1.0, 0.7, 0.49, 0.34, 0.24, 0.17)
THIN_M = 0.0012
"""Deviation along the normal."""


@dataclass(frozen=True, slots=True)
class ScanImperfections:
    """What is wrong with the scan, as deviations of normal noise unless said otherwise.

    Attributes:
        along_normal_m: position noise of every splat along its normal.
        colour: colour noise of every splat, 0..1 units.
        exposure: brightness error of a whole body, as a fraction.
        spread: relative noise of the splat sizes.
        blur_m: added to every tangential deviation (in quadrature).
        scale_error: error of the whole scan's scale, as a fraction; its sign is random.
        floaters: how many stray splats hang in the room.
        halo_m: how far a splat's visible part may reach past the true surface; not noise.
    """

    along_normal_m: float = 0.0015
    colour: float = 0.012
    exposure: float = 0.015
    spread: float = 0.08
    blur_m: float = 0.001
    scale_error: float = 0.002
    floaters: int = 60
    halo_m: float = 0.002


@dataclass(frozen=True, slots=True, eq=False)
class _Discs:
    """Splats before the imperfections: means, frames (rows: tangent, tangent, normal), deviations."""

    means: FloatArray
    frames: FloatArray
    spread_m: FloatArray
    colours: FloatArray


def bake(
    room: PhysicalRoom,
    *,
    rng: np.random.Generator,
    room_splats: int = 160_000,
    object_splats: int = 12_000,
    imperfections: ScanImperfections | None = None,
) -> tuple[SplatCloud, tuple[ObjectModel, ...]]:
    """Scan a physical room into splats.

    Flat discs lie on the surfaces, denser where the texture has detail and near edges, and narrower
    across edges and bends so that they hardly reach past the surface. Static textures hold the
    room's light already; objects are lit as they stand: albedo · (ambient · open + key · free · n·l)
    with ray-cast occlusion, so the scan of an object keeps the light of the place it was scanned at.

    Args:
        room: the physical world.
        rng: source of the sampling and of the imperfections.
        room_splats: splats of the static room.
        object_splats: splats of each object.
        imperfections: what is wrong with the scan; the defaults if not given.

    Returns:
        The static room in world coordinates without the objects, and the objects as the scan knows
        them. The scale error applies to everything, poses included, as in one real scan.

    Raises:
        ValueError: a count is not positive or a body has no surface.
    """
    for name, count in (("room_splats", room_splats), ("object_splats", object_splats)):
        if count < 1:
            raise ValueError(f"bake: {name} = {count}, wanted at least 1")
    flaws = imperfections or ScanImperfections()
    scale = 1.0 + flaws.scale_error * float(rng.choice([-1.0, 1.0]))
    surroundings = _Surroundings.of(room)
    static = _discs(soup_of(room.static), room_splats, rng, halo_m=flaws.halo_m, floor_m=0.004)
    cloud = _flawed(static, flaws, rng, scale)
    if flaws.floaters:
        cloud = concatenate([cloud, _floaters(room, cloud, flaws.floaters, rng)])
    models = tuple(
        _model(thing, surroundings, object_splats, rng=rng, flaws=flaws, scale=scale)
        for thing in room.objects
    )
    return cloud, models


def _model(
    thing: PhysicalObject,
    surroundings: _Surroundings,
    count: int,
    *,
    rng: np.random.Generator,
    flaws: ScanImperfections,
    scale: float,
) -> ObjectModel:
    discs = _discs(soup_of(thing.meshes), count, rng, halo_m=flaws.halo_m, floor_m=0.0015)
    light = surroundings.light(
        thing.world_from_object @ discs.means,
        discs.frames[:, 2] @ thing.world_from_object.rotation.T,
        rng,
    )
    lit = _Discs(discs.means, discs.frames, discs.spread_m, discs.colours * light[:, None])
    pose = thing.world_from_object
    w, d, h = thing.box_m
    return ObjectModel(
        thing.object_id,
        thing.object_id.replace("-", " ").capitalize(),
        thing.kind,
        _flawed(lit, flaws, rng, scale),
        (w * scale, d * scale, h * scale),
        float(pose.translation[2]) * scale,
        Pose(pose.rotation, pose.translation * scale),
    )


def _discs(
    soup: Soup, count: int, rng: np.random.Generator, *, halo_m: float, floor_m: float
) -> _Discs:
    """`count` discs that cover the surface; `floor_m` is the finest spacing worth having."""
    candidates = scatter(soup, count * CANDIDATES_PER_SPLAT, rng)
    where = positions(soup, candidates)
    edges = cKDTree(sharp_edges(soup, angle_rad=EDGE_ANGLE_RAD, step_m=0.01))
    mean_spacing = float(np.sqrt(soup.areas.sum() / count))
    to_edge = edges.query(where, distance_upper_bound=2 * mean_spacing)[0]
    weight = _wanted_density(soup, candidates, to_edge, mean_spacing)
    chosen, spacing = _thinned(where, weight, count, float(soup.areas.sum()), rng)
    points, where, to_edge = candidates.select(chosen), where[chosen], to_edge[chosen]
    gaps = cKDTree(where).query(where, k=6)[0][:, 3:].mean(axis=1)
    spread = COVER * np.clip(gaps / 1.15, 0.7 * spacing, 1.35 * spacing).clip(floor_m)
    normals = soup.normals[points.triangle]
    frames, scales = _fitted(soup, where, normals, spread, to_edge, halo_m)
    colour = _footprint_colours(soup, points, frames, scales, rng)
    return _Discs(where, frames, scales, colour)


def _wanted_density(
    soup: Soup, candidates: SurfacePoints, to_edge: FloatArray, mean_spacing: float
) -> FloatArray:
    """Relative density per candidate: more where the texture varies and beside edges."""
    detail = colours(soup, candidates, [texture_detail(t) for t in soup.textures])[:, 0]
    textured = 0.35 + np.square(np.clip(detail / 14.0, 0.0, 4.0))
    beside = np.exp(-np.square(to_edge / (0.5 * mean_spacing)))
    return np.asarray(textured * (1.0 + 3.0 * beside), dtype=np.float64)


def _thinned(
    where: FloatArray, weight: FloatArray, count: int, area: float, rng: np.random.Generator
) -> tuple[NDArray[np.int64], FloatArray]:
    """Systematic resampling along a space-filling curve: (count,) indices and their local spacing.

    A candidate is taken at most once, so weights are capped where they ask for more than there is.
    """
    cap = 0.9 / count
    share = weight / weight.sum()
    for _ in range(8):
        share = np.minimum(share, cap)
        free = share < cap
        share[free] *= (1.0 - cap * np.count_nonzero(~free)) / share[free].sum()
    order = _morton_order(where)
    cumulative = np.cumsum(share[order])
    ticks = (np.arange(count) + rng.uniform(0.2, 0.8, count)) / count * cumulative[-1]
    chosen = order[np.unique(np.searchsorted(cumulative, ticks).clip(0, len(order) - 1))]
    spacing = np.sqrt(area / len(where) / (count * share[chosen]))
    return chosen, spacing


def _morton_order(where: FloatArray) -> NDArray[np.int64]:
    low = where.min(axis=0)
    cell = max(float(np.ptp(where, axis=0).max()), 1e-9) / 2**16
    grid = ((where - low) / cell).astype(np.uint64).clip(0, 2**16 - 1)
    code = np.zeros(len(where), dtype=np.uint64)
    for bit in range(16):
        for axis in range(3):
            code |= ((grid[:, axis] >> np.uint64(bit)) & np.uint64(1)) << np.uint64(3 * bit + axis)
    return np.argsort(code, kind="stable")


def _fitted(
    soup: Soup,
    where: FloatArray,
    normals: FloatArray,
    spread: FloatArray,
    to_edge: FloatArray,
    halo_m: float,
) -> tuple[FloatArray, FloatArray]:
    """Frames and deviations, turned and narrowed so that no disc reaches far past the surface."""
    import open3d as o3d  # noqa: PLC0415  (heavy; only the bake needs it)

    frames = _frames(normals)
    scales = np.stack([spread, spread, np.full(len(spread), THIN_M)], axis=1)
    doubtful = np.flatnonzero(to_edge < 2.0 * HALO_REACH * spread)
    bent = np.flatnonzero(_bends(soup, where, spread))
    doubtful = np.union1d(doubtful, bent)
    if not len(doubtful):
        return frames, scales
    scene = o3d.t.geometry.RaycastingScene(nthreads=0)
    corners = soup.corners.reshape(-1, 3).astype(np.float32)
    scene.add_triangles(corners, np.arange(len(corners), dtype=np.uint32).reshape(-1, 3))

    def overshoot(index: NDArray[np.int64], reach: FloatArray, axis: FloatArray) -> FloatArray:
        steps = reach[:, None] * axis
        ends = np.concatenate([where[index] + steps, where[index] - steps]).astype(np.float32)
        distance = scene.compute_distance(o3d.core.Tensor(ends)).numpy()
        return np.maximum(*np.split(distance, 2)).astype(np.float64)

    reach = HALO_REACH * spread[doubtful]
    turns = np.linspace(0, np.pi, 4, endpoint=False)
    best = np.full(len(doubtful), np.inf)
    turned = frames[doubtful].copy()
    for angle in turns:
        axis = np.cos(angle) * frames[doubtful, 0] + np.sin(angle) * frames[doubtful, 1]
        past = overshoot(doubtful, reach, axis)
        better = past < best - 1e-5
        best[better] = past[better]
        turned[better, 0] = axis[better]
        turned[better, 1] = np.cross(turned[better, 2], axis[better])
    frames[doubtful] = turned
    for k in (0, 1):
        factor = np.full(len(doubtful), PROBE_SHRINK[-1])
        open_ = np.arange(len(doubtful))
        for shrink in PROBE_SHRINK:
            past = overshoot(doubtful[open_], shrink * reach[open_], turned[open_, k])
            good = past <= halo_m
            factor[open_[good]] = shrink
            open_ = open_[~good]
            if not len(open_):
                break
        scales[doubtful, k] = np.maximum(spread[doubtful] * factor, THIN_M)
    return frames, scales


def _bends(soup: Soup, where: FloatArray, spread: FloatArray) -> NDArray[np.bool_]:
    """Whether the surface turns within reach, by small faces that meet at an angle."""
    folds = sharp_edges(soup, angle_rad=0.12, step_m=0.01)
    if not len(folds):
        return np.zeros(len(where), dtype=np.bool_)
    reach = 2.0 * HALO_REACH * spread
    distance = cKDTree(folds).query(where, distance_upper_bound=float(reach.max()))[0]
    return np.asarray(distance < reach, dtype=np.bool_)


def _frames(normals: FloatArray) -> FloatArray:
    """(N, 3, 3) with rows tangent, tangent, normal, right-handed."""
    hint = np.where(np.abs(normals[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])
    first = np.cross(hint, normals)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(normals, first), normals], axis=1)


def _footprint_colours(
    soup: Soup,
    points: SurfacePoints,
    frames: FloatArray,
    scales: FloatArray,
    rng: np.random.Generator,
) -> FloatArray:
    """(N, 3) texture averaged over each splat's core, 0..1."""
    total = colours(soup, points).astype(np.float64)
    taps = 6
    for k in range(taps):
        angle = 2 * np.pi * (k + rng.random(len(points))) / taps
        offsets = 0.5 * scales[:, :2] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        total += colours(soup, nearby(soup, points, offsets, frames=frames))
    return total / ((taps + 1) * 255.0)


def _flawed(
    discs: _Discs, flaws: ScanImperfections, rng: np.random.Generator, scale: float
) -> SplatCloud:
    """The discs as splats, with the imperfections."""
    n = len(discs.means)
    off = rng.normal(0, flaws.along_normal_m, (n, 1)) * discs.frames[:, 2]
    sizes = discs.spread_m.copy()
    sizes[:, :2] = np.hypot(sizes[:, :2], flaws.blur_m) * np.exp(rng.normal(0, flaws.spread, (n, 2)))
    colour = discs.colours * (1 + rng.normal(0, flaws.exposure)) + rng.normal(
        0, flaws.colour, (n, 3)
    )
    xyzw = Rotation.from_matrix(np.swapaxes(discs.frames, 1, 2)).as_quat()
    return SplatCloud(
        ((discs.means + off) * scale).astype(np.float32),
        (sizes * scale).astype(np.float32),
        np.roll(xyzw, 1, axis=1).astype(np.float32),
        rng.uniform(0.92, 0.99, n).astype(np.float32),
        ((colour.clip(0, 1) - 0.5) / SH_C0).astype(np.float32)[:, None, :],
    )


def _floaters(
    room: PhysicalRoom, cloud: SplatCloud, count: int, rng: np.random.Generator
) -> SplatCloud:
    """Faint stray splats with colours of the room, hanging in it."""
    low = np.array([*room.footprint_m[0], 0.1])
    high = np.array([*room.footprint_m[1], float(cloud.means[:, 2].max()) - 0.1])
    return SplatCloud(
        rng.uniform(low, high, (count, 3)).astype(np.float32),
        rng.uniform(0.003, 0.02, (count, 3)).astype(np.float32),
        np.tile(np.array([1, 0, 0, 0], dtype=np.float32), (count, 1)),
        rng.uniform(0.05, 0.3, count).astype(np.float32),
        cloud.sh[rng.integers(0, len(cloud), count)],
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Surroundings:
    """What stands around an object during the scan, for its light."""

    room: PhysicalRoom
    meshes: tuple[tuple[TexturedMesh, Pose], ...]

    @staticmethod
    def of(room: PhysicalRoom) -> _Surroundings:
        moving = tuple((m, o.world_from_object) for o in room.objects for m in o.meshes)
        return _Surroundings(room, tuple((m, Pose.identity()) for m in room.static) + moving)

    def light(
        self, where: FloatArray, normals: FloatArray, rng: np.random.Generator
    ) -> FloatArray:
        """(N,) light at world points: ambient · openness + key · free part of the window · n·l."""
        import open3d as o3d  # noqa: PLC0415

        scene = o3d.t.geometry.RaycastingScene()
        for mesh, pose in self.meshes:
            scene.add_triangles(
                (pose @ mesh.vertices).astype(np.float32), mesh.faces.astype(np.uint32)
            )

        def seen(directions: FloatArray, reach_m: float) -> FloatArray:
            rays = np.concatenate([where + 2e-3 * normals, directions], axis=1).astype(np.float32)
            distance = scene.cast_rays(o3d.core.Tensor(rays))["t_hit"].numpy()
            return np.minimum(distance / reach_m, 1.0)

        openness = np.zeros(len(where))
        taps = 48
        for direction in _sphere(taps, rng):
            tilted = normals + 0.999 * direction
            openness += seen(tilted / np.linalg.norm(tilted, axis=1, keepdims=True), 0.8) / taps
        towards = self.room.light_direction
        free = np.zeros(len(where))
        for direction in _sphere(taps // 2, rng):
            soft = towards + 0.35 * direction
            soft = np.broadcast_to(soft / np.linalg.norm(soft), where.shape)
            free += (seen(soft, 1.2) >= 1.0) / (taps // 2)
        key = self.room.key * np.maximum(normals @ towards, 0.0) * free
        return self.room.ambient * openness + key


def _sphere(count: int, rng: np.random.Generator) -> Sequence[FloatArray]:
    """Unit vectors spread evenly over the sphere (golden spiral, turned at random)."""
    k = np.arange(count) + 0.5
    z = 1 - 2 * k / count
    angle = np.pi * (1 + 5**0.5) * k + rng.uniform(0, 2 * np.pi)
    r = np.sqrt(1 - z * z)
    return list(np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1))
