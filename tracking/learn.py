"""Plates that learn: where the live picture agrees with the scan, it is better than the scan.

A scan is blurred, speckled and lit as on the day it was made. Pixels that show the room beyond
doubt (outside every known object, and with no coherent difference over their surroundings) are
taken over into the plate at the plate's exposure. People and unknown things differ coherently and
are not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from devices.messages import Frame
from scenes.render.renderer import PosedSplats, Renderer, RenderOptions
from tracking.background import Exposure, Plates, plate_noise
from tracking.pictures import box_blurred, resized

FloatArray = NDArray[np.float32]

COHERENT_SIDE = 1 / 110
"""Side of the surroundings that are averaged, as a share of the lens picture's."""

COHERENT_LEVEL = 0.07
"""A mean difference above this, of a 0..1 channel, is a thing and not the scan's roughness."""

RELIT_RATIO = (0.35, 1.9)
RELIT_HUE = 0.022
"""Brightness ratios, and the left-over difference of colour, of a place that is only relit."""

KEEP_AWAY_SIDE = 1 / 360
"""Distance kept from known objects, as a share of the lens picture's side."""

SHRINK = 4
"""What is coherent is told in a picture this much smaller."""

BLEND = 0.25
"""Share of the live picture in a pixel that was learned before."""

ROUGH_SIDE = 1 / 24
"""Surroundings over which the roughness of pixels not yet learned is estimated."""


def learn(
    plates: Plates,
    frame: Frame,
    exposures: Sequence[Exposure],
    objects: Sequence[PosedSplats],
    renderer: Renderer,
    *,
    lenses: Sequence[int],
) -> Plates:
    """The plates with what this frame shows of the room.

    Args:
        plates: so far.
        frame: live pictures.
        exposures: one per lens, of this frame.
        objects: movable objects where they are believed to be; nothing is learned there.
        renderer: draws splats.
        lenses: which lenses to learn from.
    """
    images, noise, learned = list(plates.images), list(plates.noise), list(plates.learned)
    for index in lenses:
        camera = frame.rig.lenses[index]
        world_from_lens = plates.world_from_rig @ frame.rig.rig_from_lens[index]
        taken = np.zeros((camera.height_px, camera.width_px), np.uint8)
        if objects:
            drawn = renderer.render(objects, camera, world_from_lens, RenderOptions())
            side = 2 * max(1, round(KEEP_AWAY_SIDE * camera.width_px)) + 1
            taken = cv2.dilate((drawn.alpha > 0.05).astype(np.uint8), np.ones((side, side)))
        images[index], noise[index], learned[index] = _learn_lens(
            frame.images[index],
            images[index],
            learned[index],
            exposures[index],
            usable=(taken == 0) & (plates.coverage[index] > 0.5),
        )
    return replace(plates, images=tuple(images), noise=tuple(noise), learned=tuple(learned))


def _learn_lens(
    live: NDArray[np.uint8],
    plate: FloatArray,
    learned: NDArray[np.bool_],
    exposure: Exposure,
    *,
    usable: NDArray[np.bool_],
) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
    """New plate, noise and learned mask of one lens."""
    height, width = plate.shape[:2]
    x = ((np.arange(width, dtype=np.float32) + 0.5) / width - 0.5) * 2
    y = ((np.arange(height, dtype=np.float32) + 0.5) / height - 0.5) * 2
    radius2 = (x[None, :] ** 2 + y[:, None] ** 2)[..., None]
    gain = exposure.gain.astype(np.float32) + radius2 * exposure.falloff.astype(np.float32)
    neutral = (live.astype(np.float32) / 255.0 - exposure.offset.astype(np.float32)) / gain
    residual = neutral - plate
    small = (width // SHRINK, height // SHRINK)
    small_residual, small_plate = resized(residual, small), resized(plate, small)
    side = max(3, round(COHERENT_SIDE * width / SHRINK)) | 1
    mean_residual = box_blurred(small_residual, side)
    coherent = np.abs(mean_residual).max(axis=2) < COHERENT_LEVEL
    shows_room = coherent | _relit(box_blurred(small_plate, side), mean_residual)
    take = usable & (cv2.resize(shows_room.astype(np.uint8), (width, height)) > 0)
    share = np.where(learned, np.float32(BLEND), np.float32(1.0)) * take
    plate = plate + residual * share[..., None]
    known = learned | take
    speckle = np.abs(small_residual - mean_residual).mean(axis=2)
    taken = cv2.resize(take.astype(np.uint8), small, interpolation=cv2.INTER_NEAREST) > 0
    rough = cv2.resize(_roughness(speckle, taken), (width, height))
    noise = plate_noise(plate)
    noise = np.where(known, noise, np.maximum(noise, rough))
    return plate, noise.astype(np.float32), known


def _relit(plate: FloatArray, residual: FloatArray) -> NDArray[np.bool_]:
    """Where the same colour is only lighter or darker: a shadow has come or gone."""
    live = plate + residual
    power = np.einsum("hwc,hwc->hw", plate, plate) + 1e-4
    ratio = np.einsum("hwc,hwc->hw", live, plate) / power
    hue = np.abs(live - ratio[..., None] * plate).max(axis=2)
    return (ratio > RELIT_RATIO[0]) & (ratio < RELIT_RATIO[1]) & (hue < RELIT_HUE)


def _roughness(residual: FloatArray, take: NDArray[np.bool_]) -> FloatArray:
    """Typical difference between scan and live picture in the surroundings that were taken over."""
    weight = take.astype(np.float32)
    side = max(3, round(ROUGH_SIDE * residual.shape[1]) * 2 + 1)
    total, count = box_blurred(residual * weight, side), box_blurred(weight, side)
    return (total / np.maximum(count, 1e-3)).astype(np.float32)
