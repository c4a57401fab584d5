"""One view of an object: how much of each splat's light, and which cells of its box."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole
from scenes.coverage.sides import BoxCells
from scenes.pose import Pose
from scenes.prepare.cutout.votes.cropped_views import MARGIN, MAX_PX
from scenes.prepare.cutout.votes.framed import framed
from scenes.render.gradients import record
from scenes.render.native import NativeRenderer
from scenes.render.renderer import ALPHA_MIN, LOW_PASS_PX2, PosedSplats, Rendering
from scenes.splats import SH_C0, SplatCloud
from scenes.state import ObjectModel

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

MIN_CROP_PX = 8
"""Least side of the part of a picture that an object takes up; in less it is a speck."""

STEP = 1e-3
"""Of a splat's distance: the step by which the lens's slope is measured there."""

BEHIND_M = 0.05
"""So far behind what is drawn a cell is hidden, metres: depths of trained splats are that unsure
(as `scenes.prepare.cutout.votes.seen_surface.BEHIND_M`)."""


@dataclass(frozen=True, slots=True, eq=False)
class ShownSplats:
    """Light of an object's splats that reaches a view.

    Attributes:
        weights: (N,) blend weight of each, summed over the crop's pixels.
        transmittance: (N,) 0..about 1, the share of its light that nothing in front takes; 0 where
            its middle is outside the picture.
        drawn: the crop as it was drawn, of the whole scene.
    """

    weights: FloatArray
    transmittance: FloatArray
    drawn: Rendering


def crop_around(
    points: FloatArray, camera: Pinhole | Fisheye, *, world_from_camera: Pose
) -> Pinhole | Fisheye | None:
    """The part of a view around world points (K, 3), as far as it is in the picture.

    At most `MAX_PX` large; None where the points are beside the picture or behind the camera.
    """
    in_camera = world_from_camera.inverse() @ points
    if isinstance(camera, Pinhole) and (in_camera[:, 2] <= 0.0).any():
        return None
    pixels, valid = camera.project(in_camera)
    if isinstance(camera, Fisheye) and not valid.any():
        return None
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    reach = MARGIN * float((high - low).max())
    limit = np.array([camera.width_px, camera.height_px])
    first = np.floor(np.clip(low - reach, 0, limit)).astype(int)
    last = np.ceil(np.clip(high + reach, 0, limit)).astype(int)
    inside = np.minimum(high, limit) - np.maximum(low, 0)
    if (last - first).min() < MIN_CROP_PX or inside.min() < 1.0:
        return None
    width, height = (last - first).tolist()
    moved = replace(
        camera,
        width_px=width,
        height_px=height,
        cx=camera.cx - float(first[0]),
        cy=camera.cy - float(first[1]),
    )
    return _at_most(moved, MAX_PX)


def zoom_of(crop: Pinhole | Fisheye, camera: Pinhole | Fisheye) -> float:
    """Pixels of a crop for one of its view's, at most 1."""
    first, second = (c.fx if isinstance(c, Pinhole) else c.f_px for c in (crop, camera))
    return first / second


def grey_scene(room: SplatCloud, objects: Sequence[ObjectModel]) -> list[PosedSplats]:
    """The room and objects as they stand, in one colour: all that hides and weighs."""
    posed = [PosedSplats(room, Pose.identity())]
    posed += [PosedSplats(item.splats, item.world_from_object) for item in objects]
    return [PosedSplats(_grey(part.cloud), part.world_from_object) for part in posed]


def in_view(
    posed: Sequence[PosedSplats], camera: Pinhole | Fisheye, *, world_from_camera: Pose
) -> list[PosedSplats]:
    """The same without the splats that are beside the picture."""
    if isinstance(camera, Fisheye):
        return list(posed)
    return [
        PosedSplats(
            part.cloud.select(
                framed(part.cloud, camera, part.world_from_object.inverse() @ world_from_camera)
            ),
            part.world_from_object,
        )
        for part in posed
    ]


