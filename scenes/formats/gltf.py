# pyright: standard
"""Splats in binary glTF: the extension KHR_gaussian_splatting, in and out.

Stored per splat, tightly packed one attribute after the other: position, rotation (x, y, z, w),
linear scale, linear opacity, and each coefficient of the spherical harmonics by its degree l and
number n; beside them COLOR_0, which programs without the extension draw as points. All but COLOR_0
are float32, so that clouds come back bit by bit.

The file's axes are x right, y up, z back; clouds come out, and go in, with x right, y down,
z forward as in PLY files (`scenes.formats.storage.axes`).

Source: KHR_gaussian_splatting, "Complete, Ratified by the Khronos Group".
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenes.formats.containers.glb import (
    FLOAT,
    MAX_BYTES,
    UNSIGNED_BYTE,
    Accessor,
    Glb,
    accessor,
    glb_start,
    item,
    packed_views,
    read_glb,
)
from scenes.formats.containers.gltf_nodes import Placement, placements
from scenes.formats.storage.activation import cloud_from_file, damaged_values_are_quiet
from scenes.formats.storage.atomic import write_file
from scenes.formats.storage.axes import flipped
from scenes.formats.storage.bad_rows import intact, without_bad_rows
from scenes.formats.storage.blocks import ROWS_PER_BLOCK, SplatBlocks, extents, in_blocks
from scenes.formats.storage.error import refusal
from scenes.formats.storage.spool import contents, spools
from scenes.harmonics import turned
from scenes.splats import SH_COUNTS, SplatCloud

EXTENSION = "KHR_gaussian_splatting"
KERNEL = "ellipse"
COLOUR_SPACE = "srgb_rec709_display"
POINTS = 0
MAX_START_BYTES = 2**16

_ROTATION, _SCALE, _OPACITY = (f"{EXTENSION}:{n}" for n in ("ROTATION", "SCALE", "OPACITY"))
_HARMONICS = tuple(
    f"{EXTENSION}:SH_DEGREE_{degree}_COEF_{n}"
    for degree in range(len(SH_COUNTS))
    for n in range(2 * degree + 1)
)


@dataclass(frozen=True, slots=True)
class _Splats:
    """One primitive of a file and where it is placed."""

    attributes: dict[str, Accessor]
    k: int
    placement: Placement

    @property
    def count(self) -> int:
        return self.attributes["POSITION"].count


def read_gltf(path: Path) -> SplatCloud:
    """Read all splats of the default scene of a `.glb`; axes x right, y down, z forward, metres.

    Nodes may move, turn and evenly scale them. Attributes may be floats or, but for positions,
    normalised integers. Splats of lower degree than others are padded with zeros.

    Raises:
        FormatError: the file is truncated, damaged, holds no splats, or asks for an extension, a
            kernel or a colour space that is not supported.
        OSError: the file cannot be read.
    """
    return intact(path, read_gltf_blocks(path))


def read_gltf_blocks(path: Path, rows: int = ROWS_PER_BLOCK) -> SplatBlocks:
    """As `read_gltf`, `rows` splats at a time; bad values are found when their block is read."""
    glb = read_glb(path)
    _require_known_extensions(glb)
    found = [
        _splats(glb, primitive, placement)
        for placement in placements(glb)
        for primitive in _primitives(glb, placement)
    ]
    count = sum(splats.count for splats in found)
    position_bytes = 12 * count
    if not count or position_bytes > glb.size_bytes:
        raise refusal(
            path,
            "meshes",
            f"{count} splats in {glb.size_bytes} bytes of data, wanted at least 1, "
            "each with a position of its own",
            f"give a file with {EXTENSION}, each mesh placed once",
        )
    k = max(splats.k for splats in found)
    blocks = _read(path, found, k, rows)
    return without_bad_rows(path, SplatBlocks(count, SH_COUNTS.index(k), blocks))


def write_gltf(path: Path, cloud: SplatCloud) -> int:
    """Write a `.glb` with one mesh; atomic. The cloud's axes are x right, y down, z forward.

    Returns:
        The size of the file in bytes.

    Raises:
        FormatError: the cloud is empty or needs more than the 4 GiB that a GLB can have.
        WriteError: the disk is full or the folder is not writable; nothing is left behind.
    """
    return write_gltf_blocks(path, in_blocks(cloud))


def write_gltf_blocks(path: Path, splats: SplatBlocks) -> int:
    """As `write_gltf`, with one block in memory at a time and attributes set aside on disk."""
    size = splats.count * sum(width for _, _, width in _layout(splats.sh_degree))
    if not splats.count or size > MAX_BYTES - MAX_START_BYTES:
        raise refusal(
            path,
            "",
            f"{splats.count} splats need {size} bytes, a GLB has 1 splat or more and "
            f"{MAX_BYTES} bytes at most",
            "write a PLY instead",
        )
    return write_file(path, _pack(path, splats))


def _require_known_extensions(glb: Glb) -> None:
    required = glb.document.get("extensionsRequired", [])
    unknown = [name for name in required if name != EXTENSION] if isinstance(required, list) else []
    if unknown:
        raise refusal(
            glb.path,
            "extensionsRequired",
            f"needs {', '.join(map(str, unknown))[:80]}",
            f"export it uncompressed, with {EXTENSION} alone",
        )


def _primitives(glb: Glb, placement: Placement) -> Iterator[dict[str, Any]]:
    """Primitives of a placed mesh that the extension marks as splats."""
    primitives = item(glb, "meshes", placement.mesh).get("primitives")
    for primitive in primitives if isinstance(primitives, list) else []:
        extensions = primitive.get("extensions") if isinstance(primitive, dict) else None
        if isinstance(extensions, dict) and isinstance(extensions.get(EXTENSION), dict):
            yield primitive


def _splats(glb: Glb, primitive: dict[str, Any], placement: Placement) -> _Splats:
    where = f"mesh {placement.mesh}"
    properties, indices = primitive["extensions"][EXTENSION], primitive.get("attributes")
    kernel, colours = properties.get("kernel"), properties.get("colorSpace")
    if kernel is None and colours is None:
        raise refusal(
            glb.path,
            where,
            f"{EXTENSION} without kernel and colorSpace, as drafts of the extension had it",
            "export it with a newer version of its program, or as .ply or .spz",
        )
    if kernel != KERNEL or colours != COLOUR_SPACE or primitive.get("mode") != POINTS:
        raise refusal(
            glb.path,
            where,
            f"kernel {kernel!r:.40}, colorSpace {colours!r:.40}, mode {primitive.get('mode')!r:.9}",
            f"export it as POINTS with {KERNEL!r} and {COLOUR_SPACE!r}",
        )
    names = indices if isinstance(indices, dict) else {}
    present = [name in names for name in _HARMONICS]
    k = present.index(False) if False in present else len(present)
    missing = [n for n in ("POSITION", _ROTATION, _SCALE, _OPACITY) if n not in names]
    if missing or k not in SH_COUNTS or sum(present) != k:
        raise refusal(
            glb.path,
            where,
            f"no {', '.join(missing)}" if missing else f"{sum(present)} coefficients SH_DEGREE_*",
            "export it with all attributes and whole degrees 0 to 3",
        )
    kinds = {"POSITION": "VEC3", _ROTATION: "VEC4", _SCALE: "VEC3", _OPACITY: "SCALAR"}
    kinds |= dict.fromkeys(_HARMONICS[:k], "VEC3")
    found = {name: accessor(glb, names[name], name, kind) for name, kind in kinds.items()}
    counts = {entry.count for entry in found.values()}
    if len(counts) != 1 or found["POSITION"].dtype.kind != "f":
        raise refusal(
            glb.path,
            where,
            f"attributes of {sorted(counts)[:3]} splats, positions {found['POSITION'].dtype}",
            "wanted one number, and float positions; export it again",
        )
    return _Splats(found, k, placement)


def _read(path: Path, found: list[_Splats], k: int, rows: int) -> Iterator[SplatCloud]:
    first = 0
    with path.open("rb") as file:
        for splats in found:
            for start, stop in extents(splats.count, rows):
                values = {
                    name: entry.read(path, file, start, stop)
                    for name, entry in splats.attributes.items()
                }
                cloud = _decode(values, k, splats.placement.scale)
                yield flipped(_place(path, cloud, splats.placement))
            first += splats.count


@damaged_values_are_quiet
def _decode(values: dict[str, NDArray[np.float32]], k: int, scale: float) -> SplatCloud:
    """Splats in the axes of their node, scaled, padded to `k` coefficients."""
    n = len(values["POSITION"])
    sh = np.zeros((n, k, 3), dtype=np.float32)
    for i, name in enumerate(_HARMONICS):
        if name in values:
            sh[:, i] = values[name]
    return cloud_from_file(
        means=values["POSITION"] * np.float32(scale),
        scales=values[_SCALE] * np.float32(scale),
        quaternions=np.roll(values[_ROTATION], 1, axis=1),
        opacities=values[_OPACITY][:, 0],
        sh=sh,
    )


@damaged_values_are_quiet
def _place(path: Path, cloud: SplatCloud, placement: Placement) -> SplatCloud:
    """Splats that have been scaled, turned and moved to where their node is."""
    if placement.stays():
        return cloud
    placed = turned(cloud, placement.scene_from_node)
    if not np.isfinite(placed.means[np.isfinite(cloud.means).all(axis=1)]).all():
        raise refusal(
            path,
            f"mesh {placement.mesh}",
            "its node puts splats beyond the range of float32",
            "export it with the transform applied",
        )
    return placed


def _layout(degree: int) -> list[tuple[str, str, int]]:
    """Name, type and bytes a splat of each attribute, in the order of the file."""
    return [
        ("POSITION", "VEC3", 12),
        (_ROTATION, "VEC4", 16),
        (_SCALE, "VEC3", 12),
        (_OPACITY, "SCALAR", 4),
        *((name, "VEC3", 12) for name in _HARMONICS[: SH_COUNTS[degree]]),
        ("COLOR_0", "VEC4", 4),
    ]


def _pack(path: Path, splats: SplatBlocks) -> Iterator[bytes]:
    """The file in order, once all blocks have been taken apart and set aside."""
    layout = _layout(splats.sh_degree)
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    with spools(path, len(layout)) as columns:
        for cloud in map(flipped, splats.blocks):
            low = np.minimum(low, cloud.means.min(axis=0))
            high = np.maximum(high, cloud.means.max(axis=0))
            for column, values in zip(columns, _columns(cloud), strict=True):
                column.write(values.tobytes())
        document = _document(splats, low.tolist(), high.tolist())
        yield glb_start(document, splats.count * sum(width for _, _, width in layout))
        for column in columns:
            yield from contents(column)


def _columns(cloud: SplatCloud) -> list[NDArray[Any]]:
    stored = [
        cloud.means,
        np.roll(cloud.rotations, -1, axis=1),
        cloud.scales,
        cloud.opacities,
        *cloud.sh.swapaxes(0, 1),
    ]
    return [*(values.astype("<f4") for values in stored), _fallback_colours(cloud)]


def _fallback_colours(cloud: SplatCloud) -> NDArray[np.uint8]:
    """(N, 4) RGBA; glTF's vertex colours are linear light (IEC 61966-2-1 the other way round)."""
    shown = np.clip(cloud.colours().astype(np.float64), 0.0, 1.0)
    linear = np.where(shown <= 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4)
    rgba = np.concatenate([linear, cloud.opacities[:, None]], axis=1)
    return np.rint(255.0 * rgba).astype(np.uint8)


def _document(splats: SplatBlocks, low: list[float], high: list[float]) -> dict[str, Any]:
    layout = _layout(splats.sh_degree)
    accessors = [
        {"bufferView": i, "componentType": FLOAT, "count": splats.count, "type": kind}
        for i, (_, kind, _) in enumerate(layout)
    ]
    accessors[0] |= {"min": low, "max": high}
    accessors[-1] |= {"componentType": UNSIGNED_BYTE, "normalized": True}
    sizes = [splats.count * width for _, _, width in layout]
    return {
        "asset": {"version": "2.0", "generator": "GaussianNexus Studio"},
        "extensionsUsed": [EXTENSION],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": "splats"}],
        "meshes": [
            {
                "primitives": [
                    {
                        "mode": POINTS,
                        "attributes": {name: i for i, (name, _, _) in enumerate(layout)},
                        "extensions": {EXTENSION: {"kernel": KERNEL, "colorSpace": COLOUR_SPACE}},
                    }
                ]
            }
        ],
        "buffers": [{"byteLength": sum(sizes)}],
        "bufferViews": list(packed_views(sizes)),
        "accessors": accessors,
    }
