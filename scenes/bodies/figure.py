"""Figure of a person: one mesh of all parts at rest, and its skin moved by a skeleton."""

from __future__ import annotations

import colorsys
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix  # pyright: ignore[reportMissingTypeStubs]

from scenes.bodies.bones import rest_skeleton
from scenes.bodies.implicit import surface
from scenes.bodies.skeleton import (
    ARM_BONES,
    BONES,
    FINGER_BONES,
    LEG_BONES,
    Bone,
    Skeleton,
    arm_rows,
)
from scenes.bodies.vectors import Array
from scenes.bodies.wardrobe import Part, parts

Colour = tuple[float, float, float]

BLEND_M = 0.022
"""Width over which skin goes from one bone to the next, metres; a fifth of it in a hand."""

MAX_BONES = 4
"""Bones that move a point of the skin, at most."""

THICKNESS_M = {
    Bone.PELVIS: 0.13, Bone.SPINE: 0.13, Bone.CHEST: 0.13, Bone.NECK: 0.05, Bone.HEAD: 0.09,
    Bone.CLAVICLE: 0.06, Bone.UPPER_ARM: 0.055, Bone.FOREARM: 0.042, Bone.HAND: 0.02,
    Bone.THIGH: 0.085, Bone.SHIN: 0.06, Bone.FOOT: 0.05,
}  # fmt: skip
"""Radius of the body around each bone, metres."""

SKINS: tuple[Colour, ...] = (
    (0.93, 0.76, 0.65), (0.80, 0.60, 0.46), (0.56, 0.38, 0.27), (0.96, 0.82, 0.72),
)  # fmt: skip
HAIRS: tuple[Colour, ...] = (
    (0.20, 0.15, 0.12), (0.38, 0.26, 0.17), (0.12, 0.11, 0.12), (0.60, 0.46, 0.30),
    (0.45, 0.44, 0.45),
)  # fmt: skip
TROUSERS: tuple[Colour, ...] = ((0.20, 0.24, 0.33), (0.30, 0.28, 0.27), (0.24, 0.25, 0.27))
"""Colours that people are given by their names, sRGB."""

WORN: Mapping[str, Colour] = {
    "shoes": (0.90, 0.90, 0.88), "white": (0.97, 0.97, 0.96), "iris": (0.16, 0.12, 0.10),
}  # fmt: skip
"""Colours that everybody has, sRGB."""

BROWS, LIPS = (0.8, 0.8, 0.8), (0.72, 0.52, 0.52)
"""Of brows over the hair's colour, of lips over the skin's."""

HUES = 7
"""Tints of a role's colour that people get by their names."""

HUE_ORDER = 3
"""Steps between the tints of two people who are numbered one after the other: far apart."""

HUE_STEP, SHADE_STEP = 0.045, 0.10
"""Between two of these tints, of the colour circle's whole turn; and of lightness."""


@dataclass(frozen=True, slots=True, eq=False)
class Figure:
    """The mesh of the reference person at rest.

    Attributes:
        faces: (F, 3) int32, counter-clockwise from outside.
        dyes: (V,) index into `dye_names` of each vertex.
        dye_names: such as "top", "skin".
        is_arm: (F,) whether a face is of an arm below the shoulder or of a hand.
        skin: (V, 4 BONES) sparse: rows times bones' rotations and origins give places.
        skin_normals: (V, 3 BONES) sparse, the same for normals.
    """

    faces: NDArray[np.int32]
    dyes: NDArray[np.int64]
    dye_names: tuple[str, ...]
    is_arm: NDArray[np.bool_]
    skin: csr_matrix
    skin_normals: csr_matrix


@cache
def rest_figure(coarser: float = 1.0) -> Figure:
    """Return the figure, made once: it takes some tenths of a second.

    Args:
        coarser: size of its triangles over the usual one's, for figures that are seen small.
    """
    made = parts()
    names = tuple(dict.fromkeys(part.dye for part in made))
    vertices, normals, weights = list[Array](), list[Array](), list[Array]()
    faces, dyes = list[NDArray[np.int32]](), list[NDArray[np.int64]]()
    count = 0
    for part in made:
        step_m = part.step_m * coarser
        places, triangles, out = surface(part.shape, part.low, high=part.high, step_m=step_m)
        vertices.append(places)
        normals.append(out)
        weights.append(_weights(part, places))
        faces.append(triangles + count)
        dyes.append(np.full(len(places), names.index(part.dye)))
        count += len(places)
    weight, face = np.concatenate(weights), np.concatenate(faces).astype(np.int32)
    arms = [row for bone in (Bone.FOREARM, Bone.HAND) for row in arm_rows(bone)]
    of_arm = weight[:, [*arms, *range(Bone.FINGERS, BONES)]].sum(axis=1) > 0.5
    return Figure(
        face,
        np.concatenate(dyes),
        names,
        of_arm[face].all(axis=1),
        *_skins(np.concatenate(vertices), np.concatenate(normals), weights=weight),
    )


