"""The parts of photos that show a region of the room, at the photos' own resolution.

A photo's exposure is not kept with a room. It is found again where the room is drawn beside the
photo, and taken out of the part that is trained on: what is left is in the room's own colours.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.prepare.reconstruction import View, read_picture
from scenes.prepare.train.training_photos import smaller
from scenes.render.renderer import PosedSplats, Renderer, Rendering, RenderOptions
from scenes.render.training import DepthBounds, TrainingTarget
from scenes.splats import SH_C0, SplatCloud

BoolArray = NDArray[np.bool_]
FloatArray = NDArray[np.float64]
Box = tuple[int, int, int, int]
"""Left, top, right, bottom of a part of a picture, px."""

LOOK_PX = 320
"""Longer side of the pictures in which a region is looked for and a photo's exposure is found."""
SHARE = 0.1
"""Share of a pixel's light from which on the region is in it: its soft rim, too."""
RIM_PX = 3
"""Around the region a crop shows so much of the photo, and beyond it the room as it is drawn: with
the photo everywhere, a book's splats went to sharpen the table (12 % of them instead of 4 %)."""
MARGIN = 0.12
"""Of a region's extent in a photo, added on each side: what is beside it is drawn as well."""
MIN_MARGIN_PX = 12
"""The same at least: SSIM's window reaches 5 px beyond a pixel."""
MIN_SHOWN_PX = 150
"""Photo pixels that show the region, at least: 12 × 12, about SSIM's window."""
MAX_CROP_PX = 480
"""Longer side of a crop; what fills more of a photo is trained on at this size. Twice as large
takes four times as long, and has more pixels than the splats can follow."""
MIN_CROPS = 2
"""Photos that have to show a region: one says nothing about its depth."""
MAX_CROPS = 40
"""Photos used of those that show a region, the ones that show most pixels of it."""
BLACK, WHITE = 0.02, 0.98
"""Photo values beyond these are clipped and say nothing about exposure."""
OUTLIER, REFITS = 2.5, 3
"""Pixels off by more than so many medians are left out of the exposure's next fit: what is drawn
wrongly there is not its exposure."""
SAMPLE_EVERY = 4
"""Of these small pictures' pixels, every so many across and down are asked for the exposure."""
RIDGE = 1e-4
"""Pull of the falloff to none, per value compared: where a room is drawn wrongly or all but black,
its colours say nothing of the lens."""
MIN_GAIN = 0.05
"""A gain below this is none of a photo that shows the room."""


@dataclass(frozen=True, slots=True, eq=False)
class Crop:
    """Part of a photo.

    Attributes:
        name: the photo's.
        photo: (H, W, 3) uint8 RGB, in the colours of the room.
        picture: the same near the region, and the room as it is drawn elsewhere: to train on.
        near: (H, W) bool, where that is.
        camera: the photo's lens, moved to this part.
        world_from_camera: where the photo was taken.
        shown_px: pixels of the photo in which most of the light is the region's.
    """

    name: str
    photo: NDArray[np.uint8]
    picture: NDArray[np.uint8]
    near: BoolArray
    camera: Pinhole | Fisheye
    world_from_camera: Pose
    shown_px: int

    def target(self, bounds: DepthBounds | None = None) -> TrainingTarget:
        """Ready to be compared with."""
        return TrainingTarget(self.picture, self.camera, self.world_from_camera, bounds)


