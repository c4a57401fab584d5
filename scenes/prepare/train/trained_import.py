# pyright: standard
"""Splats that someone else trained: taken only if they draw the photos they were trained on.

Nothing in a splat file says in which frame it is, and programs disagree about the order of
quaternions and coefficients. A wrong one draws fog; the photos show it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from scenes.formats.registry import read_splats
from scenes.prepare.reconstruction import Reconstruction
from scenes.prepare.train.held_out import draw_photo, psnr_db
from scenes.prepare.train.training_photos import Photo, read_photo
from scenes.render.renderer import Renderer, RenderOptions
from scenes.splats import SplatCloud, validate

MIN_PSNR_DB = 15.0
CLEARLY_BETTER_DB = 2.0
"""If another reading of the file draws the photos so much better, that is how it was meant."""
VIEWS_CHECKED = 5
"""Views that are drawn to see whether the splats fit the photos."""
MAX_PX = 640
"""Larger photos are checked at this size."""


def import_trained(path: Path, reconstruction: Reconstruction, renderer: Renderer) -> SplatCloud:
    """Read splats that were trained on the reconstruction's photos, in its world.

    Raises:
        FormatError: the file cannot be read.
        ValueError: values are damaged, or the splats do not draw the photos.
    """
    cloud = read_splats(path)
    check_trained(cloud, reconstruction, renderer, where=str(path))
    return cloud


def check_trained(
    cloud: SplatCloud, reconstruction: Reconstruction, renderer: Renderer, *, where: str
) -> float:
    """Median PSNR (dB) over a few photos that the splats should draw.

    Args:
        cloud: splats that should be in the reconstruction's world.
        reconstruction: its photos are the measure.
        renderer: draws.
        where: what to call the splats in messages, such as a file name.

    Raises:
        ValueError: a value is damaged, the PSNR is below `MIN_PSNR_DB`, or the splats draw the
            photos clearly better with their numbers in another order; the message says what helps.
    """
    validate(cloud, where)
    views = reconstruction.views
    chosen = np.linspace(0, len(views) - 1, min(VIEWS_CHECKED, len(views))).round().astype(int)
    checked = [read_photo(views[place], MAX_PX) for place in np.unique(chosen)]
    quality = _median_psnr_db(cloud, checked, renderer)
    others = {
        reading: _median_psnr_db(change(cloud), checked, renderer)
        for reading, change in _OTHER_READINGS.items()
        if change is not _colour_by_colour or cloud.sh_degree > 0
    }
    reading = max(others, key=lambda name: others[name])
    if others[reading] >= max(MIN_PSNR_DB, quality + CLEARLY_BETTER_DB):
        raise ValueError(
            f"{where}: draws the photos at {quality:.1f} dB, but at {others[reading]:.1f} dB with "
            f"{reading}; write the file in the order of 3D Gaussian splatting"
        )
    if quality < MIN_PSNR_DB:
        raise ValueError(
            f"{where}: draws the photos at {quality:.1f} dB, wanted at least "
            f"{MIN_PSNR_DB:.0f} dB; its frame, its coefficients or its quaternions may be in "
            "another order; train on these photos, in the frame of their poses "
            "(gsplat: --no-normalize-world-space)"
        )
    return quality


def _median_psnr_db(cloud: SplatCloud, photos: list[Photo], renderer: Renderer) -> float:
    options = RenderOptions()
    scores = [
        psnr_db(draw_photo(renderer, cloud, photo, options), photo.colours) for photo in photos
    ]
    return float(np.median(scores))


def _last_first(cloud: SplatCloud) -> SplatCloud:
    return replace(cloud, rotations=np.roll(cloud.rotations, 1, axis=1))


def _first_last(cloud: SplatCloud) -> SplatCloud:
    return replace(cloud, rotations=np.roll(cloud.rotations, -1, axis=1))


def _colour_by_colour(cloud: SplatCloud) -> SplatCloud:
    """Higher coefficients, read as all of red, of green, of blue, though they came in turn."""
    n, count, _ = cloud.sh.shape
    in_file = cloud.sh[:, 1:].transpose(0, 2, 1).reshape(n, -1)
    higher = in_file.reshape(n, count - 1, 3)
    return replace(cloud, sh=np.concatenate([cloud.sh[:, :1], higher], axis=1))


_OTHER_READINGS: dict[str, Callable[[SplatCloud], SplatCloud]] = {
    "quaternions read as x, y, z, w": _last_first,
    "quaternions read as y, z, w, x": _first_last,
    "coefficients read as red, green, blue in turn": _colour_by_colour,
}
