"""One lens's picture as layers: the empty room, then what rests in it, then what moves.

Each layer holds colour, range and body numbers on a grid finer than the sensor. A frame redraws
only rectangles around what moves; the depth test against the layer below decides what is hidden.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np
from cv2.typing import MatLike
from numpy.typing import NDArray

from scenes.cameras import Fisheye, pixel_centres
from scenes.pose import Pose
from sim.bodies import Placement
from sim.camera.lens_raster import UNLIT, FisheyeRasteriser, PixelRect
from sim.camera.shadows import ShadowMap

ROOM_ID = 0
SHADOW_STEP = 8
SHADOW_LEVELS = 255.0
SHADOW_BAND = 8
"""Rows of blocks of `SHADOW_STEP` pixels that are darkened at a time."""
RECT_PAD = 6
ROOM_SHIFTS = ((0.0, 0.0), (-0.375, -0.125), (0.125, -0.375), (0.375, 0.125), (-0.125, 0.375))


Drawn = tuple[NDArray[np.uint8], NDArray[np.float32]]
"""(h, w, 3) RGB and (h, w) range in metres, inf where nothing is."""

DrawAlone = Callable[[PixelRect], Drawn]
"""Draws one body with nothing else in a rectangle of the fine grid."""


@dataclass(frozen=True, slots=True)
class Tolerances:
    """How exactly the depth of what lies below is known.

    Attributes:
        contact_m: a body hides what is less than so much nearer: what it stands on.
        shadow_m: a shadow falls on what is at most so far from the plane that takes it.
    """

    contact_m: float = 0.002
    shadow_m: float = 0.025


@dataclass(frozen=True, slots=True, eq=False)
class Layer:
    """Arrays over a rectangle of the fine grid, all of the same height and width.

    Attributes:
        rgb: (h, w, 3) uint8.
        range_m: (h, w) float32, distance from the lens; inf where nothing is.
        ids: (h, w) uint8, `ROOM_ID` or the number of the body seen.
    """

    rgb: NDArray[np.uint8]
    range_m: NDArray[np.float32]
    ids: NDArray[np.uint8]

    def part(self, rect: PixelRect) -> Layer:
        """A view of a rectangle of a whole-lens layer."""
        where = rect.rows_columns
        return Layer(self.rgb[where], self.range_m[where], self.ids[where])

    def copy(self) -> Layer:
        """The same in arrays of its own."""
        return Layer(self.rgb.copy(), self.range_m.copy(), self.ids.copy())


@dataclass(frozen=True, slots=True, eq=False)
class DrawnBody:
    """One body drawn alone through one lens.

    Attributes:
        number: its number in `Layer.ids`, from 1.
        rect: where it may be seen on the fine grid; None if outside the lens.
        rgb: (h, w, 3) uint8 over `rect`.
        range_m: (h, w) float32 over `rect`, inf where the body is not.
        alone_px: fine pixels it would cover with nothing in front.
        shadow: what it does to the surface it stands on.
        shadow_rect: where that may be seen, or None.
    """

    number: int
    rect: PixelRect | None
    rgb: NDArray[np.uint8]
    range_m: NDArray[np.float32]
    alone_px: int
    shadow: ShadowMap
    shadow_rect: PixelRect | None

    @property
    def touched(self) -> tuple[PixelRect, ...]:
        """Every rectangle that changes when this body changes."""
        return tuple(rect for rect in (self.rect, self.shadow_rect) if rect is not None)


def fine_lens(lens: Fisheye, supersampling: int) -> Fisheye:
    """The same lens with `supersampling`² grid points to the pixel."""
    return lens.resized(lens.width_px * supersampling, lens.height_px * supersampling)


def draw_room(
    rasteriser: FisheyeRasteriser, numbers: Sequence[int], lens: Fisheye, lens_from_world: Pose
) -> Layer:
    """The room without anything movable; colour is the mean of several samples a grid point."""
    rect = PixelRect(0, 0, lens.width_px, lens.height_px)
    parts = [(number, lens_from_world) for number in numbers]
    total, range_m = rasteriser.draw(parts, lens, rect, light=UNLIT, shift_px=ROOM_SHIFTS[0])
    total = total.astype(np.uint16)
    for shift in ROOM_SHIFTS[1:]:
        rgb, _ = rasteriser.draw(parts, lens, rect, light=UNLIT, shift_px=shift)
        total += rgb
    mean = ((total + len(ROOM_SHIFTS) // 2) // len(ROOM_SHIFTS)).astype(np.uint8)
    return Layer(mean, range_m, np.full(range_m.shape, ROOM_ID, np.uint8))


def compose_nearer(below: Layer, above: Layer) -> Layer:
    """Compose two layers of the same lens: the nearer of both."""
    nearer = above.range_m < below.range_m
    rgb = np.where(nearer[..., None], above.rgb, below.rgb)
    return Layer(rgb, np.where(nearer, above.range_m, below.range_m), below.ids)


def draw_body(
    draw: DrawAlone,
    outline_in_lens: NDArray[np.float64],
    lens: Fisheye,
    *,
    number: int,
    shadow: ShadowMap,
    lens_from_world: Pose,
) -> DrawnBody:
    """Draw one body alone and find where its shadow can be seen.

    Args:
        draw: draws the body's surfaces in a rectangle of the fine grid.
        outline_in_lens: (N, 3) points whose picture spans the body's.
        lens: on the fine grid.
        number: the body's number in the layers, 1..255.
        shadow: on the surface it stands on.
        lens_from_world: to place the shadow.
    """
    rect = _seen_rect(outline_in_lens, lens)
    if rect is None:
        rgb = np.zeros((0, 0, 3), np.uint8)
        range_m = np.zeros((0, 0), np.float32)
    else:
        rgb, range_m = draw(rect)
    return DrawnBody(
        number,
        rect,
        rgb,
        range_m,
        int(np.count_nonzero(range_m < np.inf)),
        shadow,
        _seen_rect(lens_from_world @ _dark_points(shadow), lens),
    )


def compose(
    below: Layer,
    rect: PixelRect,
    bodies: Sequence[DrawnBody],
    *,
    lens: Fisheye,
    lens_from_world: Pose,
    tolerances: Tolerances,
) -> Layer:
    """Put bodies and their shadows over a rectangle of a whole-lens layer, which stays as it is."""
    layer = below.part(rect).copy()
    for body in bodies:
        overlap = _overlap(rect, body.shadow_rect)
        if overlap is not None:
            target = _within(layer, rect, overlap)
            _darken(target, overlap, body.shadow, lens, lens_from_world, tolerances.shadow_m)
    for body in bodies:
        overlap = _overlap(rect, body.rect)
        if overlap is None or body.rect is None:
            continue
        inner = PixelRect(
            overlap.x0 - body.rect.x0,
            overlap.y0 - body.rect.y0,
            overlap.x1 - body.rect.x0,
            overlap.y1 - body.rect.y0,
        ).rows_columns
        target = _within(layer, rect, overlap)
        range_m = body.range_m[inner]
        nearer = (range_m < target.range_m + np.float32(tolerances.contact_m)).view(np.uint8)
        cv2.copyTo(np.ascontiguousarray(body.rgb[inner]), nearer, target.rgb)
        np.copyto(target.range_m, range_m, where=nearer.view(np.bool_))
        target.ids[nearer.view(np.bool_)] = body.number
    return layer


def clusters(rects: Sequence[PixelRect], grid: int) -> list[PixelRect]:
    """Grow and join rectangles until none overlap; borders lie on multiples of `grid`."""
    pending = [
        PixelRect(r.x0 // grid * grid, r.y0 // grid * grid, -(-r.x1 // grid) * grid,
                  -(-r.y1 // grid) * grid)
        for r in rects
    ]  # fmt: skip
    apart: list[PixelRect] = []
    while pending:
        rect = pending.pop()
        hit = next((other for other in apart if _overlap(rect, other) is not None), None)
        if hit is None:
            apart.append(rect)
        else:
            apart.remove(hit)
            pending.append(
                PixelRect(
                    min(rect.x0, hit.x0), min(rect.y0, hit.y0),
                    max(rect.x1, hit.x1), max(rect.y1, hit.y1),
                )
            )  # fmt: skip
    return sorted(apart, key=lambda r: (r.y0, r.x0))


def _within(layer: Layer, rect: PixelRect, part: PixelRect) -> Layer:
    """The view of `part` in a layer that covers `rect`."""
    return layer.part(
        PixelRect(part.x0 - rect.x0, part.y0 - rect.y0, part.x1 - rect.x0, part.y1 - rect.y0)
    )


def _overlap(a: PixelRect, b: PixelRect | None) -> PixelRect | None:
    if b is None:
        return None
    x0, y0, x1, y1 = max(a.x0, b.x0), max(a.y0, b.y0), min(a.x1, b.x1), min(a.y1, b.y1)
    return PixelRect(x0, y0, x1, y1) if x0 < x1 and y0 < y1 else None


def _seen_rect(points_in_lens: NDArray[np.float64], lens: Fisheye) -> PixelRect | None:
    """Bounding rectangle of the points within the lens circle, padded and clipped; None if none."""
    off_axis = np.hypot(points_in_lens[:, 0], points_in_lens[:, 1])
    theta = np.arctan2(off_axis, points_in_lens[:, 2])
    if not len(theta) or theta.min() > lens.max_angle:
        return None
    seen = theta < lens.max_angle + 0.15
    scale = lens.radius_px(theta[seen]) / np.maximum(off_axis[seen], 1e-12)
    x = scale * points_in_lens[seen, 0] + lens.cx
    y = scale * points_in_lens[seen, 1] + lens.cy
    x0 = max(0, math.floor(x.min()) - RECT_PAD)
    y0 = max(0, math.floor(y.min()) - RECT_PAD)
    x1 = min(lens.width_px, math.ceil(x.max()) + RECT_PAD)
    y1 = min(lens.height_px, math.ceil(y.max()) + RECT_PAD)
    return PixelRect(x0, y0, x1, y1) if x0 < x1 and y0 < y1 else None


def _dark_points(shadow: ShadowMap) -> NDArray[np.float64]:
    """(N, 3) world points on the surface that span the visible part of a shadow."""
    rows, columns = np.nonzero(shadow.light < 1.0 - 1.5 / SHADOW_LEVELS)
    if len(rows) == 0:
        return np.zeros((0, 3))
    x = np.linspace(float(columns.min()), float(columns.max()) + 1.0, 12)
    y = np.linspace(float(rows.min()), float(rows.max()) + 1.0, 12)
    cells = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    height = np.full((len(cells), 1), shadow.plane_z_m)
    return np.hstack([shadow.low_xy + cells * shadow.cell_m, height])


def _darken(
    layer: Layer,
    rect: PixelRect,
    shadow: ShadowMap,
    lens: Fisheye,
    lens_from_world: Pose,
    tolerance_m: float,
) -> None:
    """Multiply the surface under a body by the light its shadow leaves, in place."""
    rays, shape = _node_rays(rect, lens)
    world_from_lens = lens_from_world.inverse()
    rays = rays @ world_from_lens.rotation.T
    eye = world_from_lens.translation
    plane_range = (shadow.plane_z_m - eye[2]) / np.minimum(rays[:, 2], -1e-3)
    hit = eye[:2] + plane_range[:, None] * rays[:, :2]
    cells = ((hit - shadow.low_xy) / shadow.cell_m - 0.5).astype(np.float32)
    light = cv2.remap(
        shadow.light * np.float32(SHADOW_LEVELS),
        np.ascontiguousarray(cells[:, 0].reshape(shape)),
        np.ascontiguousarray(cells[:, 1].reshape(shape)),
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=SHADOW_LEVELS,
    )
    distance = plane_range.reshape(shape).astype(np.float32)
    for part, nodes in _dark_parts(light, rect):
        _darken_part(
            _within(layer, rect, part),
            _between_nodes(np.ascontiguousarray(light[nodes]), part),
            _between_nodes(np.ascontiguousarray(distance[nodes]), part),
            tolerance_m,
        )


def _dark_parts(light: MatLike, rect: PixelRect) -> Iterator[tuple[PixelRect, tuple[slice, slice]]]:
    """Parts of `rect` that hold every pixel a shadow darkens, and the nodes around each of them.

    Args:
        light: at the nodes of `_node_rays`, of `SHADOW_LEVELS`.
        rect: the rectangle of those nodes.
    """
    # What lies between nodes of nearly full light is rounded to full light.
    dark = light < SHADOW_LEVELS - 0.25
    block_rows, block_columns = dark.shape[0] - 2, dark.shape[1] - 2
    for top in range(0, block_rows, SHADOW_BAND):
        bottom = min(top + SHADOW_BAND, block_rows)
        columns = np.flatnonzero(dark[top : bottom + 2].any(axis=0))
        if len(columns) == 0:
            continue
        # The node in the middle of block b has the number b + 1, and reaches the blocks beside.
        left = max(0, int(columns[0]) - 2)
        right = min(block_columns, int(columns[-1]) + 1)
        if left >= right:
            continue
        part = PixelRect(
            rect.x0 + SHADOW_STEP * left,
            rect.y0 + SHADOW_STEP * top,
            min(rect.x1, rect.x0 + SHADOW_STEP * right),
            min(rect.y1, rect.y0 + SHADOW_STEP * bottom),
        )
        yield part, (slice(top, bottom + 2), slice(left, right + 2))


def _darken_part(layer: Layer, factor: MatLike, distance: MatLike, tolerance_m: float) -> None:
    """Multiply what lies on the plane, at `distance`, by `factor` of `SHADOW_LEVELS`, in place."""
    off = cv2.absdiff(distance, layer.range_m) > tolerance_m
    off |= layer.ids != ROOM_ID
    # A mask of 255 is full light, too.
    factor8 = cv2.bitwise_or(cv2.convertScaleAbs(factor), off.view(np.uint8) * np.uint8(255))
    if int(factor8.min()) < SHADOW_LEVELS:
        cv2.multiply(layer.rgb, cv2.merge([factor8] * 3), layer.rgb, 1.0 / SHADOW_LEVELS)


def _node_rays(rect: PixelRect, lens: Fisheye) -> tuple[NDArray[np.float64], tuple[int, int]]:
    """Rays through the middles of blocks of pixels, one block more than `rect` on every side."""
    columns = -(-rect.width_px // SHADOW_STEP) + 2
    rows = -(-rect.height_px // SHADOW_STEP) + 2
    x = rect.x0 + SHADOW_STEP * (np.arange(columns) - 0.5)
    y = rect.y0 + SHADOW_STEP * (np.arange(rows) - 0.5)
    grid_x, grid_y = np.meshgrid(x, y)
    return lens.unproject(np.stack([grid_x.ravel(), grid_y.ravel()], axis=1)), (rows, columns)


def _between_nodes(nodes: MatLike, rect: PixelRect) -> MatLike:
    """Bilinear values at the pixel centres of `rect` from those at the nodes of `_node_rays`."""
    rows, columns = nodes.shape[:2]
    size = (columns * SHADOW_STEP, rows * SHADOW_STEP)
    fine = cv2.resize(nodes, size, interpolation=cv2.INTER_LINEAR)
    inner = slice(SHADOW_STEP, SHADOW_STEP + rect.height_px)
    return fine[inner, SHADOW_STEP : SHADOW_STEP + rect.width_px]


def lens_circle(lens: Fisheye) -> NDArray[np.bool_]:
    """(H, W): pixel centres within the lens's field of view."""
    offset = pixel_centres(lens) - (lens.cx, lens.cy)
    inside = np.hypot(offset[:, 0], offset[:, 1]) <= lens.circle_px
    return inside.reshape(lens.height_px, lens.width_px)


class ScannedLook(Protocol):
    """Draws what is known only from photos: a scanned room and its objects."""

    @property
    def tolerances(self) -> Tolerances:
        """How exactly its depths are known."""
        ...

    def draws(self, body_id: str) -> bool:
        """Whether a body has to be drawn by it."""
        ...

    def room(self, lens: Fisheye, world_from_lens: Pose) -> Layer:
        """The room without anything movable, over the whole lens."""
        ...

    def body(
        self,
        body_id: str,
        lens: Fisheye,
        lens_from_world: Pose,
        placement: Placement,
        rect: PixelRect,
    ) -> Drawn:
        """One body alone in a rectangle of the lens, in the light where it stands."""
        ...
