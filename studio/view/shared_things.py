"""Things of people as splats: a proposal as a tinted copy of its object, a primitive as discs.

Drawn with the room they are hidden by it, and hide it, as everything else.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from scenes.render.renderer import PosedSplats
from scenes.splats import SH_C0, SplatCloud
from scenes.state import (
    ObjectModel,
    PrimitiveShape,
    Proposal,
    SceneState,
    SharedPrimitive,
)
from studio.view.attention import Sphere, attention_of

MET: tuple[float, float, float] = (0.30, 0.86, 0.55)
OPEN: tuple[float, float, float] = (0.95, 0.75, 0.25)
"""Colours of proposals: of one whose object stands there, and of one that is still open."""

TINT, MET_TINT = 0.6, 0.85
"""Share of that colour in the copy's own; the rest is the object's."""

OPACITY, MET_OPACITY = 0.5, 0.8
"""Of a copy's splats, times their own."""

LARGER = 1.03
"""Size of a copy over the object's, which is seen in it where it stands there."""

DISCS = 2500
"""Splats of a primitive, chosen: 2 cm apart on a box of half a metre."""

SHAFT_SHARE, SHAFT_WIDTH = 0.6, 0.44
"""Of an arrow: its shaft's length of the whole, and its width of the head's."""

RING_POINTS = 49
"""Places of a light ring, chosen: a circle to the eye."""

Array = NDArray[np.float64]


def met_proposals(
    proposals: Iterable[Proposal],
    poses: Mapping[str, Pose],
    *,
    models: Mapping[str, ObjectModel],
    symmetry_of_kind: Mapping[str, int],
) -> frozenset[str]:
    """Return ids of proposals whose objects stand as proposed.

    Args:
        proposals: of a state.
        poses: `world_from_object` by object id; the others are where the scan saw them.
        models: objects of the scan by id.
        symmetry_of_kind: how many yaws of a kind look the same.
    """
    return frozenset(
        proposal.proposal_id
        for proposal in proposals
        if (model := models.get(proposal.object_id)) is not None
        and proposal.is_met(
            poses.get(model.object_id, model.world_from_object),
            symmetry=symmetry_of_kind.get(model.kind, 1),
        )
    )


def attention_rings(state: SceneState, models: Iterable[ObjectModel]) -> list[Array]:
    """Return (N, 3) rings on what objects stand on, around each that somebody points at."""
    poses = {key: track.world_from_object for key, track in state.objects.items()}
    there = {item.object_id: item for item in models}
    spheres: dict[str, Sphere] = {}
    for key, item in there.items():
        centre, radius = item.sphere()
        spheres[key] = (poses.get(key, item.world_from_object) @ centre, radius)
    met = {attention_of(avatar, spheres).points_at for avatar in state.avatars.values()}
    angles = np.linspace(0.0, 2.0 * np.pi, RING_POINTS)
    circle = np.stack([np.cos(angles), np.sin(angles), np.zeros(RING_POINTS)], axis=1)
    return [
        poses.get(key, there[key].world_from_object) @ (spheres[key][1] * circle)
        for key in sorted(met - {""})
    ]


def proposed_splats(
    proposals: Iterable[Proposal], models: Mapping[str, ObjectModel], *, met: frozenset[str]
) -> list[PosedSplats]:
    """Return tinted copies of objects where they should go."""
    return [
        PosedSplats(
            _copy(models[item.object_id].splats, item.proposal_id in met), item.world_from_object
        )
        for item in proposals
        if item.object_id in models
    ]


def primitive_splats(primitive: SharedPrimitive) -> PosedSplats:
    """Return a primitive covered with flat discs of its colour."""
    assert primitive.shape is not None
    cloud = _covered(primitive.shape, primitive.size_m, colour=primitive.colour)
    return PosedSplats(cloud, primitive.world_from_primitive)


@lru_cache(maxsize=16)
def _copy(cloud: SplatCloud, is_met: bool) -> SplatCloud:
    share, colour, opacity = (MET_TINT, MET, MET_OPACITY) if is_met else (TINT, OPEN, OPACITY)
    mixed = (1.0 - share) * cloud.colours() + share * np.array(colour, dtype=np.float32)
    return SplatCloud(
        (LARGER * cloud.means).astype(np.float32),
        (LARGER * cloud.scales).astype(np.float32),
        cloud.rotations,
        (opacity * cloud.opacities).astype(np.float32),
        ((mixed - 0.5) / SH_C0)[:, None, :].astype(np.float32),
    )