def crops_of(
    room: SplatCloud,
    is_region: BoolArray,
    *,
    views: Sequence[View],
    renderer: Renderer,
    options: RenderOptions,
) -> list[Crop]:
    """The parts of photos that show a region, most pixels first; none of photos that hide it.

    Args:
        room: world frame.
        is_region: (N,) bool, its splats that are the region.
        views: photos with poses.
        renderer: draws the room at each.
        options: how.

    Raises:
        ValueError: a photo is missing or no picture.
    """
    sh = np.zeros((len(room), 1, 3), np.float32)
    sh[:, 0] = np.where(is_region, 0.5, -0.5)[:, None] / SH_C0
    drawn = _Drawn(room, replace(room, sh=sh), renderer, options)
    means = room.means[is_region].astype(np.float64)
    looks = [
        look
        for view in views
        if view.camera.project(view.world_from_camera.inverse() @ means)[1].any()
        and (look := _look(drawn, view)) is not None
    ]
    if not looks:
        return []
    looks.sort(key=lambda look: -look.shown_px)
    falloff = _falloff(looks)
    return [_cut_out(drawn, look, falloff=falloff) for look in looks[:MAX_CROPS]]


@dataclass(frozen=True, slots=True, eq=False)
class _Drawn:
    """The room, ready to be drawn as it is and with the region white on black."""

    room: SplatCloud
    marked: SplatCloud
    renderer: Renderer
    options: RenderOptions

    def at(self, camera: Pinhole | Fisheye, world_from_camera: Pose) -> Rendering:
        """The room, from where a photo was taken."""
        posed = [PosedSplats(self.room, Pose.identity())]
        return self.renderer.render(posed, camera, world_from_camera, self.options)

    def share(self, camera: Pinhole | Fisheye, world_from_camera: Pose) -> NDArray[np.float32]:
        """(H, W) share of each pixel's light that is the region's."""
        posed = [PosedSplats(self.marked, Pose.identity())]
        return self.renderer.render(posed, camera, world_from_camera, self.options).rgb[..., 0]


@dataclass(frozen=True, slots=True, eq=False)
class _Look:
    """A photo that shows the region.

    Attributes:
        view: whose it is.
        box_px: around the region, with a margin.
        shown_px: see `Crop`.
        photo: as it is stored.
        drawn: (M, 3) the room as it is drawn, 0..1, at some pixels of the whole photo.
        seen: (M, 3) the photo there.
        powers: (M, 2) r² and r⁴ there, r = 1 at the photo's corners.
    """

    view: View
    box_px: Box
    shown_px: int
    photo: NDArray[np.uint8]
    drawn: FloatArray
    seen: FloatArray
    powers: FloatArray


def _look(drawn: _Drawn, view: View) -> _Look | None:
    """None where the region is hidden or tiny."""
    full, pose = view.camera, view.world_from_camera
    camera = smaller(full, max(1.0, max(full.width_px, full.height_px) / LOOK_PX))
    scale = full.width_px / camera.width_px
    share = drawn.share(camera, pose)
    shown_px = round(float((share > 0.5).sum()) * scale**2)
    if shown_px < MIN_SHOWN_PX:
        return None
    photo = read_picture(view)
    size = (camera.width_px, camera.height_px)
    small = cv2.resize(photo, size, interpolation=cv2.INTER_AREA).astype(np.float64) / 255
    room = drawn.at(camera, pose).rgb.astype(np.float64)
    powers = _powers(size, (0, 0, *size))
    asked = (slice(None, None, SAMPLE_EVERY), slice(None, None, SAMPLE_EVERY))
    rows, columns = np.nonzero(share > SHARE)
    edges = (columns.min(), rows.min(), columns.max() + 1, rows.max() + 1)
    left, top, right, bottom = (round(scale * float(edge)) for edge in edges)
    x = max(round(MARGIN * (right - left)), MIN_MARGIN_PX)
    y = max(round(MARGIN * (bottom - top)), MIN_MARGIN_PX)
    right, bottom = min(right + x, full.width_px), min(bottom + y, full.height_px)
    return _Look(
        view,
        (max(left - x, 0), max(top - y, 0), right, bottom),
        shown_px,
        photo,
        room[asked].reshape(-1, 3),
        small[asked].reshape(-1, 3),
        powers[asked].reshape(-1, 2),
    )


