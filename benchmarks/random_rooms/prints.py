"""Random prints on packages, covers and labels."""

from __future__ import annotations

from typing import cast

import numpy as np
from PIL import Image, ImageDraw

from benchmarks.random_rooms.finishes import COLOURS
from scenes.samples.pictures.graphics import font
from scenes.samples.pictures.textures import Rgb, mixed, noise, tinted
from scenes.samples.shapes import Picture

PX_PER_M = 1000.0
"""Fineness of print; small type of 5 mm is just readable."""

MAX_PX = 420
"""Largest side of a printed face: a texture holds six of them."""

WORDS = (
    "MUESLI", "OAT", "NORTH", "ATLAS", "FRAGILE", "HONEY", "LUMEN", "RIVER", "CORN", "ORBIT",
    "PAPER", "MAPLE", "SALT", "TEA", "VOLUME", "GARDEN", "No. 7", "EXTRA", "BASIC", "FLORA",
)  # fmt: skip


def printed(rng: np.random.Generator, size_m: tuple[float, float], ground: Rgb) -> Picture:
    """A printed face with shapes, a title and small type.

    Args:
        rng: decides it.
        size_m: width and height in metres.
        ground: colour below the print.
    """
    scale = min(PX_PER_M, MAX_PX / max(size_m))
    w, h = (max(12, round(side * scale)) for side in size_m)
    image = Image.fromarray(tinted(ground, 0.04 * noise(rng, (h, w), cell_px=(40, 40))))
    draw = ImageDraw.Draw(image)
    palette = [mixed(COLOURS, rng) for _ in range(4)]
    for _ in range(int(rng.integers(3, 9))):
        _shape(draw, rng, (w, h), palette[int(rng.integers(len(palette)))])
    _title(draw, rng, (w, h), palette)
    return np.asarray(image)


def sheet(rng: np.random.Generator, size_m: tuple[float, float], ground: Rgb) -> Picture:
    """The same ground with a few lines of small type only."""
    scale = min(PX_PER_M, MAX_PX / max(size_m))
    w, h = (max(12, round(side * scale)) for side in size_m)
    image = Image.fromarray(tinted(ground, 0.03 * noise(rng, (h, w), cell_px=(20, 20))))
    draw = ImageDraw.Draw(image)
    ink = cast("Rgb", tuple(255 - v if sum(ground) < 300 else v // 4 for v in ground))
    step = max(4, h // 24)
    for k in range(int(rng.integers(3, 9))):
        y = int(h * 0.3) + k * 2 * step
        draw.rectangle((w // 8, y, int(w * rng.uniform(0.4, 0.85)), y + step // 2), fill=ink)
    return np.asarray(image)


def _shape(
    draw: ImageDraw.ImageDraw, rng: np.random.Generator, size: tuple[int, int], colour: Rgb
) -> None:
    w, h = size
    x, y = rng.uniform(-0.1, 0.9) * w, rng.uniform(-0.1, 0.9) * h
    dx, dy = rng.uniform(0.15, 0.6) * w, rng.uniform(0.1, 0.5) * h
    kind = int(rng.integers(3))
    if kind == 0:
        draw.ellipse((x, y, x + dx, y + dy), fill=colour)
    elif kind == 1:
        draw.rectangle((x, y, x + dx, y + dy), fill=colour)
    else:
        draw.polygon(((x, y + dy), (x + dx / 2, y), (x + dx, y + dy)), fill=colour)


def _title(
    draw: ImageDraw.ImageDraw, rng: np.random.Generator, size: tuple[int, int], palette: list[Rgb]
) -> None:
    w, h = size
    word = WORDS[int(rng.integers(len(WORDS)))]
    face = font(max(8, min(h // 5, int(1.5 * w / len(word)))), bold=True)
    y = int(rng.uniform(0.08, 0.6) * h)
    left, top, right, bottom = draw.textbbox((w // 12, y), word, font=face)
    draw.rectangle((left - 4, top - 4, right + 4, bottom + 4), fill=palette[0])
    is_light = sum(palette[0]) > 380
    draw.text((w // 12, y), word, font=face, fill=(24, 24, 28) if is_light else (244, 240, 228))
