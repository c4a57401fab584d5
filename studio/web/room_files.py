"""A room as files for the live page: thinned first, then whole, each object, and a manifest."""

from __future__ import annotations

import hashlib
import json
import threading
from pathlib import Path
from typing import Any

import numpy as np

from scenes.bodies.solids import Solids
from scenes.formats.storage.atomic import write_whole
from scenes.frames import WORLD_FROM_GLTF
from scenes.package import ScenePackage
from scenes.pose import Pose, quaternion_from_rotation
from scenes.render.reduction import thinned
from scenes.splats import SplatCloud
from scenes.state import ObjectModel
from studio.evaluate.scores import SYMMETRY_OF_KIND
from studio.session.opening import scene_hash
from studio.session.pipeline import CancelledError
from studio.view.furniture import furniture_of
from studio.web.browser_spz import write_browser_spz
from studio.web.splat_parts import shadow_part, write_shadow_parts
from studio.web.views import first_places, views_of

MANIFEST = "manifest.json"
"""File with everything but the splats."""

FORMAT_VERSION = 4
"""Of the manifest; files of another version are made again."""

MAX_SPLATS = 400_000
"""Of room and objects together, chosen: what a Quest 3 is reported to draw at its display rate."""

MAX_FIRST_BYTES = 1_000_000
"""Of the thinned room, by which the room is recognised: 0.3 s at 30 Mbit/s."""

FIRST_TRY_SPLATS = 60_000
"""Of the thinned room before its size is known; 14 to 17 bytes each."""

MAX_TRIES = 4
"""Bytes a splat differ little between a cloud and a part of it: two tries do, this is the end."""

AIM = 0.97
"""Share of the allowed bytes that a thinned room aims at."""

OBJECTS_SHARE = 0.5
"""Of the splats, what all objects together may take at most, chosen as in the shared viewer."""

MIN_HEIGHT_M = 2.2
"""Of the ceiling, where few splats are higher: a ray that meets no splat ends there."""

HEIGHT_QUANTILE = 0.995
"""Of the splats' heights, taken for the ceiling: some stray ones are higher."""

CODES_CHARACTERS = 10
"""Of the digest of where codes hang: enough to differ."""

DECIMALS = 5
"""Of lengths in metres and of quaternions."""


def write_room_files(
    scene: ScenePackage,
    folder: Path,
    *,
    max_splats: int = MAX_SPLATS,
    cancelled: threading.Event | None = None,
) -> dict[str, Path]:
    """Return the files of a room by name; made only where the folder does not hold them yet.

    Args:
        scene: the room and its objects.
        folder: the caller's; files of another scene in it are replaced.
        max_splats: of room and objects together.
        cancelled: set it from another thread to stop.

    Raises:
        CancelledError: it was cancelled; the folder holds no manifest then.
        ValueError: fewer than one splat is allowed for the room.
        OSError: the disk is full.
    """
    folder.mkdir(parents=True, exist_ok=True)
    codes = hashlib.sha256(json.dumps(_codes(scene)).encode()).hexdigest()[:CODES_CHARACTERS]
    made_of = f"{FORMAT_VERSION}:{max_splats}:{scene_hash(scene)}:{codes}"
    known = _known_files(folder, made_of)
    if known is not None:
        return known
    (folder / MANIFEST).unlink(missing_ok=True)
    cancelled = cancelled or threading.Event()
    objects = _write_objects(scene, folder, max_splats=max_splats, cancelled=cancelled)
    left = max_splats - sum(objects.values())
    first = _write_first(scene.room, folder, max_splats=left, cancelled=cancelled)
    room: str | None = None
    has_bands = scene.room.sh.shape[1] > 1
    if has_bands or first < min(left, len(scene.room)):
        _stop_if(cancelled)
        room = "room"
        write_browser_spz(folder / "room.spz", thinned(scene.room, left))
    _stop_if(cancelled)
    shadows = {part.name for part in write_shadow_parts(scene, folder)}
    manifest = {"made_of": made_of, **_manifest(scene, room_part=room, shadows=shadows)}
    write_whole(folder / MANIFEST, json.dumps(manifest, separators=(",", ":")))
    files = _known_files(folder, made_of)
    assert files is not None
    return files


def _known_files(folder: Path, made_of: str) -> dict[str, Path] | None:
    """Return the files that a manifest of the same scene names; None where one is missing."""
    try:
        manifest: Any = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))
        if manifest["made_of"] != made_of:
            return None
        parts = [manifest["first_part"], manifest["room_part"]]
        parts += [
            part for item in manifest["objects"] for part in (item["part"], item["shadow_part"])
        ]
    except (OSError, ValueError, KeyError, TypeError):
        return None
    files = {f"{part}.spz": folder / f"{part}.spz" for part in parts if part is not None}
    files[MANIFEST] = folder / MANIFEST
    return files if all(path.is_file() for path in files.values()) else None