@lru_cache(maxsize=64)
def _covered(
    shape: PrimitiveShape, size_m: tuple[float, float, float], *, colour: tuple[float, float, float]
) -> SplatCloud:
    points, normals = _surface(shape, np.array(size_m))
    x, y, z = size_m
    area = 2.0 * (x * y + y * z + z * x)
    radius = 0.75 * float(np.sqrt(area / len(points)))
    # Light from above, as in the window.
    light = 0.72 + 0.28 * normals[:, 2]
    rgb = light[:, None] * np.array(colour)
    return SplatCloud(
        points.astype(np.float32),
        np.tile(np.array([radius, radius, 0.002], np.float32), (len(points), 1)),
        _facing(normals).astype(np.float32),
        np.full(len(points), 0.97, np.float32),
        ((rgb - 0.5) / SH_C0)[:, None, :].astype(np.float32),
    )


def _surface(shape: PrimitiveShape, size: Array) -> tuple[Array, Array]:
    """(N, 3) points on a body whose base is at z = 0, and (N, 3) normals."""
    rng = np.random.default_rng(0)
    if shape == "box":
        points, normals = _box(rng, size)
    elif shape == "sphere":
        normals = rng.normal(size=(DISCS, 3))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        points = 0.5 * normals
        points, normals = points * size, normals / size
    elif shape == "cylinder":
        points, normals = _turned(rng, np.array([[0, -0.5], [0.5, -0.5], [0.5, 0.5], [0, 0.5]]))
        points, normals = points * size, normals / size
    else:
        neck, wide = SHAFT_SHARE - 0.5, 0.5 * SHAFT_WIDTH
        outline = np.array([[0, -0.5], [wide, -0.5], [wide, neck], [0.5, neck], [0, 0.5]])
        points, normals = _turned(rng, outline)
        # About z; an arrow points along +x.
        points, normals = (it[:, [2, 0, 1]] for it in (points, normals))
        points, normals = points * size, normals / size
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return points + np.array([0.0, 0.0, 0.5 * size[2]]), normals


def _box(rng: np.random.Generator, size: Array) -> tuple[Array, Array]:
    areas = np.array([size[1] * size[2], size[2] * size[0], size[0] * size[1]])
    axis = rng.choice(3, DISCS, p=areas / areas.sum())
    side = rng.choice([-0.5, 0.5], DISCS)
    points = rng.uniform(-0.5, 0.5, (DISCS, 3))
    rows = np.arange(DISCS)
    points[rows, axis] = side
    normals = np.zeros((DISCS, 3))
    normals[rows, axis] = np.sign(side)
    return points * size, normals


def _turned(rng: np.random.Generator, outline: Array) -> tuple[Array, Array]:
    """Points of an outline (radius, z) turned about z, and normals."""
    ways = np.diff(outline, axis=0)
    areas = np.linalg.norm(ways, axis=1) * (outline[:-1, 0] + outline[1:, 0]) + 1e-6
    part = rng.choice(len(ways), DISCS, p=areas / areas.sum())
    share, angle = rng.uniform(0, 1, DISCS), rng.uniform(0, 2 * np.pi, DISCS)
    radius, z = (outline[part] + share[:, None] * ways[part]).T
    out_r, out_z = ways[part, 1], -ways[part, 0]
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points = np.concatenate([radius[:, None] * circle, z[:, None]], axis=1)
    normals = np.concatenate([out_r[:, None] * circle, out_z[:, None]], axis=1)
    return points, normals / np.linalg.norm(normals, axis=1, keepdims=True)


def _facing(normals: Array) -> Array:
    """(N, 4) quaternions w x y z that turn +z to each normal."""
    w = 1.0 + normals[:, 2]
    found = np.stack([w, -normals[:, 1], normals[:, 0], np.zeros(len(w))], axis=1)
    found[w < 1e-6] = (0.0, 1.0, 0.0, 0.0)
    return found / np.linalg.norm(found, axis=1, keepdims=True)
