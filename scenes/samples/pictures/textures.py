"""Procedural materials: what surfaces are made of, drawn from an injected random generator."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.samples.shapes import Material, Picture

Rgb = tuple[int, int, int]
FloatArray = NDArray[np.float32]


def size_px(width_m: float, height_m: float, mm_per_px: float) -> tuple[int, int]:
    """(height, width) in pixels of a picture that covers so many metres, at least 4."""
    return (
        max(4, round(height_m * 1000 / mm_per_px)),
        max(4, round(width_m * 1000 / mm_per_px)),
    )


def noise(
    rng: np.random.Generator, shape: tuple[int, int], *, cell_px: tuple[float, float]
) -> FloatArray:
    """Smooth noise, mean 0, deviation about 1; `cell_px` is the (vertical, horizontal) grain."""
    h, w = shape
    coarse = rng.standard_normal((round(h / cell_px[0]) + 4, round(w / cell_px[1]) + 4))
    scaled = cv2.resize(
        coarse.astype(np.float32),
        (
            max(w, round(coarse.shape[1] * cell_px[1])),
            max(h, round(coarse.shape[0] * cell_px[0])),
        ),
        interpolation=cv2.INTER_CUBIC,
    )
    return np.asarray(scaled[:h, :w], dtype=np.float32)


def tinted(base: Rgb, shade: NDArray[np.floating[Any]]) -> Picture:
    """A colour times (1 + shade), as a picture."""
    colour = np.asarray(base, dtype=np.float32)
    return np.clip(colour * (1.0 + shade[..., None]) + 0.5, 0, 255).astype(np.uint8)


def plain(rgb: Rgb, *, mm_per_px: float = 20.0) -> Material:
    """One flat colour."""

    def make(width_m: float, height_m: float) -> Picture:
        return np.full((*size_px(width_m, height_m, mm_per_px), 3), rgb, dtype=np.uint8)

    return make


def plaster(rng: np.random.Generator, rgb: Rgb, *, mm_per_px: float = 5.0) -> Material:
    """Painted wall: faint roller marks and slow stains."""

    def make(width_m: float, height_m: float) -> Picture:
        shape = size_px(width_m, height_m, mm_per_px)
        shade = 0.010 * noise(rng, shape, cell_px=(2, 2)) + 0.012 * noise(
            rng, shape, cell_px=(90, 60)
        )
        return tinted(rgb, shade)

    return make


def wood(
    rng: np.random.Generator, rgb: Rgb, *, mm_per_px: float = 3.0, contrast: float = 1.0
) -> Material:
    """Planed wood with the grain along the longer side."""

    def make(width_m: float, height_m: float) -> Picture:
        shape = size_px(width_m, height_m, mm_per_px)
        upright = shape[0] > shape[1]
        long_first = (shape[1], shape[0]) if upright else shape
        shade = _grain(rng, long_first, mm_per_px) * contrast
        return tinted(rgb, shade.T if upright else shade)

    return make


def _grain(rng: np.random.Generator, shape: tuple[int, int], mm_per_px: float) -> FloatArray:
    """Wavy rings stretched along the rows, plus fine pores."""
    h = shape[0]
    k = 3.0 / mm_per_px
    bend = noise(rng, shape, cell_px=(40 * k, 160 * k))
    rows = np.arange(h, dtype=np.float32)[:, None] / (9.0 * k)
    rings = np.sin(rows + 1.6 * bend + float(rng.uniform(0, 6)))
    fibre = noise(rng, shape, cell_px=(1.2, 60 * k))
    broad = noise(rng, shape, cell_px=(26 * k, 300 * k))
    return np.asarray(0.035 * rings + 0.05 * fibre + 0.05 * broad, dtype=np.float32)


def parquet(rng: np.random.Generator, rgb: Rgb, *, mm_per_px: float = 4.0) -> Material:
    """Floor boards along x, 14 cm wide, staggered, each of its own tone."""

    def make(width_m: float, height_m: float) -> Picture:
        h, w = size_px(width_m, height_m, mm_per_px)
        shade = _grain(rng, (h, w), mm_per_px)
        board, length = round(140 / mm_per_px), round(1250 / mm_per_px)
        for top in range(0, h, board):
            left = -int(rng.integers(0, length))
            while left < w:
                x0, x1 = max(0, left), min(w, left + length)
                tone = float(rng.normal(0, 0.07))
                shade[top : top + board, x0:x1] += tone
                shade[top : top + board, x0 : x0 + 1] -= 0.25
                left += length
            shade[top : top + 1] -= 0.22
        return tinted(rgb, shade)

    return make


def fabric(rng: np.random.Generator, rgb: Rgb, *, mm_per_px: float = 3.0) -> Material:
    """Woven cloth: fine speckle, no pattern to hold on to."""

    def make(width_m: float, height_m: float) -> Picture:
        shape = size_px(width_m, height_m, mm_per_px)
        speckle = rng.normal(0, 0.03, shape).astype(np.float32)
        return tinted(rgb, speckle + 0.015 * noise(rng, shape, cell_px=(12, 12)))

    return make


def picture(image: Picture) -> Material:
    """A finished picture, stretched over whatever it is put on."""

    def make(width_m: float, height_m: float) -> Picture:
        del width_m, height_m
        return image

    return make


def mixed(colours: Sequence[Rgb], rng: np.random.Generator) -> Rgb:
    """One of the colours, slightly varied."""
    base = np.asarray(colours[int(rng.integers(len(colours)))], dtype=np.float64)
    r, g, b = np.clip(base * rng.uniform(0.85, 1.1) + rng.normal(0, 4, 3), 0, 255)
    return int(r), int(g), int(b)
