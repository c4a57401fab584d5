"""The figure of people for browsers: its mesh in a file, and the numbers its solver works with.

Browsers solve bodies themselves (`shared/bodies/`): solved joints would be as many bytes again for
every body and everybody, and a viewer without a program has nobody who solves them. The numbers and
the mesh come from `scenes/bodies`, so that both draw the same person.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from functools import cache
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenes.bodies import arms, bones, figure, goals, hands, legs, skeleton, solids, solve, torso
from scenes.bodies.figure import MAX_BONES, Figure, rest_figure
from scenes.bodies.skeleton import Bone, Range, rest_arm

CONSTANTS = "shared/bodies/constants.js"
"""Name of the module with the solver's numbers."""

MODULES: tuple[ModuleType, ...] = (
    skeleton, solids, hands, torso, legs, arms, goals, bones, figure, solve,
)  # fmt: skip
"""Modules of `scenes/bodies` whose constants the solver shares."""

COARSER = 2.0
"""Grid of the coarse figure over the fine one's, chosen by eye: a quarter of the triangles, for
people who are further away than `NEAR_M` of `shared/bodies/figure.js`."""

STEPS = 16_383
"""Steps of a coordinate over the figure's size: 0.1 mm of its height."""

WEIGHT_STEPS, NORMAL_STEPS = 255, 127
"""Steps of a share of a bone, and of a normal's component."""


@cache
def constants_module() -> bytes:
    """Return the source of the module with the constants of `scenes/bodies`, by their names."""
    along, hinge, _ = rest_arm()
    found: dict[str, Any] = {
        "BONE": {bone.name: int(bone) for bone in Bone},
        "REST_ORIGINS": bones.rest_skeleton().origins[0].tolist(),
        "REST_ALONG": along.tolist(),
        "REST_HINGE": hinge.tolist(),
        # Rotations are lists of columns there.
        "REST_PALM": np.swapaxes(hands.rest_palm(), -1, -2).tolist(),
    }
    for module in MODULES:
        found |= dict(_numbers_of(module))
    lines = [f"export const {name} = {json.dumps(value)};" for name, value in found.items()]
    return "\n".join(
        ["// Numbers of `scenes/bodies`, as the program has them.", *lines, ""]
    ).encode()


def _numbers_of(module: ModuleType) -> Iterator[tuple[str, Any]]:
    for name, value in vars(module).items():
        if name.isupper() and not name.startswith("_") and len(name) > 1:
            plain = _plain(value)
            if plain is not None:
                yield name, plain


def _plain(value: Any) -> Any:
    """Return numbers as JSON has them; None of what is none."""
    if isinstance(value, Range):
        return [value.low, value.high]
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, bool | int | float | str):
        return int(value) if isinstance(value, Bone) else value
    if isinstance(value, tuple):
        parts = [_plain(each) for each in value]
        return None if None in parts else parts
    if isinstance(value, dict):
        parts = {str(key): _plain(each) for key, each in value.items()}
        return None if None in parts.values() else parts
    return None


@cache
def figure_file() -> bytes:
    """Return the fine and the coarse figure: a line of JSON, then little-endian arrays.

    The line says of each figure where its arrays begin behind the line, their types and lengths.
    Coordinates are `low + (high - low) * value / steps`; of places and faces, each row holds how
    much more it is than the one before, modulo 65,536: near ones are alike, and pack.
    """
    blocks, heads, at = list[bytes](), list[dict[str, Any]](), 0
    for made in (rest_figure(), rest_figure(COARSER)):
        head, arrays = _packed(made)
        for name, array in arrays.items():
            data = array.tobytes()
            head["arrays"][name] = [at, array.dtype.kind + str(array.itemsize), array.size]
            pad = -len(data) % 4
            blocks.append(data + bytes(pad))
            at += len(data) + pad
        heads.append(head)
    line = json.dumps({"figures": heads}, separators=(",", ":")).encode()
    line += b" " * (-(len(line) + 1) % 4) + b"\n"
    return line + b"".join(blocks)


def _packed(made: Figure) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Return what is said of a figure, and its arrays."""
    places, normals, rows, shares = _skinned(made)
    order = _along_faces(made.faces, len(places))
    new = np.empty(len(order), np.int64)
    new[order] = np.arange(len(order))
    faces = new[made.faces]
    low, high = places.min(axis=0), places.max(axis=0)
    steps = np.round((places - low) / (high - low) * STEPS)
    head = {
        "steps": STEPS,
        "low": low.tolist(),
        "high": high.tolist(),
        "dyes": list(made.dye_names),
        "arrays": {},
    }
    arrays: dict[str, NDArray[Any]] = {
        "places": _growth(steps[order]),
        "normals": np.round(NORMAL_STEPS * normals[order]).astype(np.int8),
        "bones": rows[order].astype(np.uint8),
        "shares": shares[order].astype(np.uint8),
        "dyes": made.dyes[order].astype(np.uint8),
        "faces": _growth(faces.reshape(-1, 1)),
    }
    return head, arrays


def _growth(rows: NDArray[Any]) -> NDArray[np.uint16]:
    """Return how much more each row is than the one before, modulo 65,536."""
    return np.diff(rows.astype(np.int64), axis=0, prepend=0).astype("<u2")


def _skinned(made: Figure) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Return vertices and normals at rest, and of each `MAX_BONES` bones and their shares."""
    count = len(made.dyes)
    skin: Any = made.skin
    dense = skin.toarray().reshape(count, -1, 4)
    weights = dense[..., 3]
    rows = np.argsort(-weights, axis=1, kind="stable")[:, :MAX_BONES]
    picked = np.take_along_axis(weights, rows, axis=1)
    # A bone of no share is the first one's again: fewer kinds of bytes to pack.
    rows = np.where(picked > 0.0, rows, rows[:, :1])
    shares = np.round(WEIGHT_STEPS * picked / picked.sum(axis=1, keepdims=True))
    shares[:, 0] += WEIGHT_STEPS - shares.sum(axis=1)
    origins = bones.rest_skeleton().origins[0]
    places = dense[..., :3].sum(axis=1) + weights @ origins
    skin_normals: Any = made.skin_normals
    normals = skin_normals.toarray().reshape(count, -1, 3).sum(axis=1)
    return places, normals, rows, shares


def _along_faces(faces: NDArray[np.int32], count: int) -> NDArray[np.int64]:
    """Return vertices as faces first name them: near ones are alike, and pack."""
    _, first = np.unique(faces.ravel(), return_index=True)
    used = faces.ravel()[np.sort(first)].astype(np.int64)
    rest = np.setdiff1d(np.arange(count), used)
    return np.concatenate([used, rest])
