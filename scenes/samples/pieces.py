"""The seven pieces of a tangram: wooden blocks, each with a print of its own."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from scenes.mesh import BoxPart, PhysicalObject
from scenes.pose import Pose
from scenes.samples.pictures.atlas import mesh_from_surfaces
from scenes.samples.pictures.graphics import font
from scenes.samples.pictures.textures import Rgb, noise, plain, tinted
from scenes.samples.shapes import Picture, Surface, cells, quad

FloatArray = NDArray[np.float64]

UNIT_M = 0.08
"""A quarter of the side of the square that all seven make, metres: small enough that the figure
fits a table, large enough that a camera above it sees the smallest piece on some 30 pixels."""
THICK_M = 0.028
"""Height of every piece, metres."""
CELL_M = 0.025
"""Grid pitch of the faces, metres: slanting cells have diagonals below 0.05 m too."""
PX_PER_M = 2000.0
"""Pixels of a print a metre."""
DENSITY_KG_M3 = 600.0
"""Of beech plywood."""
FRICTION = 0.45
HALVINGS = 2
"""How often what boxes leave of a triangle is filled with smaller ones; a tip of a quarter of a leg
stays empty."""
PLY: Rgb = (206, 176, 132)

ROOT = math.sqrt(2.0)
_SMALL = ((-1.0, -0.5), (1.0, -0.5), (0.0, 0.5))


@dataclass(frozen=True, slots=True)
class Design:
    """A piece: its corners in units, counter-clockwise about the middle of their extent.

    Attributes:
        corners: (x, y) in `UNIT_M`; of a triangle, the right angle comes last.
        colour: of the paint.
        mark: printed large.
    """

    corners: tuple[tuple[float, float], ...]
    colour: Rgb
    mark: str


DESIGNS = {
    "large-1": Design(tuple((2 * x, 2 * y) for x, y in _SMALL), (196, 62, 52), "A"),
    "large-2": Design(tuple((2 * x, 2 * y) for x, y in _SMALL), (44, 96, 168), "B"),
    "medium-1": Design(tuple((ROOT * x, ROOT * y) for x, y in _SMALL), (52, 140, 84), "C"),
    "small-1": Design(_SMALL, (214, 136, 40), "D"),
    "small-2": Design(_SMALL, (122, 72, 152), "E"),
    "square-1": Design(
        tuple((x * ROOT / 2, y * ROOT / 2) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))),
        (40, 44, 58),
        "F",
    ),
    "parallelogram-1": Design(
        ((-0.5, -0.5), (1.5, -0.5), (0.5, 0.5), (-1.5, 0.5)), (178, 58, 112), "G"
    ),
}
"""The pieces by object id."""


def piece(object_id: str, world_from_object: Pose) -> PhysicalObject:
    """One of `DESIGNS`, standing somewhere.

    Raises:
        KeyError: no such piece.
    """
    design = DESIGNS[object_id]
    corners = UNIT_M * np.array(design.corners)
    mesh = mesh_from_surfaces(tuple(_surfaces(design, corners)), width_px=1024)
    width, depth = np.ptp(corners, axis=0)
    area = 0.5 * abs(float(_cross(corners, np.roll(corners, -1, axis=0)).sum()))
    return PhysicalObject(
        object_id,
        object_id,
        (mesh,),
        (float(width), float(depth), THICK_M),
        tuple(_parts(corners)),
        DENSITY_KG_M3 * area * THICK_M,
        FRICTION,
        world_from_object,
    )


def _surfaces(design: Design, corners: FloatArray) -> Iterator[Surface]:
    """Top with the print, plain bottom, and a side of bare plywood for every edge."""
    printed = _print(design, corners)
    middle = corners.mean(axis=0)
    sides = plain(PLY)
    for k, corner in enumerate(corners):
        before, after = corners[k - 1], corners[(k + 1) % len(corners)]
        patch = np.stack([middle, (before + corner) / 2, corner, (corner + after) / 2])
        yield _level(patch, THICK_M, printed)
        yield _level(patch[[0, 3, 2, 1]], 0.0, None)
        edge = np.array([*(after - corner), 0.0])
        yield quad((*corner, THICK_M), edge, (0.0, 0.0, -THICK_M), material=sides,
                   cell_m=CELL_M)  # fmt: skip


def _level(patch: FloatArray, z: float, printed: tuple[Picture, FloatArray] | None) -> Surface:
    """A level four-sided face, counter-clockwise seen from outside, that shows its part of a print.

    Args:
        patch: (4, 2) corners in metres.
        z: its height.
        printed: the picture and the place (x, y) of its lower left corner; bare wood if None.
    """
    across = max(float(np.linalg.norm(patch[a] - patch[b])) for a, b in ((3, 0), (2, 1)))
    down = max(float(np.linalg.norm(patch[a] - patch[b])) for a, b in ((1, 0), (2, 3)))
    columns, rows = cells(across, CELL_M), cells(down, CELL_M)
    level = _bilinear(patch, np.linspace(0, 1, columns + 1), np.linspace(0, 1, rows + 1))
    points = np.concatenate([level, np.full((*level.shape[:2], 1), z)], axis=2)
    if printed is None:
        return Surface(points, plain(PLY)(across, down))
    art, low = printed
    width, height = (max(4, round(PX_PER_M * length)) for length in (across, down))
    where = _bilinear(patch, (np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    px = PX_PER_M * (where - low) - 0.5
    u, v = px[..., 0].astype(np.float32), (len(art) - 1 - px[..., 1]).astype(np.float32)
    shown = cv2.remap(art, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return Surface(points, np.asarray(shown, np.uint8))


def _bilinear(patch: FloatArray, s: FloatArray, t: FloatArray) -> FloatArray:
    """(rows, columns, 2) places in a patch whose corners go from the top left down and around."""
    left = patch[0] + t[:, None] * (patch[1] - patch[0])
    right = patch[3] + t[:, None] * (patch[2] - patch[3])
    return left[:, None] + s[None, :, None] * (right - left)[:, None]


def _print(design: Design, corners: FloatArray) -> tuple[Picture, FloatArray]:
    """Draw the print on top; return the place of its lower left corner too. It has no symmetry.

    A pale band along one edge, discs at one corner, a large letter, on painted grain.
    """
    rng = np.random.default_rng(ord(design.mark))
    low = corners.min(axis=0)
    width, height = (int(np.ceil(PX_PER_M * length)) for length in np.ptp(corners, axis=0))
    grain = 0.09 * noise(rng, (height, width), cell_px=(7, 60))
    image = Image.fromarray(tinted(design.colour, grain))
    draw = ImageDraw.Draw(image)
    middle = corners.mean(axis=0)

    def at(x: float, y: float) -> tuple[float, float]:
        return PX_PER_M * (x - low[0]), height - PX_PER_M * (y - low[1])

    pale: Rgb = (238, 230, 208)
    band = [corners[0], corners[1]]
    band += [0.74 * corners[1] + 0.26 * middle, 0.74 * corners[0] + 0.26 * middle]
    draw.polygon([at(*place) for place in band], fill=pale)
    for share, radius in ((0.62, 0.16), (0.3, 0.09)):
        x, y = at(*(share * corners[1] + (1 - share) * middle))
        r = radius * PX_PER_M * UNIT_M
        draw.ellipse((x - r, y - r, x + r, y + r), fill=(30, 32, 38))
    size = round(0.37 * PX_PER_M * float(np.ptp(corners, axis=0).min()))
    draw.text(at(*(0.86 * middle + 0.14 * corners[-1])), design.mark, font=font(size, bold=True),
              fill=pale, anchor="mm")  # fmt: skip
    return np.asarray(image), low


def _parts(corners: FloatArray) -> Iterator[BoxPart]:
    """Solid boxes inside a piece, in its frame."""
    if len(corners) == 3:
        yield from _in_triangle(corners[2], corners[0] - corners[2], corners[1] - corners[2])
        return
    a, b, _, d = corners
    foot = float((d - a) @ (b - a)) / float(np.linalg.norm(b - a)) ** 2 * (b - a)
    if float(np.linalg.norm(foot)) < 1e-9:
        yield _part(a, b - a, d - a)
        return
    # Leaning to the left: a rectangle between two right-angled triangles.
    up = d - a - foot
    yield _part(a, b - a + foot, up)
    yield from _in_triangle(a + up, -up, foot)
    yield from _in_triangle(b + foot, up, -foot)


def _in_triangle(
    right_angle: FloatArray, one: FloatArray, other: FloatArray, halvings: int = HALVINGS
) -> Iterator[BoxPart]:
    """Boxes inside a triangle with a right angle between two edges."""
    if halvings == 0:
        return
    yield _part(right_angle, one / 2, other / 2)
    yield from _in_triangle(right_angle + one / 2, one / 2, other / 2, halvings - 1)
    yield from _in_triangle(right_angle + other / 2, one / 2, other / 2, halvings - 1)


def _part(corner: FloatArray, one: FloatArray, other: FloatArray) -> BoxPart:
    centre = corner + (one + other) / 2
    yaw = math.atan2(float(one[1]), float(one[0]))
    half = (float(np.linalg.norm(one)) / 2, float(np.linalg.norm(other)) / 2, THICK_M / 2)
    return BoxPart(Pose.from_yaw(yaw, (*centre.tolist(), THICK_M / 2)), half)


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
