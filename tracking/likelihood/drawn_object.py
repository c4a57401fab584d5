"""An object drawn alone in the part of a window that it is compared in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye
from scenes.pose import Pose
from scenes.render.renderer import PosedSplats, Renderer, Rendering
from scenes.splats import SplatCloud
from tracking.evidence.observation import Observation
from tracking.model.object_model import RENDER_OPTIONS, DetailLevel, TrackModel
from tracking.window.extent import part_of
from tracking.window.filters import resized

MARGIN_PX = 4
"""Margin around an object's box that is drawn, px: the reach of the lens's blur and of splats."""

RING = 0.25
"""Width of the surroundings in which another light would show, too, in radii of the object: they
are then about as large as the silhouette."""

FINE_PX = 80
"""Objects drawn smaller than this, px, are drawn at twice the size and averaged: at few pixels the
low-pass filter of single splats widens the silhouette."""


COARSE = 0.5
"""Share of its radius in the picture for which the splats of a coarse drawing are merged."""


@dataclass(frozen=True, slots=True, eq=False)
class DrawnObject:
    """An object drawn on black.

    Attributes:
        part: rows and columns of the window.
        finer: pixels drawn each way per pixel of it.
        colours: as scanned.
        compass: coloured by where each surface faces, see `tracking.model.relighting`.
    """

    part: tuple[slice, slice]
    finer: int
    colours: Rendering
    compass: Rendering


def draw_object(
    observation: Observation,
    model: TrackModel,
    world_from_object: Pose,
    renderer: Renderer,
    *,
    is_coarse: bool = False,
) -> DrawnObject | None:
    """The object at a pose in an observation's window; None if it is outside.

    Args:
        observation: of the window.
        model: the object.
        world_from_object: its pose.
        renderer: draws splats.
        is_coarse: whether fewer splats and pixels will do.
    """
    radius = radius_px(observation, model, world_from_object)
    part = _part(observation, model, world_from_object, radius)
    if part is None:
        return None
    camera: Fisheye = part_of(observation.camera, part)
    size = (camera.width_px, camera.height_px)
    finer = 2 if max(size) < FINE_PX and not is_coarse else 1
    fine = camera.resized(finer * size[0], finer * size[1]) if finer > 1 else camera
    level = model.level_for(COARSE * radius if is_coarse else radius)

    def drawn(cloud: SplatCloud) -> Rendering:
        posed = (PosedSplats(cloud, world_from_object),)
        return renderer.render(posed, fine, observation.world_from_camera, RENDER_OPTIONS)

    return DrawnObject(part, finer, drawn(level.splats), drawn(level.relightable.compass))


def claim(
    observation: Observation,
    model: TrackModel,
    *,
    world_from_object: Pose,
    renderer: Renderer,
    reach_m: float,
) -> Observation:
    """The same, with all that an object may cover that is no farther than `reach_m` from a pose.

    Poses that are compared need the same surroundings: what is beside one of them is a part of the
    object at the other, and as something unknown would go on over it.
    """
    drawn = draw_object(observation, model, world_from_object, renderer, is_coarse=True)
    if drawn is None:
        return observation
    rows, columns = drawn.part
    size = (columns.stop - columns.start, rows.stop - rows.start)
    alpha = np.zeros(observation.changed.shape, np.float32)
    alpha[drawn.part] = resized(drawn.colours.alpha, size)
    radius = radius_px(observation, model, world_from_object)
    side = 2 * round(radius * reach_m / model.radius_m) + 1
    reached = cv2.dilate(alpha, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side)))
    return replace(observation, claimed=np.maximum(observation.claimed, reached))


def radius_px(observation: Observation, model: TrackModel, world_from_object: Pose) -> float:
    """Radius of an object's sphere in an observation's pixels."""
    eye = observation.world_from_camera.translation
    range_m = float(np.linalg.norm(model.centre_at(world_from_object) - eye))
    return observation.camera.f_px * model.radius_m / max(range_m, model.radius_m)


def radii_at(
    observation: Observation, model: TrackModel, *, poses: Sequence[Pose]
) -> NDArray[np.float64]:
    """(N,) `radius_px` of an object at each of some poses."""
    rotations = np.array([pose.rotation for pose in poses])
    places = np.array([pose.translation for pose in poses])
    away = rotations @ model.centre_m + places - observation.world_from_camera.translation
    range_m = np.sqrt((away * away).sum(axis=1))
    radii = observation.camera.f_px * model.radius_m / np.maximum(range_m, model.radius_m)
    return np.asarray(radii, dtype=np.float64)


def levels_for(
    model: TrackModel, radii_px: NDArray[np.float64], *, is_coarse: bool
) -> tuple[list[DetailLevel], list[int]]:
    """The levels of detail that an object is drawn with at some sizes, and by size which of them.

    Args:
        model: the object.
        radii_px: (N,) of it in the picture.
        is_coarse: whether fewer splats will do.
    """
    share = COARSE if is_coarse else 1.0
    limits_px = [level.max_radius_px for level in model.levels]
    wanted = np.searchsorted(limits_px, share * radii_px)
    used, which = np.unique(wanted, return_inverse=True)
    return [model.levels[index] for index in used], which.tolist()


def _part(
    observation: Observation, model: TrackModel, world_from_object: Pose, radius: float
) -> tuple[slice, slice] | None:
    """Rows and columns around an object's box; None if it is outside the window."""
    camera = observation.camera
    corners = observation.world_from_camera.inverse() @ model.box_at(world_from_object)
    pixels, seen = camera.project(corners)
    size = np.array([camera.width_px, camera.height_px])
    margin = MARGIN_PX + RING * radius
    low = np.maximum(np.floor(pixels.min(axis=0) - margin), 0).astype(int)
    high = np.minimum(np.ceil(pixels.max(axis=0) + margin), size).astype(int)
    if not seen.any() or (low >= high).any():
        return None
    return slice(int(low[1]), int(high[1])), slice(int(low[0]), int(high[0]))
