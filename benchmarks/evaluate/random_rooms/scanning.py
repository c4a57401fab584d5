"""The scan of a random room: its meshes baked to splats with a scan's faults, kept in the cache."""

from __future__ import annotations

import hashlib
import logging
import shutil
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import platformdirs
from numpy.typing import NDArray

from benchmarks.bake.bake import bake
from benchmarks.random_rooms.room import RandomRoom
from scenes.mesh import PhysicalObject, TexturedMesh
from scenes.package import DISTRIBUTION, ScenePackage, is_package, load_package, save_package
from scenes.package.files import PackageError
from scenes.package.package import Stage
from scenes.rays import RayScene

log = logging.getLogger(__name__)

VIEWS = 32
"""Directions from which a face may be seen, spread evenly: a face hidden from all is in no scan."""

CLEARANCE_M = 1e-3
"""Distance in m of a view's ray from the face it leaves."""

SOURCES = (
    "scenes/samples/*.py",
    "benchmarks/random_rooms/*.py",
    "benchmarks/bake/*.py",
    "scenes/rays.py",
    "benchmarks/evaluate/random_rooms/scanning.py",
)
"""Code that decides what a scan looks like."""


def scan_of(room: RandomRoom, *, folder: Path | None = None) -> ScenePackage:
    """The scan of a room, from the cache where it was made before; about a minute where not.

    Args:
        room: what is scanned.
        folder: where scans are kept; the user's cache folder if not given.
    """
    where = folder or Path(platformdirs.user_cache_dir(DISTRIBUTION)) / "random-rooms"
    path = where / f"{room.scanned.name}-{_digest()}.gnx"
    if is_package(path):
        try:
            return load_package(path)
        except PackageError as error:
            log.warning("scan %s is damaged (%s); baking it again", path, error)
    made = _baked(room)
    try:
        where.mkdir(parents=True, exist_ok=True)
        for old in where.glob(f"{room.scanned.name}-*.gnx"):
            shutil.rmtree(old, ignore_errors=True)
        save_package(made, path)
        # What is read has lost a little precision: every run sees the same splats.
        return load_package(path)
    except OSError as error:
        log.warning("scan %s cannot be kept (%s); the next run bakes it again", path, error)
        return made


def _baked(room: RandomRoom) -> ScenePackage:
    physical = room.scanned
    cloud, objects = bake(
        replace(physical, objects=tuple(map(without_hidden_faces, physical.objects))),
        rng=np.random.default_rng([room.seed, 1]),
    )
    return ScenePackage(
        name=physical.name,
        room=cloud,
        objects=objects,
        codes=(),
        world_from_rig=physical.world_from_rig,
        footprint_m=physical.footprint_m,
        physical=None,
        stages=(Stage("bake", f"random room {room.seed}"),),
    )


def without_hidden_faces(item: PhysicalObject) -> PhysicalObject:
    """An object without what no camera can see: faces inside other parts."""
    scene = RayScene(np.concatenate([_triangles(mesh) for mesh in item.meshes]))
    return replace(item, meshes=tuple(_seen_from_outside(mesh, scene) for mesh in item.meshes))


def _seen_from_outside(mesh: TexturedMesh, scene: RayScene) -> TexturedMesh:
    triangles = _triangles(mesh)
    across = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals = across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-12)
    # A Fibonacci sphere.
    k = np.arange(2 * VIEWS) + 0.5
    height, turn = 1.0 - k / VIEWS, k * np.pi * (3.0 - np.sqrt(5.0))
    ring = np.sqrt(1.0 - height**2)
    directions = np.column_stack([ring * np.cos(turn), ring * np.sin(turn), height])
    origins = triangles.mean(axis=1) + CLEARANCE_M * normals
    is_seen = np.zeros(len(triangles), dtype=np.bool_)
    for direction in directions:
        towards = normals @ direction > 0.0
        rays = np.broadcast_to(direction, origins.shape)
        is_seen |= towards & (scene.cast(origins, rays).triangle < 0)
    return replace(mesh, faces=mesh.faces[is_seen]) if is_seen.any() else mesh


def _triangles(mesh: TexturedMesh) -> NDArray[np.float64]:
    return np.asarray(mesh.vertices[mesh.faces], dtype=np.float64)


def _digest() -> str:
    root = Path(__file__).parents[3]
    digest = hashlib.sha256(f"{np.__version__} {cv2.__version__}".encode())
    for pattern in SOURCES:
        for source in sorted(root.glob(pattern)):
            digest.update(source.read_bytes())
    return digest.hexdigest()[:16]
