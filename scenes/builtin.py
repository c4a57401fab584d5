"""The built-in rooms as scene packages, baked once and kept in the user's cache folder."""

from __future__ import annotations

import hashlib
import shutil
from pathlib import Path

import numpy as np
import platformdirs

from scenes.package import DISTRIBUTION, ScenePackage, Stage, load_package, save_package
from scenes.package_files import PackageError
from scenes.prepare.bake.bake import bake
from scenes.samples import sample_room

BAKE_SEED = 2026
"""Decides the imperfections of the scan, so that everyone's built-in room is the same."""

_SOURCES = (
    "*.py",
    "samples/*.py",
    "samples/data/*.npz",
    "formats/*.py",
    *(f"prepare/bake/{part}.py" for part in ("bake", "discs", "spacing", "surface")),
)


def open_builtin(name: str, cache_dir: Path | None = None) -> ScenePackage:
    """The scan of a built-in room; the first call bakes it, later ones load it.

    What is returned has always been through the file, so the first session and later ones work on
    identical numbers. Processes that bake at the same time do not disturb each other.

    Args:
        name: one of `scenes.samples.SAMPLE_NAMES`.
        cache_dir: where to keep packages; by default the user's cache folder.

    Raises:
        ValueError: no such room.
        WriteError: the cache folder is not writable or full.
    """
    root = cache_dir or Path(platformdirs.user_cache_dir(DISTRIBUTION)) / "scenes"
    folder = root / f"{name}-{_source_hash()}"
    if folder.exists():
        try:
            return load_package(folder)
        except PackageError:
            # A damaged cache is worth nothing and costs seconds to make again.
            shutil.rmtree(folder, ignore_errors=True)
    save_package(_scanned(name), folder, replace=False)
    return load_package(folder)


def _scanned(name: str) -> ScenePackage:
    physical = sample_room(name)
    room, objects = bake(physical, rng=np.random.default_rng(BAKE_SEED))
    return ScenePackage(
        name=name,
        room=room,
        objects=objects,
        codes=physical.codes,
        world_from_rig=physical.world_from_rig,
        footprint_m=physical.footprint_m,
        physical=name,
        stages=(Stage("bake", f"surfaces of the built-in room {name!r}, seed {BAKE_SEED}"),),
    )


def _source_hash() -> str:
    """Changes whenever code changes that decides what a baked package holds."""
    here = Path(__file__).parent
    digest = hashlib.sha256()
    for pattern in _SOURCES:
        for source in sorted(here.glob(pattern)):
            digest.update(source.relative_to(here).as_posix().encode())
            digest.update(source.read_bytes())
    return digest.hexdigest()[:16]
