"""Coverings of floors and walls."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.random_rooms.finishes import COLOURS
from scenes.samples.pictures.textures import Rgb, mixed, noise, parquet, plaster, size_px, tinted
from scenes.samples.pictures.wall_art import rug as woven
from scenes.samples.shapes import Material, Picture
from scenes.samples.shell import Shell

BOARDS: tuple[Rgb, ...] = ((196, 158, 114), (150, 108, 72), (110, 82, 60), (214, 190, 156))
CARPETS: tuple[Rgb, ...] = ((120, 122, 126), (94, 104, 118), (158, 144, 124), (110, 84, 80))
TILES: tuple[Rgb, ...] = ((196, 192, 184), (150, 146, 140), (120, 96, 80), (88, 92, 98))
PAPERS: tuple[Rgb, ...] = (
    (228, 224, 214), (206, 214, 208), (198, 206, 218), (222, 206, 188), (170, 186, 180),
    (204, 190, 204), (236, 232, 226), (120, 140, 150),
)  # fmt: skip
RUG_SHARE = 0.45
"""Share of the rooms with a rug."""


def random_floor(rng: np.random.Generator, inside: Shell) -> Picture:
    """Boards, carpet, tiles or concrete over the whole floor, some with a rug woven in."""
    w, d, _ = (float(v) for v in inside.high - inside.low)
    kind = int(rng.integers(4))
    if kind == 0:
        floor = parquet(rng, mixed(BOARDS, rng), mm_per_px=4.0)(w, d)
    elif kind == 1:
        floor = _carpet(rng, mixed(CARPETS, rng))(w, d)
    elif kind == 2:
        floor = _tiles(rng, mixed(TILES, rng))(w, d)
    else:
        floor = _concrete(rng, mixed(TILES, rng))(w, d)
    floor = np.ascontiguousarray(floor)
    if rng.random() < RUG_SHARE:
        _rug(floor, rng, (w, d))
    return floor


def random_wallpaper(rng: np.random.Generator) -> Material:
    """Paint, stripes or a repeated motif."""
    rgb = mixed(PAPERS, rng)
    kind = int(rng.integers(4))
    if kind < 2:
        return plaster(rng, rgb, mm_per_px=6.0)
    accent = mixed(COLOURS, rng)
    pitch = float(rng.uniform(0.12, 0.4))
    strength = float(rng.uniform(0.15, 0.5))

    def make(width_m: float, height_m: float) -> Picture:
        shape = size_px(width_m, height_m, 6.0)
        ground = tinted(rgb, 0.01 * noise(rng, shape, cell_px=(2, 2))).astype(np.float32)
        y, x = np.mgrid[0 : shape[0], 0 : shape[1]] * (0.006 / pitch)
        if kind == 2:
            ink = (x % 1.0 < 0.3).astype(np.float32)
        else:
            shift = np.floor(y) % 2 * 0.5
            ink = (np.hypot((x + shift) % 1.0 - 0.5, y % 1.0 - 0.5) < 0.22).astype(np.float32)
        soft: NDArray[np.float32] = np.asarray(cv2.GaussianBlur(ink, (0, 0), 0.8), dtype=np.float32)
        share = strength * soft[..., None]
        mixed_in = ground * (1 - share) + share * np.array(accent, np.float32)
        return mixed_in.clip(0, 255).astype(np.uint8)

    return make


def _carpet(rng: np.random.Generator, rgb: Rgb) -> Material:
    def make(width_m: float, height_m: float) -> Picture:
        shape = size_px(width_m, height_m, 5.0)
        speckle = rng.normal(0, 0.06, shape).astype(np.float32)
        return tinted(rgb, speckle + 0.03 * noise(rng, shape, cell_px=(60, 60)))

    return make


def _tiles(rng: np.random.Generator, rgb: Rgb) -> Material:
    side_m = float(rng.uniform(0.2, 0.6))

    def make(width_m: float, height_m: float) -> Picture:
        shape = size_px(width_m, height_m, 4.0)
        side = round(side_m * 250)
        rows, columns = shape[0] // side + 1, shape[1] // side + 1
        tone = rng.normal(0, 0.04, (rows, columns)).repeat(side, axis=0).repeat(side, axis=1)
        shade = tone[: shape[0], : shape[1]] + 0.02 * noise(rng, shape, cell_px=(20, 20))
        shade[::side], shade[1::side] = -0.25, -0.2
        shade[:, ::side], shade[:, 1::side] = -0.25, -0.2
        return tinted(rgb, shade)

    return make


def _concrete(rng: np.random.Generator, rgb: Rgb) -> Material:
    def make(width_m: float, height_m: float) -> Picture:
        shape = size_px(width_m, height_m, 5.0)
        slow = 0.06 * noise(rng, shape, cell_px=(90, 90)) + 0.03 * noise(rng, shape, cell_px=(9, 9))
        return tinted(rgb, slow)

    return make


def _rug(floor: Picture, rng: np.random.Generator, size_m: tuple[float, float]) -> None:
    """A rug of 1.4 to 2.4 m somewhere on the floor, in colours of its own."""
    per_m = int(floor.shape[1]) / size_m[0]
    h, w = (
        round(float(rng.uniform(1.0, 1.6)) * per_m),
        round(float(rng.uniform(1.4, 2.4)) * per_m),
    )
    long, wide = int(floor.shape[0]), int(floor.shape[1])
    h, w = min(h, long - 8), min(w, wide - 8)
    y, x = int(rng.integers(4, long - h)), int(rng.integers(4, wide - w))
    tint = rng.uniform(0.75, 1.2, 3)
    channels = rng.permutation(3)
    rug = np.clip(woven(rng, h, w)[..., channels] * tint, 0, 255)
    floor[y : y + h, x : x + w] = rug.astype(np.uint8)
