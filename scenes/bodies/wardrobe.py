"""Parts of a person's figure at rest, as blended shapes: body, clothes, hair and a calm face."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np

from scenes.bodies.bones import rest_skeleton
from scenes.bodies.hands import KNUCKLES, PHALANGES_M, REST, fingers, rest_palm
from scenes.bodies.implicit import (
    Shape,
    common,
    cone,
    ellipsoid,
    grown,
    half_space,
    turned_profile,
    union,
)
from scenes.bodies.skeleton import EYE_M, SIDES, Bone, arm_rows, leg_rows
from scenes.bodies.vectors import Array

HEAD_X_M = 0.022
"""Middle of the head ahead of the spine, metres: the face is where the eyes are."""

HEAD = (
    (-0.122, 0.018, 0.018, 0.046), (-0.112, 0.046, 0.040, 0.036), (-0.094, 0.066, 0.056, 0.023),
    (-0.064, 0.083, 0.069, 0.011), (-0.025, 0.095, 0.077, 0.003), (0.010, 0.099, 0.081, 0.000),
    (0.045, 0.100, 0.082, -0.003), (0.078, 0.090, 0.075, -0.005), (0.100, 0.066, 0.056, -0.006),
    (0.114, 0.020, 0.018, -0.006),
)  # fmt: skip
"""Rings of a head from the chin, metres from the eyes' height."""

TORSO = (
    (0.825, 0.122, 0.180, -0.004), (0.86, 0.128, 0.186, -0.004), (0.94, 0.122, 0.176, 0.000),
    (1.08, 0.107, 0.150, 0.006), (1.20, 0.110, 0.157, 0.010), (1.29, 0.106, 0.160, 0.006),
    (1.36, 0.084, 0.138, -0.004), (1.42, 0.062, 0.082, -0.008), (1.462, 0.057, 0.062, -0.006),
)  # fmt: skip
"""Rings of a jumper from its hem, metres over the floor."""

HIPS = (
    (0.76, 0.060, 0.090, 0.0), (0.82, 0.096, 0.144, -0.006), (0.90, 0.102, 0.148, -0.006),
    (0.96, 0.094, 0.136, 0.0), (1.00, 0.080, 0.120, 0.0),
)  # fmt: skip
"""Rings of trousers from the crotch up, metres over the floor."""


@dataclass(frozen=True, slots=True)
class Part:
    """A part of a figure.

    Attributes:
        dye: name of its colour.
        shape: at rest, metres, the person's axes from the floor.
        low: (3,) corner of a box around it.
        high: (3,) the other corner.
        step_m: how finely it is made of triangles.
        bones: that move it.
    """

    dye: str
    shape: Shape
    low: tuple[float, float, float]
    high: tuple[float, float, float]
    step_m: float
    bones: tuple[int, ...]


def parts() -> tuple[Part, ...]:
    """Return all parts of a person."""
    head = _head()
    found = [_jumper(), _trousers(), *_shoes(), _skin(head), *_hair(head), *_hands()]
    return (*found, *_face(head))


def _origins() -> Array:
    return rest_skeleton().origins[0]


def _jumper() -> Part:
    at = _origins()
    shapes: list[Shape] = [turned_profile(TORSO)]
    for side in (0, 1):
        shoulder, elbow, wrist = (
            at[arm_rows(bone)[side]] for bone in (Bone.UPPER_ARM, Bone.FOREARM, Bone.HAND)
        )
        cuff = elbow + 0.955 * (wrist - elbow)
        inner = np.array([-0.006, 0.30 * shoulder[1], 1.425])
        sleeve = union(
            cone(inner, shoulder, radii=(0.040, 0.050)),
            cone(shoulder, elbow, radii=(0.053, 0.045)),
            cone(elbow, cuff, radii=(0.046, 0.036)),
            blend_m=0.02,
        )
        shapes.append(sleeve)
    bones = (Bone.PELVIS, Bone.SPINE, Bone.CHEST, *_both(Bone.CLAVICLE), *_both(Bone.UPPER_ARM))
    reach = float(np.abs(at[: Bone.FINGERS, 1]).max()) + 0.06
    return Part(
        "top", union(*shapes, blend_m=0.050), (-0.16, -reach, 0.81), (0.16, reach, 1.48), 0.021,
        (*bones, *_both(Bone.FOREARM)),
    )  # fmt: skip