def _cut_out(drawn: _Drawn, look: _Look, *, falloff: FloatArray) -> Crop:
    """The part of a photo, without its exposure: (photo - bias) / (gain · falloff)."""
    left, top, right, bottom = look.box_px
    full, pose = look.view.camera, look.view.world_from_camera
    gain, bias = _gains(look, falloff).T
    shade = 1 + _powers((full.width_px, full.height_px), look.box_px) @ falloff
    gains = gain * shade[..., None]
    part = look.photo[top:bottom, left:right].astype(np.float64) / 255
    colours = np.clip((part - bias) / np.maximum(gains, MIN_GAIN), 0, 1).astype(np.float32)
    camera = replace(
        full,
        width_px=right - left,
        height_px=bottom - top,
        cx=full.cx - left,
        cy=full.cy - top,
    )
    longest = max(camera.width_px, camera.height_px)
    if longest > MAX_CROP_PX:
        camera = smaller(camera, longest / MAX_CROP_PX)
        size = (camera.width_px, camera.height_px)
        colours = np.asarray(
            cv2.resize(colours, size, interpolation=cv2.INTER_AREA), dtype=np.float32
        )
    side = 2 * RIM_PX + 1
    share = (drawn.share(camera, pose) > SHARE).astype(np.uint8)
    near = np.asarray(cv2.dilate(share, np.ones((side, side), np.uint8)) > 0)
    photo = _bytes(colours)
    picture = np.where(near[..., None], photo, _bytes(drawn.at(camera, pose).rgb))
    return Crop(look.view.name, photo, picture, near, camera, pose, look.shown_px)


def _falloff(looks: Sequence[_Look]) -> FloatArray:
    """(2,) f₀ and f₁ of 1 + f₀ r² + f₁ r⁴, one lens for all photos, by least squares.

    Gains and biases are each photo's own; they and the falloff are found in turn.
    """
    falloff = np.zeros(2)
    for _ in range(REFITS):
        left, right = np.zeros((2, 2)), np.zeros(2)
        for look in looks:
            shade = 1 + look.powers @ falloff
            for x, y, (gain, bias) in zip(
                look.drawn.T, look.seen.T, _gains(look, falloff), strict=True
            ):
                off = y - gain * shade * x - bias
                kept = np.abs(off) <= OUTLIER * np.median(np.abs(off))
                design = gain * x[kept, None] * look.powers[kept]
                left += design.T @ design
                right += design.T @ (y[kept] - gain * x[kept] - bias)
        ridge = RIDGE * sum(look.seen.size for look in looks)
        solved = np.linalg.solve(left + ridge * np.eye(2), right)
        falloff = np.asarray(solved, dtype=np.float64)
    return falloff


def _gains(look: _Look, falloff: FloatArray) -> FloatArray:
    """(3, 2) gain and bias of each channel of a photo, robustly."""
    shade = 1 + look.powers @ falloff
    out = np.empty((3, 2))
    for channel in range(3):
        x, y = shade * look.drawn[:, channel], look.seen[:, channel]
        design = np.column_stack([x, np.ones_like(x)])
        kept, found = (y > BLACK) & (y < WHITE), np.array([1.0, 0.0])
        for _ in range(REFITS):
            found = np.linalg.lstsq(design[kept], y[kept], rcond=None)[0]
            off = np.abs(design @ found - y)
            kept = off <= OUTLIER * max(float(np.median(off)), 1 / 255)
        out[channel] = found
    return out


def _powers(size_px: tuple[int, int], box: Box) -> FloatArray:
    """(H, W, 2) r² and r⁴ of a part of a picture, r = 1 at the picture's corners."""
    (width, height), (left, top, right, bottom) = size_px, box
    x = np.arange(left, right) + 0.5 - width / 2
    y = np.arange(top, bottom) + 0.5 - height / 2
    square = (x**2 + y[:, None] ** 2) / (width**2 / 4 + height**2 / 4)
    return np.stack([square, square**2], axis=2)


def _bytes(colours: NDArray[np.float32]) -> NDArray[np.uint8]:
    return np.round(255 * np.clip(colours, 0, 1)).astype(np.uint8)
