"""A person's own photo, and marks in it, as the view that the preparation made of it.

The preparation shrinks large photos and takes the lens's distortion out of them, which leaves a
picture of another size. What it cropped and bent is not kept in the scene. Of a phone's photo,
which the phone has rectified itself, that is a pixel or two; it is less than what masks and boxes
are off, so that the photo is taken as stretched to the view's size.
"""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.package.records import ViewPoint
from scenes.prepare.cutout.marks.masks import Prompt
from scenes.prepare.footage.picture_files import read_stored, read_upright

MAX_UNEVEN = 0.01
"""Relative difference of how much a photo is stretched across and down, at most. A crop of one
pixel of the sides of an 800 × 600 photo makes 0.0004; another shape is another photo, or one on its
side."""


def own_photo(view: ViewPoint, path: Path, prompt: Prompt) -> tuple[NDArray[np.uint8], Prompt]:
    """The photo at its view's size, and what was marked in the photo's pixels in the view's.

    Raises:
        ValueError: the file is missing, no picture, or of another shape than the view.
    """
    camera = view.camera
    wanted = camera.width_px, camera.height_px
    photo = _photo(path, wanted)
    if photo is None:
        raise ValueError(f"{path}: not a picture that can be read; film or copy it again")
    if photo.shape[1::-1] == wanted:
        return np.ascontiguousarray(photo[..., ::-1]), prompt
    height, width = photo.shape[:2]
    across, down = wanted[0] / width, wanted[1] / height
    if abs(across / down - 1) > MAX_UNEVEN:
        raise ValueError(
            f"{path}: {width}×{height} px, but its camera has {wanted[0]}×{wanted[1]}; give the "
            "photo that the scene was made of, whole and upright"
        )
    smaller = cv2.INTER_AREA if across < 1 else cv2.INTER_LINEAR
    resized = cv2.cvtColor(cv2.resize(photo, wanted, interpolation=smaller), cv2.COLOR_BGR2RGB)
    return np.ascontiguousarray(resized, dtype=np.uint8), _scaled(prompt, across, down)


def _photo(path: Path, wanted: tuple[int, int]) -> NDArray[np.uint8] | None:
    """BGR of the view's shape: upright, or else as it is stored.

    A preparation takes photos upright, and those with poses of elsewhere as they are stored.
    """
    upright, stored = read_upright(path), read_stored(path)
    if upright is None or stored is None:
        return None
    is_on_its_side = abs(upright.shape[0] * wanted[0] / (upright.shape[1] * wanted[1]) - 1)
    return stored if is_on_its_side > MAX_UNEVEN else upright


def _scaled(prompt: Prompt, across: float, down: float) -> Prompt:
    by = np.array([across, down])
    box = prompt.box_px
    if box is not None:
        box = (box[0] * across, box[1] * down, box[2] * across, box[3] * down)
    return Prompt(box, prompt.inside_px * by, prompt.outside_px * by)