def shown_splats(
    item: ObjectModel,
    others: Sequence[PosedSplats],
    *,
    camera: Pinhole | Fisheye,
    world_from_camera: Pose,
    renderer: NativeRenderer,
) -> ShownSplats:
    """Return the light of an object's splats that reaches a view, behind and among everything else.

    Args:
        item: the object, at its pose in the world.
        others: what may hide it, in grey.
        camera: of the view or a crop of it.
        world_from_camera: its pose.
        renderer: draws splats.
    """
    own = PosedSplats(_grey(item.splats), item.world_from_object)
    recording = record(renderer, [own, *others], camera, world_from_camera)
    d_rgb = np.zeros((camera.height_px, camera.width_px, 3), dtype=np.float32)
    d_rgb[..., 0] = 1.0
    # The sum of a splat's blend weights is the gradient of the picture's sum by its colour.
    by_colour = recording.gradients(d_rgb=d_rgb).objects[0].sh[:, 0, 0].astype(np.float64) / SH_C0
    lit = np.flatnonzero(by_colour > 0.0)
    alone, is_inside = _light_alone(
        item.splats.select(lit),
        camera,
        camera_from_object=world_from_camera.inverse() @ item.world_from_object,
    )
    through = np.zeros(len(by_colour))
    through[lit] = np.where(is_inside, by_colour[lit] / np.maximum(alone, 1e-9), 0.0)
    return ShownSplats(np.maximum(by_colour, 0.0), through, recording.rendering)


def shown_cells(
    cells: BoxCells,
    world_from_object: Pose,
    *,
    drawn: Rendering,
    camera: Pinhole | Fisheye,
    world_from_camera: Pose,
    min_facing: float,
) -> BoolArray:
    """(6, 64) the cells of a box that a view shows from outside.

    Args:
        cells: of the box, in the object's frame.
        world_from_object: the object's pose.
        drawn: the whole scene as the view sees it.
        camera: of the view.
        world_from_camera: its pose.
        min_facing: least cosine between a cell's normal and the way to the eye.
    """
    camera_from_object = world_from_camera.inverse() @ world_from_object
    eye = camera_from_object.inverse().translation
    facing = cells.facing(eye) >= min_facing
    in_camera = camera_from_object @ cells.points.reshape(-1, 3)
    pixels, is_inside = camera.project(in_camera)
    height, width = drawn.depth.shape
    row = np.clip(pixels[:, 1].astype(np.intp), 0, height - 1)
    column = np.clip(pixels[:, 0].astype(np.intp), 0, width - 1)
    depth = drawn.depth[row, column]
    is_range = isinstance(camera, Fisheye)
    reach = np.linalg.norm(in_camera, axis=1) if is_range else in_camera[:, 2]
    is_free = (depth <= 0.0) | (reach <= depth + BEHIND_M)
    return facing & (is_inside & is_free).reshape(facing.shape)


def _at_most(camera: Pinhole | Fisheye, longest_px: int) -> Pinhole | Fisheye:
    scale = min(1.0, longest_px / max(camera.width_px, camera.height_px))
    width, height = (max(1, round(scale * side)) for side in (camera.width_px, camera.height_px))
    if scale == 1.0:
        return camera
    if isinstance(camera, Fisheye):
        return camera.resized(width, height)
    across, down = width / camera.width_px, height / camera.height_px
    return Pinhole(
        width, height, camera.fx * across, camera.fy * down, camera.cx * across, camera.cy * down
    )


def _light_alone(
    splats: SplatCloud, camera: Pinhole | Fisheye, *, camera_from_object: Pose
) -> tuple[FloatArray, BoolArray]:
    """(N,) blend weight of each splat if it were alone, px, and whether its middle is in sight.

    A splat's alpha is a Gaussian in the picture, cut off where it falls below `ALPHA_MIN`.
    """
    means = camera_from_object @ splats.means.astype(np.float64)
    _, is_inside = camera.project(means)
    turn = camera_from_object.rotation
    spread = turn @ splats.covariances() @ turn.T
    step = STEP * np.maximum(np.linalg.norm(means, axis=1), 1e-6)
    slope = np.empty((len(means), 2, 3))
    for axis, unit in enumerate(np.eye(3)):
        ahead, behind = (camera.project(means + way * step[:, None] * unit)[0] for way in (1, -1))
        slope[:, :, axis] = (ahead - behind) / (2.0 * step[:, None])
    in_picture = slope @ spread @ np.swapaxes(slope, 1, 2) + LOW_PASS_PX2 * np.eye(2)
    (a, b), (c, d) = in_picture.transpose(1, 2, 0)
    area = 2.0 * math.pi * np.sqrt(np.maximum(a * d - b * c, 0.0))
    return area * np.maximum(splats.opacities - ALPHA_MIN, 0.0), is_inside


def _grey(cloud: SplatCloud) -> SplatCloud:
    """The same cloud in mid grey: a colour at its limit lets no gradient through."""
    sh = np.zeros((len(cloud), 1, 3), dtype=np.float32)
    return SplatCloud(cloud.means, cloud.scales, cloud.rotations, cloud.opacities, sh)