def _trousers() -> Part:
    at = _origins()
    shapes: list[Shape] = [turned_profile(HIPS)]
    for side in (0, 1):
        hip, knee, ankle = (at[leg_rows(bone)[side]] for bone in (Bone.THIGH, Bone.SHIN, Bone.FOOT))
        shapes.append(cone(hip - (0.0, 0.0, 0.02), knee, radii=(0.082, 0.062)))
        shapes.append(cone(knee, ankle - (0.006, 0.0, -0.018), radii=(0.062, 0.050)))
    bones = (Bone.PELVIS, Bone.SPINE, *_both(Bone.THIGH), *_both(Bone.SHIN))
    whole = union(*shapes, blend_m=0.035)
    hemmed = common(whole, half_space((0.0, 0.0, -1.0), -0.058), blend_m=0.006)
    return Part("trousers", hemmed, (-0.15, -0.2, 0.05), (0.15, 0.2, 1.02), 0.025, bones)


def _shoes() -> list[Part]:
    at, found = _origins(), list[Part]()
    for row in leg_rows(Bone.FOOT):
        x, y, _ = at[row]
        upper = union(
            cone((x - 0.045, y, 0.042), (x + 0.125, y, 0.034), radii=(0.040, 0.040)),
            cone((x - 0.012, y, 0.085), (x + 0.06, y, 0.045), radii=(0.040, 0.040)),
            blend_m=0.04,
        )
        shoe = common(upper, half_space((0.0, 0.0, -1.0), 0.0), blend_m=0.008)
        low, high = (x - 0.10, y - 0.055, 0.0), (x + 0.18, y + 0.055, 0.13)
        found.append(Part("shoes", shoe, low, high, 0.014, (row,)))
    return found


def _head() -> Shape:
    rings = [(EYE_M + z, along, aside, HEAD_X_M + shift) for z, along, aside, shift in HEAD]
    shapes = [turned_profile(rings)]
    nose = cone((0.116, 0, EYE_M - 0.008), (0.131, 0, EYE_M - 0.040), radii=(0.007, 0.0125))
    for side in SIDES:
        ear = ellipsoid((HEAD_X_M - 0.006, side * 0.080, EYE_M - 0.014), (0.017, 0.010, 0.028))
        shapes.append(ear)
    return union(union(*shapes, blend_m=0.008), nose, blend_m=0.016)


def _skin(head: Shape) -> Part:
    neck = cone((-0.004, 0, 1.40), (0.012, 0, EYE_M - 0.08), radii=(0.050, 0.050))
    return Part(
        "skin", union(head, neck, blend_m=0.03), (-0.1, -0.1, 1.36), (0.16, 0.1, 1.74), 0.012,
        (Bone.CHEST, Bone.NECK, Bone.HEAD),
    )  # fmt: skip


def _hair(head: Shape) -> list[Part]:
    """Return short hair: thicker on top, above a line from the forehead behind the ears."""
    top = grown(head, 0.008)
    crown = ellipsoid((HEAD_X_M - 0.010, 0.0, EYE_M + 0.058), (0.113, 0.089, 0.080))
    full = union(top, crown, blend_m=0.03)
    # Above the forehead, rising to the front; behind the temples, down to the nape.
    above = half_space((0.20, 0.0, -1.0), 0.20 * 0.12 - (EYE_M + 0.058))
    behind = half_space((1.0, 0.0, -0.45), HEAD_X_M - 0.012 - 0.45 * EYE_M)
    nape = half_space((0.25, 0.0, -1.0), 0.25 * HEAD_X_M - (EYE_M - 0.070))
    region = common(union(above, behind, blend_m=0.02), nape, blend_m=0.02)
    shape = common(full, region, blend_m=0.014)
    return [Part("hair", shape, (-0.13, -0.12, 1.50), (0.17, 0.12, 1.78), 0.011, (Bone.HEAD,))]


def _hands() -> list[Part]:
    at, palms, found = _origins(), rest_palm(), list[Part]()
    places, _ = fingers(np.broadcast_to(REST, (2, *REST.shape)))
    for side in (0, 1):
        wrist = at[arm_rows(Bone.HAND)[side]]

        world = partial(_placed, wrist, palms[side])
        mirror = np.array([1.0, -1.0, 1.0]) if side == 0 else np.ones(3)
        shapes = _palm_shapes(world, mirror)
        for finger, thick in enumerate((0.0125, 0.0098, 0.0102, 0.0096, 0.0085)):
            joints = [world(place) for place in places[side, finger]]
            chain = [
                cone(a, b, radii=(thick * (1 - 0.06 * k), thick * (0.94 - 0.06 * k)))
                for k, (a, b) in enumerate(pairwise(joints))
            ]
            shapes.append(union(*chain, blend_m=0.004))
        rows = tuple(Bone.FINGERS + 15 * side + k for k in range(15))
        bones = (arm_rows(Bone.FOREARM)[side], arm_rows(Bone.HAND)[side], *rows)
        tips = np.array([world(place) for place in places[side].reshape(-1, 3)])
        ends = np.concatenate([tips, [wrist]])
        low, high = ends.min(axis=0) - 0.04, ends.max(axis=0) + 0.04
        shape = union(*shapes, blend_m=0.010)
        found.append(Part("skin", shape, tuple(low), tuple(high), 0.0066, bones))
    return found


