# pyright: standard
"""A surface bake: textured meshes to a splat scan, with the imperfections that a real scan has.

The scan stands in for a trained one. It is never what a camera sees: pictures come from the meshes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from benchmarks.bake.discs import Discs, cover
from benchmarks.bake.spacing import Limits
from benchmarks.bake.surface import soup_of
from scenes.mesh import PhysicalObject, PhysicalRoom, TexturedMesh
from scenes.pose import Pose
from scenes.rays import RayScene
from scenes.splats import SH_C0, SplatCloud, concatenate
from scenes.state import ObjectModel

FloatArray = NDArray[np.float64]

ROOM_LIMITS = Limits(finest_m=0.004, widest_m=0.07, edge_m=0.007, fold_m=0.02)
ROOM_SILHOUETTE_BIAS = 4.0
"""The room may reach farther past its surfaces than an object, whose outline is tracked."""
OBJECT_LIMITS = Limits(finest_m=0.0015, widest_m=0.012, edge_m=0.002, fold_m=0.005)


@dataclass(frozen=True, slots=True)
class ScanImperfections:
    """Faults of a scan, as deviations of normal noise unless said otherwise.

    Attributes:
        along_normal_m: position noise of every splat along its normal.
        colour: colour noise of every splat, 0..1 units.
        exposure: brightness error of a whole body, as a fraction.
        spread: relative noise of the splat sizes.
        blur_m: added to every tangential deviation (in quadrature).
        scale_error: error of the whole scan's scale, as a fraction; its sign is random.
        floaters: how many stray splats hang in the room.
        silhouette_bias_m: how far splats of an object reach past its true surface, metres: the
            silhouette bias of a scan, not noise.
    """

    along_normal_m: float = 0.001
    colour: float = 0.012
    exposure: float = 0.015
    spread: float = 0.08
    blur_m: float = 0.001
    scale_error: float = 0.002
    floaters: int = 40
    silhouette_bias_m: float = 0.001


def bake(
    room: PhysicalRoom,
    *,
    rng: np.random.Generator,
    room_splats: int = 240_000,
    object_splats: int = 12_000,
    imperfections: ScanImperfections | None = None,
) -> tuple[SplatCloud, tuple[ObjectModel, ...]]:
    """Scan a physical room into splats.

    Flat discs lie on the surfaces, denser where the texture has detail and near edges, and narrower
    across edges and bends so that they hardly reach past the surface. Static textures hold the
    room's light already; objects are lit as they stand, `albedo · (ambient · open + key · free ·
    n·l)` with ray-cast occlusion, so an object's scan keeps the light of where it was scanned.
    Identical twins get the same discs, each with its own light and its own imperfections.

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
    static = cover(
        soup_of(room.static),
        room_splats,
        rng,
        silhouette_bias_m=ROOM_SILHOUETTE_BIAS * flaws.silhouette_bias_m,
        limits=ROOM_LIMITS,
    )
    cloud = _add_flaws(static, flaws, rng, scale)
    if flaws.floaters:
        cloud = concatenate([cloud, _floaters(room, cloud, flaws.floaters, rng)])
    models = []
    covered: dict[str, Discs] = {}
    for item in room.objects:
        if item.kind not in covered:
            covered[item.kind] = cover(
                soup_of(item.meshes),
                object_splats,
                rng,
                silhouette_bias_m=flaws.silhouette_bias_m,
                limits=OBJECT_LIMITS,
            )
        discs = covered[item.kind]
        models.append(_model(item, discs, surroundings, rng=rng, flaws=flaws, scale=scale))
    return cloud, tuple(models)


def _model(
    item: PhysicalObject,
    discs: Discs,
    surroundings: _Surroundings,
    *,
    rng: np.random.Generator,
    flaws: ScanImperfections,
    scale: float,
) -> ObjectModel:
    light = surroundings.light(
        item.world_from_object @ discs.means,
        discs.frames[:, 2] @ item.world_from_object.rotation.T,
        rng,
    )
    lit = Discs(discs.means, discs.frames, discs.spread_m, discs.colours * light[:, None])
    pose = item.world_from_object
    w, d, h = item.box_m
    return ObjectModel(
        item.object_id,
        item.object_id.replace("-", " ").capitalize(),
        item.kind,
        _add_flaws(lit, flaws, rng, scale),
        (w * scale, d * scale, h * scale),
        float(pose.translation[2]) * scale,
        Pose(pose.rotation, pose.translation * scale),
    )


def _add_flaws(
    discs: Discs, flaws: ScanImperfections, rng: np.random.Generator, scale: float
) -> SplatCloud:
    """The discs as splats, with the imperfections."""
    n = len(discs.means)
    off = rng.normal(0, flaws.along_normal_m, (n, 1)) * discs.frames[:, 2]
    sizes = discs.spread_m.copy()
    sizes[:, :2] = np.hypot(sizes[:, :2], flaws.blur_m) * np.exp(
        rng.normal(0, flaws.spread, (n, 2))
    )
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
    high = np.array([*room.footprint_m[1], max(0.2, float(cloud.means[:, 2].max()) - 0.1)])
    return SplatCloud(
        rng.uniform(low, high, (count, 3)).astype(np.float32),
        rng.uniform(0.003, 0.02, (count, 3)).astype(np.float32),
        np.tile(np.array([1, 0, 0, 0], dtype=np.float32), (count, 1)),
        rng.uniform(0.05, 0.3, count).astype(np.float32),
        cloud.sh[rng.integers(0, len(cloud), count)],
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Surroundings:
    """Surfaces around an object during the scan, for its light."""

    room: PhysicalRoom
    meshes: tuple[tuple[TexturedMesh, Pose], ...]

    @staticmethod
    def of(room: PhysicalRoom) -> _Surroundings:
        moving = tuple((m, o.world_from_object) for o in room.objects for m in o.meshes)
        return _Surroundings(room, tuple((m, Pose.identity()) for m in room.static) + moving)

    def light(self, where: FloatArray, normals: FloatArray, rng: np.random.Generator) -> FloatArray:
        """(N,) light at world points: ambient · openness + key · free part of the window · n·l."""
        scene = RayScene(
            np.concatenate([(pose @ mesh.vertices)[mesh.faces] for mesh, pose in self.meshes])
        )
        origins = where + 2e-3 * normals

        def seen(directions: FloatArray, reach_m: float) -> FloatArray:
            return np.minimum(scene.cast(origins, directions).distance / reach_m, 1.0)

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
