"""Splats where the photos show something and nothing is drawn yet.

A plain wall gives structure from motion no point and stereo no match. Where nothing is drawn there
is no splat whose error could ask for more of them, so such a wall would stay the background's
colour. It is put on the upright box around everything that is known: nothing in front of the box
can be hidden by it. Photos of a plain wall agree with any depth, so a nearer guess can stay in the
air as a fog that no view kept aside shows, and through which a camera elsewhere sees nothing. What
is photographed from outside, a single object, goes on as what is drawn around the gap does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, pixel_centres
from scenes.harmonics import SH_C0
from scenes.pose import Pose
from scenes.prepare.train.depth.seen_surfaces import CELL_PX, filled
from scenes.prepare.train.training_photos import Photo
from scenes.render.renderer import PosedSplats, Renderer, RenderOptions
from scenes.splats import SplatCloud, concatenate

MAX_PX = 160
"""Longer side of the pictures in which gaps are looked for, px: a cell of `CELL_PX` of them, in
which one splat is put, is then a fortieth of a picture, about as wide as the points that stereo
adds lie apart (`seed.SPACING`) at the distance at which photos see a room."""
OUTSIDE_PERCENT = 1.0
"""Of the known places on each side of the box that may lie outside it, in percent: stray points,
and what is seen through a window."""
UNCOVERED_ALPHA = 0.5
"""Alpha below which more of a pixel is background than splats."""
UNLIKE = 0.05
"""0..1, the largest difference of a channel from the background's colour up to which the background
itself shows what the photo shows: a little more than noise and compression make of a plain one."""
FIRST_OPACITY = 0.3
"""0..1, as the opacity of the other first splats (`seed.FIRST_OPACITY`)."""
FLATNESS = 0.2
"""Thickness along the ray over width across it, as the flattest of the first splats are."""


@dataclass(frozen=True, slots=True, eq=False)
class RoomBox:
    """An upright box around what is known of a room.

    Attributes:
        box_from_world: (3, 3) rotation about up.
        low: (3,) smallest coordinates in the box's axes.
        high: (3,) largest.
    """

    box_from_world: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]

    def exits(self, eye: NDArray[np.float64], rays: NDArray[np.float64]) -> NDArray[np.float64]:
        """(N,) distance at which (N, 3) unit rays leave the box; nan from a place outside."""
        start, way = self.box_from_world @ eye, rays @ self.box_from_world.T
        if not ((start >= self.low) & (start <= self.high)).all():
            return np.full(len(rays), np.nan)
        side = np.where(way < 0.0, self.low, self.high)
        return ((side - start) / np.where(way == 0.0, np.finfo(np.float64).tiny, way)).min(axis=1)


def box_around(means: NDArray[np.floating]) -> RoomBox:
    """The box around (N, 3) places, turned as their plan is, but for a few far ones."""
    if len(means) == 0:
        return RoomBox(np.eye(3), np.full(3, np.inf), np.full(3, -np.inf))
    low, high = np.percentile(means, (OUTSIDE_PERCENT, 100.0 - OUTSIDE_PERCENT), axis=0)
    inside = ((means >= low) & (means <= high)).all(axis=1)
    plan = (means[inside] if inside.any() else means)[:, :2].astype(np.float32)
    yaw = np.deg2rad(cv2.minAreaRect(plan)[2])
    box_from_world = Pose.from_yaw(-yaw).rotation
    turned = means.astype(np.float64) @ box_from_world.T
    low, high = np.percentile(turned, (OUTSIDE_PERCENT, 100.0 - OUTSIDE_PERCENT), axis=0)
    return RoomBox(box_from_world, low, high)


def uncovered_splats(
    cloud: SplatCloud,
    photos: Sequence[Photo],
    renderer: Renderer,
    drawing: RenderOptions,
    *,
    box: RoomBox,
    typical_distance: float,
) -> SplatCloud:
    """Splats for what `cloud` leaves uncovered in any photo; those of one photo serve the next.

    Args:
        cloud: what is drawn so far.
        photos: at a size of about `MAX_PX`.
        renderer: draws them.
        drawing: how.
        box: on which they are put.
        typical_distance: depth to take for photos from outside the box that show none at all.
    """
    background = np.asarray(drawing.background, dtype=np.float32)
    added = cloud.select(np.zeros(0, dtype=np.int64))
    for photo in photos:
        objects = [PosedSplats(part, Pose.identity()) for part in (cloud, added)]
        drawn = renderer.render(objects, photo.camera, photo.world_from_camera, drawing)
        is_covered = drawn.alpha >= UNCOVERED_ALPHA
        is_open = ~is_covered & _in_lens(photo)
        is_open &= np.abs(photo.colours - background).max(axis=2) > UNLIKE
        if not is_open.any():
            continue
        known = np.where(is_covered, drawn.depth, 0.0).astype(np.float32)
        if is_covered.any():
            depth = filled(known, photo.picture)
        else:
            depth = np.full_like(known, typical_distance)
        added = concatenate([added, _discs(photo, depth, is_open, box, cloud.sh.shape[1])])
    return added


def _in_lens(photo: Photo) -> NDArray[np.bool_]:
    """(H, W) whether pixels lie in the part of the picture that the lens fills."""
    _, is_inside = photo.camera.project(photo.camera.unproject(pixel_centres(photo.camera)))
    return is_inside.reshape(photo.picture.shape[:2])


def _discs(
    photo: Photo,
    depth: NDArray[np.float32],
    is_open: NDArray[np.bool_],
    box: RoomBox,
    sh_count: int,
) -> SplatCloud:
    """A disc across the ray of every cell of the picture of which most is uncovered.

    Args:
        photo: the picture.
        depth: (H, W) to take in a photo from outside the box, as of a single object.
        is_open: (H, W) what is uncovered.
        box: where the others are put.
        sh_count: coefficients of a splat's colour.
    """
    rows, columns = (side // CELL_PX for side in depth.shape)
    cells = is_open[: rows * CELL_PX, : columns * CELL_PX]
    share = cells.reshape(rows, CELL_PX, columns, CELL_PX).mean(axis=(1, 3))
    row, column = np.nonzero(share > UNCOVERED_ALPHA)
    at = (row * CELL_PX + CELL_PX // 2, column * CELL_PX + CELL_PX // 2)
    pixel = at[0] * depth.shape[1] + at[1]
    rays = photo.camera.unproject(pixel_centres(photo.camera)[pixel])
    along = depth[at].astype(np.float64)
    is_range = isinstance(photo.camera, Fisheye)
    way = rays * (along / (np.linalg.norm(rays, axis=1) if is_range else rays[:, 2]))[:, None]
    eye, turned = photo.world_from_camera.translation, photo.world_from_camera.rotation
    unit = rays / np.linalg.norm(rays, axis=1, keepdims=True)
    exits = box.exits(eye, unit @ turned.T)[:, None]
    way = np.where(np.isfinite(exits), exits * unit, way)
    focal = photo.camera.f_px if isinstance(photo.camera, Fisheye) else photo.camera.fx
    width = CELL_PX * np.linalg.norm(way, axis=1) / focal
    scales = width[:, None] * np.array([1.0, 1.0, FLATNESS])
    sh = np.zeros((len(row), sh_count, 3), dtype=np.float32)
    sh[:, 0] = (photo.colours[at] - 0.5) / SH_C0
    return SplatCloud(
        (photo.world_from_camera @ way).astype(np.float32),
        scales.astype(np.float32),
        _facing(way @ photo.world_from_camera.rotation.T),
        np.full(len(row), FIRST_OPACITY, dtype=np.float32),
        sh,
    )


def _facing(directions: NDArray[np.float64]) -> NDArray[np.float32]:
    """(N, 4) quaternions wxyz that turn the z axis into (N, 3) directions, by the shorter way."""
    unit = directions / np.maximum(np.linalg.norm(directions, axis=1, keepdims=True), 1e-12)
    turned = np.column_stack([1 + unit[:, 2], -unit[:, 1], unit[:, 0], np.zeros(len(unit))])
    # Straight back there is no shorter way: any half turn does.
    turned[unit[:, 2] < -1 + 1e-9] = (0.0, 1.0, 0.0, 0.0)
    norm = np.linalg.norm(turned, axis=1, keepdims=True)
    return (turned / norm).astype(np.float32)