def _placed(wrist: Array, palm: Array, *points: Array) -> Array:
    """Return the place of a point of a palm, metres."""
    return wrist + palm @ points[0]


def _palm_shapes(world: Callable[[Array], Array], mirror: Array) -> list[Shape]:
    """Return a palm and the ball of the thumb."""
    shapes: list[Shape] = [
        cone(
            world(np.array([-0.03, 0.0, 0.0])), world(np.array([0.015, 0, 0])), radii=(0.025, 0.024)
        )
    ]
    for knuckle in KNUCKLES[1:]:
        start = world(np.array([0.018, 0.45 * knuckle[1], 0.0]) * mirror)
        shapes.append(cone(start, world(knuckle * mirror), radii=(0.0165, 0.0125)))
    ball = world(KNUCKLES[0] * mirror)
    end = world((KNUCKLES[0] + 0.6 * PHALANGES_M[0, 0] * np.array([0.72, 0.62, -0.32])) * mirror)
    shapes.append(cone(ball, end, radii=(0.0175, 0.0135)))
    return [union(*shapes, blend_m=0.016)]


def _face(head: Shape) -> list[Part]:
    """Return eyes, brows and a slight smile that lie on the head."""
    found: list[Part] = []

    for side in SIDES:
        eye = _on_face(head, side * 0.032, z=EYE_M)
        found.append(
            _small(
                "white",
                ellipsoid(eye - (0.004, 0, 0), (0.0085, 0.0165, 0.0140)),
                points=eye[None],
                step_m=0.005,
            )
        )
        found.append(
            _small(
                "iris",
                ellipsoid(eye - (-0.0015, 0, 0), (0.0056, 0.0092, 0.0105)),
                points=eye[None],
                step_m=0.0035,
            )
        )
        glint = eye - (-0.0063, -0.0028, -0.0038)
        found.append(
            _small(
                "white",
                ellipsoid(glint, (0.0018, 0.0025, 0.0025)),
                points=glint[None],
                step_m=0.0016,
            )
        )
        brow = [(0.017, 0.0270), (0.032, 0.0315), (0.047, 0.0265)]
        found.append(_stroke(head, [(side * y, z) for y, z in brow], dye="brows", radius_m=0.0042))
    smile = [
        (-0.030, -0.0600),
        (-0.020, -0.0675),
        (0.0, -0.0705),
        (0.020, -0.0675),
        (0.030, -0.0600),
    ]
    found.append(_stroke(head, smile, dye="lips", radius_m=0.0040))
    return found


def _stroke(head: Shape, path: list[tuple[float, float]], *, dye: str, radius_m: float) -> Part:
    points = np.array([_on_face(head, y, z=EYE_M + z) for y, z in path])
    points[:, 0] += 0.001
    pieces = [cone(a, b, radii=(radius_m, radius_m)) for a, b in pairwise(points)]
    return _small(dye, union(*pieces, blend_m=radius_m), points=points, step_m=radius_m)


def _on_face(head: Shape, y: float, *, z: float) -> Array:
    """Return (3,) the point of the head's front at a height and to a side."""
    inside, outside = HEAD_X_M, HEAD_X_M + 0.16
    for _ in range(24):
        middle = 0.5 * (inside + outside)
        if float(head(np.array([middle, y, z]))) < 0.0:
            inside = middle
        else:
            outside = middle
    return np.array([inside, y, z])


def _both(bone: int) -> tuple[int, ...]:
    rows = leg_rows(bone) if bone >= Bone.THIGH else arm_rows(bone)
    return tuple(rows)


def _small(dye: str, shape: Shape, *, points: Array, step_m: float) -> Part:
    """Return a part of the head around some points."""
    low, high = points.min(axis=0) - 0.018, points.max(axis=0) + 0.018
    return Part(dye, shape, tuple(low), tuple(high), step_m, (Bone.HEAD,))
