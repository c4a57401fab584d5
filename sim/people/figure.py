"""A clothed person of turned shapes: meshes of the limbs that `sim.people.posture` places."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scenes.mesh import TexturedMesh
from sim.bodies import Body, BodyPart
from sim.people.posture import (
    FOREARM_M,
    PART_NAMES,
    SHIN_M,
    THIGH_M,
    UPPER_ARM_M,
)

Ring = tuple[float, float, float, float]
"""Height z, half width along x (forward), half width along y (sideways), shift along x; metres."""

SEGMENTS = 20
TEXTURE_PX = 128
SKINS = ((226, 178, 150), (198, 146, 112), (141, 94, 66), (240, 200, 176))
SHIRTS = ((62, 92, 128), (150, 62, 58), (70, 112, 84), (196, 176, 128), (104, 84, 128))
TROUSERS = ((52, 62, 88), (92, 84, 72), (58, 58, 62))
HAIRS = ((46, 34, 26), (96, 68, 40), (28, 26, 26), (150, 116, 70))

TORSO: tuple[Ring, ...] = (
    (-0.05, 0.090, 0.130, 0.0), (0.03, 0.110, 0.150, 0.0), (0.12, 0.104, 0.146, 0.0),
    (0.24, 0.112, 0.160, 0.004), (0.34, 0.118, 0.178, 0.006), (0.42, 0.108, 0.188, 0.0),
    (0.47, 0.086, 0.160, -0.006), (0.495, 0.062, 0.090, -0.010), (0.51, 0.052, 0.058, -0.010),
)  # fmt: skip
PELVIS: tuple[Ring, ...] = (
    (-0.14, 0.060, 0.095, 0.0), (-0.08, 0.104, 0.158, 0.0), (-0.01, 0.112, 0.162, 0.0),
    (0.05, 0.108, 0.152, 0.0),
)  # fmt: skip
HEAD: tuple[Ring, ...] = (
    (-0.06, 0.050, 0.052, -0.012), (0.0, 0.051, 0.052, -0.008), (0.035, 0.056, 0.052, 0.0),
    (0.055, 0.076, 0.056, 0.016), (0.085, 0.090, 0.066, 0.014), (0.13, 0.098, 0.074, 0.006),
    (0.18, 0.100, 0.078, 0.0), (0.225, 0.092, 0.072, -0.004), (0.26, 0.066, 0.052, -0.008),
    (0.275, 0.030, 0.024, -0.008),
)  # fmt: skip
SHOE: tuple[Ring, ...] = (
    (-0.075, 0.128, 0.046, 0.055), (-0.055, 0.134, 0.050, 0.055), (-0.03, 0.112, 0.046, 0.040),
    (-0.005, 0.068, 0.042, 0.004), (0.03, 0.050, 0.044, 0.0),
)  # fmt: skip
HAND: tuple[Ring, ...] = (
    (-0.155, 0.016, 0.012, 0.010), (-0.125, 0.032, 0.015, 0.008), (-0.07, 0.041, 0.018, 0.0),
    (-0.02, 0.034, 0.020, 0.0), (0.01, 0.026, 0.024, 0.0),
)  # fmt: skip


def person_body(body_id: str, rng: np.random.Generator) -> Body:
    """A person whose skin, hair and clothes are drawn from `rng`; parts as in `PART_NAMES`."""
    skin, shirt, trousers, hair = (
        np.array(choices[int(rng.integers(len(choices)))], dtype=np.float64)
        for choices in (SKINS, SHIRTS, TROUSERS, HAIRS)
    )
    cloth = _checked(shirt, rng)
    sleeve = _checked(shirt, rng)
    denim = _woven(trousers, rng)
    bare = _woven(skin, rng, contrast=0.03)
    leather = _woven(np.array([58.0, 44.0, 36.0]), rng)
    shapes = {
        "pelvis": (PELVIS, denim),
        "torso": (TORSO, cloth),
        "head": (HEAD, _face(skin, hair, rng)),
        "upper-arm": (_limb(UPPER_ARM_M, (0.047, 0.054, 0.048, 0.043)), sleeve),
        "forearm": (_limb(FOREARM_M, (0.044, 0.046, 0.038, 0.031)), sleeve),
        "hand": (HAND, bare),
        "thigh": (_limb(THIGH_M, (0.080, 0.084, 0.070, 0.057)), denim),
        "shin": (_limb(SHIN_M, (0.056, 0.060, 0.052, 0.050)), denim),
        "shoe": (SHOE, leather),
    }
    parts: list[BodyPart] = []
    for name in PART_NAMES:
        rings, texture = shapes[name.removeprefix("left-").removeprefix("right-")]
        parts.append(BodyPart((_turned(rings, texture),), (_hull(rings),)))
    return Body(body_id, tuple(parts))


def _limb(length: float, radii: tuple[float, float, float, float]) -> tuple[Ring, ...]:
    """Rings of a limb along -z with rounded ends, thickest a third of the way down."""
    top, thick, low, end = radii
    stations = [
        (-length - 0.75 * end, 0.45 * end), (-length - 0.45 * end, 0.85 * end), (-length, end),
        (-0.7 * length, low), (-0.3 * length, thick), (0.0, top),
        (0.45 * top, 0.88 * top), (0.75 * top, 0.5 * top),
    ]  # fmt: skip
    return tuple((z, r, r, 0.0) for z, r in stations)


def _turned(rings: Sequence[Ring], texture: NDArray[np.uint8]) -> TexturedMesh:
    """A closed elliptic solid of revolution; u runs around from the back, v upwards."""
    turn = np.linspace(-np.pi, np.pi, SEGMENTS + 1)
    table = np.asarray(rings)
    low, high = table[0, 0], table[-1, 0]
    vertices: list[NDArray[np.float64]] = []
    uv: list[NDArray[np.float64]] = []
    for z, along, across, shift in table:
        vertices.append(
            np.stack(
                [shift + along * np.cos(turn), across * np.sin(turn), np.full_like(turn, z)], axis=1
            )
        )
        uv.append(np.stack([turn / (2 * np.pi) + 0.5, np.full_like(turn, z)], axis=1))
    for z, _, _, shift in (table[0], table[-1]):
        vertices.append(np.array([[shift, 0.0, z]]))
        uv.append(np.array([[0.5, z]]))
    coordinates = np.concatenate(uv)
    coordinates[:, 1] = (coordinates[:, 1] - low) / (high - low)
    return TexturedMesh(
        np.concatenate(vertices),
        _faces(len(table)),
        coordinates.astype(np.float32),
        texture,
    )


def _faces(ring_count: int) -> NDArray[np.int32]:
    width = SEGMENTS + 1
    faces: list[NDArray[np.int_]] = []
    for ring in range(ring_count - 1):
        a = ring * width + np.arange(SEGMENTS)
        faces.append(np.stack([a, a + 1, a + width + 1], axis=1))
        faces.append(np.stack([a, a + width + 1, a + width], axis=1))
    k = np.arange(SEGMENTS)
    bottom, top = ring_count * width, ring_count * width + 1
    last = (ring_count - 1) * width
    faces.append(np.stack([k + 1, k, np.full(SEGMENTS, bottom)], axis=1))
    faces.append(np.stack([last + k, last + k + 1, np.full(SEGMENTS, top)], axis=1))
    return np.concatenate(faces).astype(np.int32)


def _hull(rings: Sequence[Ring]) -> NDArray[np.float64]:
    """Points whose convex hull stands in for the part when it casts a shadow."""
    turn = np.linspace(0.0, 2 * np.pi, 8, endpoint=False)
    table = np.asarray(rings)
    picked = table[[0, len(table) // 2, -1]]
    return np.concatenate(
        [
            np.stack([x0 + a * np.cos(turn), b * np.sin(turn), np.full_like(turn, z)], axis=1)
            for z, a, b, x0 in picked
        ]
    )


def _woven(
    colour: NDArray[np.float64], rng: np.random.Generator, contrast: float = 0.10
) -> NDArray[np.uint8]:
    """Cloth of one colour: folds (slow) and threads (fast)."""
    slow = rng.standard_normal((9, 9))
    rows = np.linspace(0.0, 7.999, TEXTURE_PX)
    i, f = rows.astype(int), rows % 1.0
    across = slow[i] * (1 - f)[:, None] + slow[i + 1] * f[:, None]
    folds = across[:, i] * (1 - f) + across[:, i + 1] * f
    threads = rng.standard_normal((TEXTURE_PX, TEXTURE_PX))
    shade = 1.0 + contrast * (0.6 * folds + 0.45 * threads)
    return _to_bytes(colour * shade[..., None])


def _checked(colour: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.uint8]:
    """A checked shirt."""
    base = _woven(colour, rng).astype(np.float64)
    step = np.arange(TEXTURE_PX)
    dark = np.where(step % 16 < 3, 0.72, 1.0)
    light = np.where((step + 8) % 32 < 2, 1.28, 1.0)
    return _to_bytes(base * (dark * light)[:, None, None] * (dark * light)[None, :, None])


def _face(
    skin: NDArray[np.float64], hair: NDArray[np.float64], rng: np.random.Generator
) -> NDArray[np.uint8]:
    """A head's texture: hair at the back and on top, eyes, brows, nose and mouth in front."""
    picture = _woven(skin, rng, contrast=0.03).astype(np.float64)
    v = 1.0 - (np.arange(TEXTURE_PX) + 0.5)[:, None] / TEXTURE_PX
    u = ((np.arange(TEXTURE_PX) + 0.5) / TEXTURE_PX - 0.5)[None, :]
    fringe = 0.80 - 0.06 * np.cos(u * 40.0)
    hairy = (v > fringe) | ((np.abs(u) > 0.27) & (v > 0.36)) | ((np.abs(u) > 0.21) & (v > 0.60))
    strands = 1.0 + 0.18 * rng.standard_normal((1, TEXTURE_PX)) + 0 * v
    picture = np.where(hairy[..., None], hair * strands[..., None], picture)
    for side in (-1.0, 1.0):
        eye = np.hypot((u - side * 0.065) / 0.026, (v - 0.575) / 0.017)
        picture[eye < 1.0] = (236, 232, 226)
        picture[np.hypot((u - side * 0.065) / 0.011, (v - 0.575) / 0.016) < 1.0] = (42, 34, 30)
        brow = (np.abs(u - side * 0.068) < 0.034) & (np.abs(v - 0.625) < 0.009)
        picture[brow] = 0.8 * hair
    picture[(np.abs(u) < 0.02) & (v > 0.44) & (v < 0.55)] *= 0.9
    mouth = (np.abs(u) < 0.045) & (np.abs(v - 0.385) < 0.010)
    picture[mouth] = skin * (0.78, 0.55, 0.55)
    return _to_bytes(picture)


def _to_bytes(picture: NDArray[np.float64]) -> NDArray[np.uint8]:
    return np.clip(np.round(picture), 0, 255).astype(np.uint8)
