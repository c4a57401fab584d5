"""The scan of a random room: its meshes baked to splats with a scan's faults, kept in the cache."""

from __future__ import annotations

import hashlib
import logging
import shutil
from pathlib import Path

import cv2
import numpy as np
import platformdirs

from scenes.package import DISTRIBUTION, ScenePackage, is_package, load_package, save_package
from scenes.package.files import PackageError
from scenes.package.package import Stage
from scenes.prepare.bake.bake import bake
from scenes.samples.random_rooms.room import RandomRoom

log = logging.getLogger(__name__)

ROOM_SPLATS, OBJECT_SPLATS = 110_000, 6_000
"""Splats of the room and of each object: half of what the bake takes by itself, for speed; a
built-in room's scan has about as many."""

SOURCES = (
    "scenes/samples/*.py",
    "scenes/samples/random_rooms/*.py",
    "scenes/prepare/bake/*.py",
    "scenes/rays.py",
    "studio/evaluate/random_rooms/scanning.py",
)
"""Code that decides what a scan looks like."""


def scan_of(room: RandomRoom, *, folder: Path | None = None) -> ScenePackage:
    """The scan of a room, from the cache where it was made before; half a minute where not.

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
        physical,
        rng=np.random.default_rng([room.seed, 1]),
        room_splats=ROOM_SPLATS,
        object_splats=OBJECT_SPLATS,
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


def _digest() -> str:
    root = Path(__file__).parents[3]
    digest = hashlib.sha256(f"{np.__version__} {cv2.__version__}".encode())
    for pattern in SOURCES:
        for source in sorted(root.glob(pattern)):
            digest.update(source.read_bytes())
    return digest.hexdigest()[:16]