def _write_objects(
    scene: ScenePackage, folder: Path, *, max_splats: int, cancelled: threading.Event
) -> dict[str, int]:
    """Return the splats of each object's file."""
    whole = sum(len(item.splats) for item in scene.objects)
    share = min(1.0, OBJECTS_SHARE * max_splats / max(whole, 1))
    counts: dict[str, int] = {}
    for index, item in enumerate(scene.objects):
        _stop_if(cancelled)
        cloud = thinned(item.splats, max(1, int(share * len(item.splats))))
        write_browser_spz(folder / f"{object_part(index)}.spz", cloud)
        counts[item.object_id] = len(cloud)
    return counts


def _write_first(
    room: SplatCloud, folder: Path, *, max_splats: int, cancelled: threading.Event
) -> int:
    """Return how many splats the thinned room has; without colours that change with the view."""
    most = min(len(room), max_splats)
    path = folder / "first.spz"
    plain = SplatCloud(room.means, room.scales, room.rotations, room.opacities, room.sh[:, :1])
    count = max(1, min(most, FIRST_TRY_SPLATS))
    best = 0
    for _ in range(MAX_TRIES):
        _stop_if(cancelled)
        cloud = thinned(plain, count)
        size = write_browser_spz(path, cloud)
        if size <= MAX_FIRST_BYTES:
            best = len(cloud)
            if best == most or size > AIM**2 * MAX_FIRST_BYTES:
                break
        count = max(1, min(most, int(AIM * count * MAX_FIRST_BYTES / size)))
    if path.stat().st_size > MAX_FIRST_BYTES:
        best = len(thinned(plain, best or 1))
        write_browser_spz(path, thinned(plain, best))
    return best


def object_part(index: int) -> str:
    """Return the part with the splats of an object."""
    return f"object-{index}"


def _manifest(scene: ScenePackage, *, room_part: str | None, shadows: set[str]) -> dict[str, Any]:
    """Return everything that the page knows of the room before anybody says so."""
    heights = scene.room.means[:, 2]
    height = float(np.quantile(heights, HEIGHT_QUANTILE)) if len(scene.room) else MIN_HEIGHT_M
    return {
        "name": scene.name,
        "world_from_file": WORLD_FROM_GLTF.quaternion().tolist(),
        "views": views_of(scene, first_places(scene, set(), {})),
        "footprint": np.round(scene.footprint_m, DECIMALS).tolist(),
        "floor_m": 0.0,
        "height_m": round(max(height, MIN_HEIGHT_M), 3),
        "solids": _solids(scene),
        "codes": _codes(scene),
        "first_part": "first",
        "room_part": room_part,
        "objects": [
            {
                "id": item.object_id,
                "name": item.name,
                "part": object_part(index),
                "shadow_part": shadow_part(index) if shadow_part(index) in shadows else None,
                "pose": _on_the_wire(item.world_from_object),
                **_size(item),
            }
            for index, item in enumerate(scene.objects)
        ],
    }


def _codes(scene: ScenePackage) -> list[dict[str, Any]]:
    """Return middles of printed codes, by which somebody lays the room on the real one; Y up."""
    gltf_from_world = WORLD_FROM_GLTF.inverse()
    return [
        {
            "name": code.payload,
            "place": np.round(
                gltf_from_world @ code.world_from_code.translation, DECIMALS
            ).tolist(),
        }
        for code in scene.codes
    ]


def _solids(scene: ScenePackage) -> dict[str, Any]:
    """Return boxes that hands stay out of: centre, quaternion w x y z, half extents; Z up."""
    furniture = furniture_of(scene)
    return {
        "room": _boxes(furniture.fixed),
        "objects": {key: _boxes(parts) for key, parts in furniture.parts.items()},
    }


def _boxes(solids: Solids) -> list[list[float]]:
    rows = zip(solids.centres, solids.rotations, solids.halves, strict=True)
    return [
        np.round([*centre, *quaternion_from_rotation(turn), *half], DECIMALS).tolist()
        for centre, turn, half in rows
    ]


def _size(item: ObjectModel) -> dict[str, Any]:
    middle, radius = item.sphere()
    return {
        "middle_m": round(float(middle[2]), 3),
        "radius_m": round(radius, 3),
        "box_m": [round(float(side), 3) for side in item.box_m],
        "symmetry": SYMMETRY_OF_KIND.get(item.kind, 1),
    }


def _on_the_wire(world_from_object: Pose) -> list[float]:
    """Return place and quaternion x y z w as the hub sends them: room and object with y up."""
    pose = WORLD_FROM_GLTF.inverse() @ world_from_object @ WORLD_FROM_GLTF
    w, x, y, z = pose.quaternion().tolist()
    return [round(float(n), DECIMALS) for n in (*pose.translation.tolist(), x, y, z, w)]


def _stop_if(cancelled: threading.Event) -> None:
    if cancelled.is_set():
        raise CancelledError