def posed(
    figure: Figure, skeleton: Skeleton, *, row: int = 0
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return vertices and normals (V, 3) float32 of one person, world metres.

    Args:
        figure: at rest.
        skeleton: of people.
        row: whose.
    """
    rotations = np.swapaxes(skeleton.rotations[row], -1, -2)
    sized = skeleton.scales[row] * rotations
    matrix = np.concatenate([sized, skeleton.origins[row][:, None]], axis=1).reshape(-1, 3)
    skin: Any = figure.skin
    places = skin @ matrix.astype(np.float32)
    skin_normals: Any = figure.skin_normals
    normals = skin_normals @ rotations.reshape(-1, 3).astype(np.float32)
    return places, normals


def colours_of(figure: Figure, *, name: str, top: Colour) -> NDArray[np.uint8]:
    """Return (V, 3) sRGB of a person: clothes of the given colour, the rest by the name.

    Args:
        figure: whose vertices.
        name: the same one has the same colours every time.
        top: colour of the jumper.
    """
    seed = _number_of(name)
    skin = SKINS[seed % len(SKINS)]
    hair = HAIRS[(seed + 1) * 3 % len(HAIRS)]
    dye = {
        "top": top,
        "skin": skin,
        "hair": hair,
        "trousers": TROUSERS[seed % len(TROUSERS)],
        "brows": tuple(a * b for a, b in zip(BROWS, hair, strict=True)),
        "lips": tuple(a * b for a, b in zip(LIPS, skin, strict=True)),
        **WORN,
    }
    table = np.array([dye[each] for each in figure.dye_names])
    return np.round(255 * table).astype(np.uint8)[figure.dyes]


def tint(colour: Colour, name: str) -> Colour:
    """Return a colour near another one that is a person's own: two people differ, a role stays."""
    step = _number_of(name) * HUE_ORDER % HUES - HUES // 2
    hue, light, strong = colorsys.rgb_to_hls(*colour)
    light += SHADE_STEP * (1 if step % 2 else -1) * (step != 0)
    return colorsys.hls_to_rgb((hue + HUE_STEP * step) % 1.0, min(light, 0.62), 0.65 * strong)


def _number_of(name: str) -> int:
    """Return a number that is the name's own; names that are numbered differ by one."""
    base = name.rstrip("0123456789")
    return zlib.crc32(base.encode()) % 10_000 + int(name[len(base) :][-6:] or 0)


def _weights(part: Part, places: Array) -> Array:
    """Return (V, BONES) shares of bones in points of a part."""
    found = np.zeros((len(places), BONES))
    if len(part.bones) == 1:
        found[:, part.bones[0]] = 1.0
        return found
    width = BLEND_M if part.step_m > 0.007 else 0.2 * BLEND_M
    gaps = np.stack([_gap(bone, places) for bone in part.bones], axis=1)
    near = gaps - gaps.min(axis=1, keepdims=True)
    share = np.exp(-near / width)
    least = -np.sort(-share, axis=1)[:, min(MAX_BONES, share.shape[1]) - 1][:, None]
    share = np.where((share >= least) & (share > 0.02), share, 0.0)
    found[:, list(part.bones)] = share / share.sum(axis=1, keepdims=True)
    return found


def _gap(bone: int, places: Array) -> Array:
    """Return (V,) distance of points from the body around a bone, metres."""
    start, end, radius = _segment(bone)
    axis = end - start
    share = np.clip(((places - start) @ axis) / max(float(axis @ axis), 1e-9), 0.0, 1.0)
    off = places - start - share[:, None] * axis
    return np.maximum(np.sqrt((off * off).sum(axis=1)) - radius, 0.0) + 0.02 * np.sqrt(
        (off * off).sum(axis=1)
    )


def _segment(bone: int) -> tuple[Array, Array, float]:
    """Return both ends of a bone at rest, metres, and the radius of the body around it."""
    at = rest_skeleton().origins[0]
    if bone >= Bone.FINGERS:
        first = Bone.FINGERS + (bone - Bone.FINGERS) // 3 * 3
        end = at[bone + 1] if bone < first + 2 else 2 * at[bone] - at[bone - 1]
        return at[bone], end, 0.009
    if bone < Bone.CLAVICLE:
        ends = {
            Bone.PELVIS: at[bone] - (0, 0, 0.06),
            Bone.SPINE: at[Bone.CHEST],
            Bone.CHEST: at[Bone.NECK] - (0, 0, 0.10),
            Bone.NECK: at[Bone.HEAD],
            Bone.HEAD: at[bone] + (0.0, 0, 0.12),
        }
        return at[bone], np.asarray(ends[Bone(bone)]), THICKNESS_M[Bone(bone)]
    arm = bone < Bone.THIGH
    first, many = (Bone.CLAVICLE, ARM_BONES) if arm else (Bone.THIGH, LEG_BONES)
    kind = Bone(first + (bone - first) % many)
    if kind == Bone.FOOT:
        return at[bone], at[bone] + (0.12, 0, -0.03), THICKNESS_M[kind]
    if kind == Bone.HAND:
        finger = Bone.FINGERS + FINGER_BONES * (bone > Bone.HAND) + 6
        return at[bone], at[finger], THICKNESS_M[kind]
    return at[bone], at[bone + 1], THICKNESS_M[kind]


def _skins(places: Array, normals: Array, *, weights: Array) -> tuple[csr_matrix, csr_matrix]:
    """Return what `Figure` says of `skin` and `skin_normals`."""
    local = places[:, None] - rest_skeleton().origins[0]
    ones = np.ones((len(places), BONES, 1))
    wide = np.concatenate([local, ones], axis=2) * weights[..., None]
    turned = normals[:, None] * weights[..., None]
    flat = (each.reshape(len(places), -1).astype(np.float32) for each in (wide, turned))
    first, second = (csr_matrix(each) for each in flat)
    return first, second
