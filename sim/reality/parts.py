"""The parts of a second reconstruction, kept in the cache: taking it apart takes a minute."""

from __future__ import annotations

import hashlib
import json
import logging
from pathlib import Path

import numpy as np
import platformdirs

from scenes.formats.ply import WORLD_COMMENT, read_ply, write_ply
from scenes.formats.storage.atomic import write_folder
from scenes.package import DISTRIBUTION, ScenePackage
from scenes.package.reality import Reality
from scenes.prepare.cutout.likewise import TakenApart, taken_apart_like
from scenes.prepare.progress import Progress, silent
from scenes.render.native import NativeRenderer

log = logging.getLogger(__name__)

VERSION = "1"
"""Counted up with every change to how a reconstruction is taken apart."""
ROOM, MISSING, SUFFIX = "room.ply", "missing.json", ".object.ply"


def parts_of(
    scene: ScenePackage,
    reality: Reality,
    renderer: NativeRenderer,
    *,
    folder: Path | None = None,
    progress: Progress = silent,
) -> TakenApart:
    """A scan's second reconstruction, taken apart as the scan was.

    Args:
        scene: the scan with its objects.
        reality: of that scan.
        renderer: draws both.
        folder: where parts are kept; the user's cache folder if not given.
        progress: called before each object.

    Raises:
        FormatError, OSError: the reconstruction cannot be read.
    """
    where = folder or Path(platformdirs.user_cache_dir(DISTRIBUTION)) / "realities"
    path = where / _digest(scene, reality)
    try:
        return _load(path)
    except (OSError, ValueError) as error:
        if path.exists():
            log.warning("parts in %s are damaged (%s); making them again", path, error)
    made = taken_apart_like(scene, reality.read(), renderer=renderer, progress=progress)
    try:
        write_folder(path, lambda part: _fill(part, made), replace=True)
        # What is read has lost a little precision: every run draws the same splats.
        return _load(path)
    except OSError as error:
        log.warning("parts cannot be kept in %s (%s); the next run makes them again", path, error)
        return made


def _fill(part: Path, made: TakenApart) -> None:
    write_ply(part / ROOM, made.room, comments=[WORLD_COMMENT])
    for object_id, cloud in made.objects.items():
        write_ply(part / f"{object_id}{SUFFIX}", cloud)
    (part / MISSING).write_text(json.dumps(made.missing), encoding="utf-8")


def _load(path: Path) -> TakenApart:
    objects = {
        file.name.removesuffix(SUFFIX): read_ply(file) for file in sorted(path.glob(f"*{SUFFIX}"))
    }
    missing = json.loads((path / MISSING).read_text(encoding="utf-8"))
    return TakenApart(read_ply(path / ROOM), objects, missing)


def _digest(scene: ScenePackage, reality: Reality) -> str:
    digest = hashlib.sha256(VERSION.encode())
    digest.update(reality.splats.read_bytes())
    digest.update(np.ascontiguousarray(scene.room.means).tobytes())
    for item in scene.objects:
        digest.update(item.object_id.encode())
        digest.update(np.ascontiguousarray(item.splats.means).tobytes())
        digest.update(item.world_from_object.matrix().tobytes())
    return digest.hexdigest()[:32]
