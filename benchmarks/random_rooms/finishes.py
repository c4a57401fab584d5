"""Finishes of random objects: plain, patterned, dark or shiny.

The highlights of shiny ones lie where light and view put them, so they change with both.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.samples.pictures.textures import Rgb, fabric, mixed, noise, size_px, tinted, wood
from scenes.samples.shapes import Material, Picture, Surface

FloatArray = NDArray[np.float64]

PLAIN, PATTERNED, DARK, SHINY = "plain", "patterned", "dark", "shiny"
SHARES = {PLAIN: 0.35, PATTERNED: 0.35, DARK: 0.15, SHINY: 0.15}
"""How often each finish is drawn; half of the objects show a tracker little texture."""

MM_PER_PX = 3.0
"""Fineness of printed patterns: a pixel of the lens at 1 m shows 2 to 5 mm."""

COLOURS: tuple[Rgb, ...] = (
    (196, 62, 54), (222, 140, 46), (232, 198, 84), (96, 150, 86), (58, 120, 122), (66, 104, 168),
    (120, 86, 150), (206, 140, 150), (158, 116, 82), (128, 130, 132), (208, 202, 190),
    (232, 230, 224), (176, 190, 200), (92, 100, 66), (150, 60, 84),
)  # fmt: skip
DARKS: tuple[Rgb, ...] = ((34, 34, 36), (42, 36, 32), (30, 36, 46), (38, 42, 36), (50, 46, 46))
WOODS: tuple[Rgb, ...] = ((206, 170, 120), (158, 112, 72), (104, 74, 52), (226, 208, 176))

SHARP = 40.0
"""Exponent of the highlight that one camera sees (Blinn 1977); lacquer and glazes have 20 to
100."""

BLURRED = 9.0
"""The same in a scan, which averages the highlights of views from all around."""

SCAN_SHARE = 0.35
"""How much of a highlight is left in that average."""


@dataclass(frozen=True, slots=True, eq=False)
class Finish:
    """How a surface looks.

    Attributes:
        name: "plain", "patterned", "dark" or "shiny".
        rgb: its main colour.
        material: its picture.
        gloss: strength of highlights, 0..1.
    """

    name: str
    rgb: Rgb
    material: Material
    gloss: float = 0.0

    @property
    def is_even(self) -> bool:
        """Whether it looks the same all over, so that the shape alone decides the symmetry."""
        return self.name != PATTERNED


def random_finish(rng: np.random.Generator, *, kinds: tuple[str, ...] = tuple(SHARES)) -> Finish:
    """Some finish of these kinds."""
    shares = np.array([SHARES[kind] for kind in kinds])
    name = kinds[int(rng.choice(len(kinds), p=shares / shares.sum()))]
    if name == PATTERNED:
        rgb = mixed(COLOURS, rng)
        return Finish(name, rgb, random_pattern(rng, rgb))
    rgb = mixed(DARKS if name == DARK else COLOURS, rng)
    gloss = float(rng.uniform(0.35, 0.8)) if name == SHINY else 0.0
    return Finish(name, rgb, smooth(rng, rgb), gloss)


def smooth(rng: np.random.Generator, rgb: Rgb) -> Material:
    """One colour with a grain too fine to follow, as of cloth or of powder coating."""
    return fabric(rng, rgb, mm_per_px=4.0)


def random_wood(rng: np.random.Generator) -> Material:
    """Some planed wood."""
    return wood(rng, mixed(WOODS, rng), contrast=float(rng.uniform(0.5, 1.3)))


def random_pattern(rng: np.random.Generator, rgb: Rgb) -> Material:
    """Stripes, dots, patches or triangles at random: never the same at two yaws of an object."""
    draws = (_stripes, _dots, _patches, _triangles)
    draw = draws[int(rng.integers(len(draws)))]
    others = [mixed(COLOURS, rng) for _ in range(3)]

    def make(width_m: float, height_m: float) -> Picture:
        shape = size_px(width_m, height_m, MM_PER_PX)
        ground = tinted(rgb, 0.02 * noise(rng, shape, cell_px=(3, 3)))
        picture = np.ascontiguousarray(ground)
        draw(picture, others, rng)
        return picture

    return make


Draw = Callable[[Picture, list[Rgb], np.random.Generator], None]


def _stripes(picture: Picture, colours: list[Rgb], rng: np.random.Generator) -> None:
    """Upright stripes of uneven width."""
    x, width = 0, picture.shape[1]
    while x < width:
        step = int(rng.uniform(4, 26))
        if rng.random() < 0.55:
            picture[:, x : x + step] = colours[int(rng.integers(len(colours)))]
        x += step


def _dots(picture: Picture, colours: list[Rgb], rng: np.random.Generator) -> None:
    for _ in range(_count(picture, 30.0)):
        centre = _point(picture, rng)
        colour = colours[int(rng.integers(len(colours)))]
        cv2.circle(picture, centre, int(rng.integers(3, 11)), colour, -1, cv2.LINE_AA)


def _patches(picture: Picture, colours: list[Rgb], rng: np.random.Generator) -> None:
    for _ in range(_count(picture, 42.0)):
        x, y = _point(picture, rng)
        w, h = (int(v) for v in rng.integers(6, 34, 2))
        colour = colours[int(rng.integers(len(colours)))]
        cv2.rectangle(picture, (x, y), (x + w, y + h), colour, -1)


def _triangles(picture: Picture, colours: list[Rgb], rng: np.random.Generator) -> None:
    for _ in range(_count(picture, 40.0)):
        offsets = rng.integers(-22, 22, (3, 2))
        corners: NDArray[np.int32] = np.asarray(_point(picture, rng) + offsets, dtype=np.int32)
        colour = colours[int(rng.integers(len(colours)))]
        cv2.fillConvexPoly(picture, corners, colour, cv2.LINE_AA)


def _count(picture: Picture, pitch_px: float) -> int:
    return max(3, round(picture.shape[0] * picture.shape[1] / pitch_px**2))


def _point(picture: Picture, rng: np.random.Generator) -> tuple[int, int]:
    return int(rng.integers(int(picture.shape[1]))), int(rng.integers(int(picture.shape[0])))


def add_highlight(
    surfaces: Sequence[Surface], halfway: FloatArray, strength: float
) -> tuple[Surface, ...]:
    """The surfaces with the highlight that one camera sees.

    Args:
        surfaces: of an object.
        halfway: (3,) unit vector between the directions to light and camera, in the object's frame.
        strength: 0..1 of full white.
    """
    return _add_highlight(surfaces, halfway, strength, SHARP)


def add_scanned_highlight(
    surfaces: Sequence[Surface], halfway: FloatArray, strength: float
) -> tuple[Surface, ...]:
    """The surfaces with the pale, wide highlight of a scan; arguments as in `add_highlight`."""
    return _add_highlight(surfaces, halfway, SCAN_SHARE * strength, BLURRED)


def _add_highlight(
    surfaces: Sequence[Surface], halfway: FloatArray, strength: float, exponent: float
) -> tuple[Surface, ...]:
    if strength <= 0:
        return tuple(surfaces)
    result: list[Surface] = []
    for surface in surfaces:
        facing = np.maximum(_normals(surface.points) @ halfway, 0.0)
        height, width = surface.picture.shape[:2]
        smooth = np.asarray(cv2.resize(facing.astype(np.float32), (width, height)))
        added = 255.0 * strength * smooth.reshape(height, width, 1) ** exponent
        bright = np.clip(surface.picture + added, 0, 255).astype(np.uint8)
        result.append(replace(surface, picture=bright))
    return tuple(result)


def _normals(points: FloatArray) -> FloatArray:
    """(R, C, 3) unit normals at the points of a grid; zero where it has no area."""
    down, across = np.gradient(points, axis=0), np.gradient(points, axis=1)
    normals = np.cross(down, across)
    return normals / np.maximum(np.linalg.norm(normals, axis=2, keepdims=True), 1e-12)
