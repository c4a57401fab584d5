"""The splats of a room and its objects in files for a page, within a number of bytes."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from pathlib import Path

from scenes.package import ScenePackage
from scenes.render.reduction import thinned
from scenes.splats import SplatCloud
from studio.session.pipeline import CancelledError
from studio.view.contact_shadows import contact_shadow, shadow_splats, tilt_of
from studio.web.browser_spz import write_browser_spz

MAX_SPLATS = 1_500_000
"""Of the room, chosen: what a laptop's own graphics still turn smoothly in a browser."""

OBJECTS_SHARE = 0.5
"""Of the bytes, what all objects together may take at most, chosen: they are what is looked at."""

FEWEST_SPLATS = 1_000
"""Below this nothing is recognised, chosen."""

TRIES = 5
"""Bytes a splat differ little between a cloud and its half: two tries do, this is the end."""

AIM = 0.97
"""Share of the allowed bytes that a thinned cloud aims at."""


@dataclass(frozen=True, slots=True)
class SplatPart:
    """One file of splats: its name in the page, where it lies, how many splats of how many."""

    name: str
    path: Path
    splats: int
    of_splats: int


def write_splat_parts(
    scene: ScenePackage, folder: Path, *, allowed_bytes: int, cancelled: threading.Event
) -> tuple[SplatPart, ...]:
    """Write the room, then the objects in their order, thinned where they would be too large.

    Args:
        scene: what to write.
        folder: for the files.
        allowed_bytes: of all files together.
        cancelled: set it from another thread to stop.

    Raises:
        CancelledError: it was cancelled.
        ValueError: even a few splats are too many bytes.
        OSError: the disk is full.
    """
    for_objects = int(OBJECTS_SHARE * allowed_bytes)
    whole = sum(len(item.splats) for item in scene.objects)
    objects: list[SplatPart] = []
    for index, item in enumerate(scene.objects):
        share = int(for_objects * len(item.splats) / max(whole, 1))
        name = f"object-{index}"
        objects.append(
            _written(name, item.splats, folder, allowed_bytes=share, cancelled=cancelled)
        )
    taken = sum(part.path.stat().st_size for part in objects)
    room = _written(
        "room", scene.room, folder, allowed_bytes=allowed_bytes - taken, cancelled=cancelled
    )
    return (room, *objects)


def shadow_part(index: int) -> str:
    """The part with the shadow of an object."""
    return f"shadow-{index}"


def write_shadow_parts(scene: ScenePackage, folder: Path) -> tuple[SplatPart, ...]:
    """Write what every object darkens around its base; none of what is too faint to be seen.

    They are no splats of the scene, and are counted as none.

    Raises:
        OSError: the disk is full.
    """
    found: list[SplatPart] = []
    for index, item in enumerate(scene.objects):
        shadow = contact_shadow(item.splats, tilt_of(item.world_from_object.rotation))
        splats = None if shadow is None else shadow_splats(shadow)
        if splats is not None:
            path = folder / f"{shadow_part(index)}.spz"
            write_browser_spz(path, splats)
            found.append(SplatPart(shadow_part(index), path, 0, 0))
    return tuple(found)


def _written(
    name: str, cloud: SplatCloud, folder: Path, *, allowed_bytes: int, cancelled: threading.Event
) -> SplatPart:
    path = folder / f"{name}.spz"
    count = min(len(cloud), MAX_SPLATS)
    for _ in range(TRIES):
        if cancelled.is_set():
            raise CancelledError
        smaller = thinned(cloud, count) if count else cloud
        size = write_browser_spz(path, smaller)
        if size <= allowed_bytes:
            return SplatPart(name, path, len(smaller), len(cloud))
        count = int(AIM * count * allowed_bytes / size)
        if count < min(FEWEST_SPLATS, len(cloud)):
            break
    raise ValueError(
        f"viewer, {name}: {allowed_bytes / 1e6:.2f} MB for {len(cloud)} splats leave too few to "
        "be recognised; allow a larger viewer with --viewer-mb"
    )
