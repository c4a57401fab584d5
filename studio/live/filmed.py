"""Camera of footage that carries its own calibration: lenses from it, place from the room."""

from __future__ import annotations

from collections.abc import Callable
from itertools import islice
from pathlib import Path

from devices.footage import FilmedBy, FootageError, lens_size_px, read_footage
from devices.insta360.files.lens_rig import read_carried
from devices.insta360.files.offsets import OffsetError
from scenes.cameras import Rig
from scenes.package import ScenePackage
from scenes.render.renderer import Renderer
from studio.live.placing import PICTURES, Locate, PlacingError, find_in_room, fit_to_room

LENSES = 2
"""Lenses of a camera whose files carry a calibration."""

Say = Callable[[str], None]
"""Takes a sentence about what is found."""


def carried_rig(video: Path, *, instead: str, say: Say) -> Rig:
    """Return the lenses that a camera wrote into its own file.

    Args:
        video: the file.
        instead: words for a message: what to give where the file has none.
        say: called with whose calibration is used.

    Raises:
        FootageError: it carries none, or one that does not suit it.
        OSError: it cannot be read.
    """
    try:
        if not video.exists():
            raise FootageError(f"{video}: no such video or folder; check the name")
        carried = None if video.is_dir() else read_carried(video)
        if carried is None:
            raise FootageError(f"{video}: footage does not say what its camera is: give {instead}")
        size_px = lens_size_px(video, LENSES)
        rig = carried.rig(size_px)
    except OffsetError as error:
        text = str(error) if str(video) in str(error) else f"{video}: {error}"
        raise FootageError(f"{text}; or give {instead}") from None
    who = carried.camera or "the camera"
    say(f"lenses: as {who} itself has calibrated them, of {video.name}, {size_px} px each")
    return rig


def camera_of_footage(
    video: Path,
    scene: ScenePackage,
    *,
    renderer: Renderer,
    locate: Locate,
    instead: str,
    say: Say,
) -> FilmedBy:
    """Return lenses and place of the camera that took footage, fitted to its first pictures.

    Args:
        video: with its camera's calibration.
        scene: the room that it was filmed in.
        renderer: draws splats.
        locate: finds the pose.
        instead: words for a message: what to give where this cannot be found.
        say: called with what is found.

    Raises:
        FootageError: the footage carries no calibration, is damaged, or its camera is not found.
        OSError: it cannot be read.
    """
    rig = carried_rig(video, instead=instead, say=say)
    begun = FilmedBy(rig, scene.world_from_rig)
    frames = list(islice(read_footage(video, begun), PICTURES))
    if not frames:
        raise FootageError(f"{video}: the footage is without a single picture")
    try:
        found = find_in_room(frames[-1], scene, locate=locate)
        fitted = fit_to_room(
            frames,
            scene,
            world_from_rig=found.world_from_rig,
            renderer=renderer,
            say=lambda _: None,
        )
    except PlacingError as error:
        raise FootageError(f"{video}: {error}; or give {instead}") from None
    say(f"camera: {found.described()}; {fitted.described()}")
    return FilmedBy(fitted.rig, fitted.world_from_rig)
