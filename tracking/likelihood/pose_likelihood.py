"""The one likelihood: nats by which a window speaks for an object at a pose.

Every pixel of the object's silhouette is accounted for three ways: by the empty room, by something
that is in no scan, and by the object, drawn there in the light that fits best. The log likelihood
ratio of the object against its absence is summed over the silhouette and divided by the number of
pixels that share one error. It is 0 for what cannot be seen, negative where the empty room shows,
and comparable over objects, sizes, distances and frames.

What hides the object is accounted for too: the static room and tracked objects by their distance,
anything else as an occlusion mixture, which a pixel that shows the empty room cannot be part of.
A flat patch of an unknown object is nearly as likely as a flat patch of this one: it says at most
`-ln FOREIGN` a sample. Most evidence comes from where outline and pattern are, as their
surroundings do not predict those.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye
from scenes.pose import Pose
from scenes.render.renderer import PosedSplats, Renderer
from tracking.evidence.observation import Observation
from tracking.model.misfit import MOST_MISFIT, RESIDUAL_SIGMA, misfit
from tracking.model.object_model import RENDER_OPTIONS, TrackModel
from tracking.model.relighting import LIGHT_SIGMA, RELIGHTING, LightPrior, fit_light
from tracking.model.similarity import LENS_BLUR_PX, LENS_REACH_PX
from tracking.window.extent import part_of
from tracking.window.filters import bell_blurred, resized

FloatArray = NDArray[np.float32]

OCCLUDED = 0.3
"""Prior probability that a pixel of a silhouette is hidden by something in no scan."""

FOREIGN = 0.3
"""Prior probability that a pixel shows something in no scan, if not the object. Before absence was
judged in another light, with 0.3, 0.5, 0.6 and 0.85, of 93 objects in three random rooms 68, 67, 70
and 54 were right and 24, 16, 10 and 4 wrong unnoticed; of 198 in a foreign room 194, 194, 188 and
167, and 4, 2, 1 and none. At 0.5 a plain mug on a table was found 20 cm off."""

SHARED_PX = 9.0
"""Side, px, of the square of pixels that share one error of lens, codec and exposure."""

SHARED_M = 0.03
"""Side, m on the object, of the patch that shares one error of its scan: colours, light, shape."""

BEHIND_M = 0.05
"""How much farther than the static room a surface must be to be behind it, m: the error of a
scan's depth on a surface seen face on."""

BEHIND_SHARE = 0.02
"""The same as a share of the distance, for surfaces seen at a slant."""

MARGIN_PX = 4
"""Margin around an object's box that is drawn, px: the reach of the lens's blur and of splats."""

RING = 0.25
"""Width of the surroundings in which another light would show, too, in radii of the object: they
are then about as large as the silhouette."""

FINE_PX = 80
"""Objects drawn smaller than this, px, are drawn at twice the size and averaged: at few pixels the
low-pass filter of single splats widens the silhouette."""

LEAST_PX = 4.0
"""Visible silhouette below which nothing is said of a pose, px²."""

LEAST_CHANGED = 0.05
"""Weight in the fit of light, 0..1, of a pixel that shows the empty room for sure: no more than the
share of pixels at which an object happens to look like what is behind it."""

LEAST_LIT = 12
"""Pixels from which light is fitted; with fewer it is as in the scan."""


@dataclass(frozen=True, slots=True)
class Tolerance:
    """How exactly a pose has to be right before it differs from a wrong one.

    Attributes:
        sigma: standard deviation of a pixel about the composite, channels of 0..1.
        most_misfit: largest misfit of a pixel, nats.
        occluded: prior probability that a pixel is hidden by something in no scan.
    """

    sigma: float
    most_misfit: float
    occluded: float


EXACTLY = Tolerance(RESIDUAL_SIGMA, MOST_MISFIT, OCCLUDED)
"""For poses that were refined: the likelihood itself."""

ROUGHLY = Tolerance(0.12, 0.5 * MOST_MISFIT, 0.4)
"""For poses that are off by a part of the object, whose edges fall on wrong pixels: the likelihood
annealed, so that such pixels count half. On foreign stills the right place was among the best
eight of 80 with a largest misfit from 1.5 to 2.6 nats, and was missed at 5.2."""


@dataclass(frozen=True, slots=True)
class PoseSupport:
    """What a window says for an object at a pose.

    Attributes:
        nats: log likelihood ratio of the object there against its absence.
        samples: number of independent samples that the visible silhouette is worth.
        open_fraction: 0..1, share of the silhouette inside the picture that neither the room nor
            a tracked object hides.
        matched_fraction: 0..1, share of that which the object accounts for.
        area_px: silhouette inside the picture, px².
    """

    nats: float
    samples: float
    open_fraction: float
    matched_fraction: float
    area_px: float


NOT_IN_VIEW = PoseSupport(0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class _Drawn:
    """An object drawn alone in a part of a window: colours over black, alpha, range, normals."""

    rgb: FloatArray
    alpha: FloatArray
    range_m: FloatArray
    facing: FloatArray


def pose_support(
    observation: Observation,
    model: TrackModel,
    world_from_object: Pose,
    renderer: Renderer,
    *,
    tolerance: Tolerance = EXACTLY,
) -> PoseSupport:
    """What an observation says for an object at a pose.

    Args:
        observation: of a window around the pose.
        model: the object.
        world_from_object: the pose.
        renderer: draws splats.
        tolerance: how exactly the pose has to be right.
    """
    part = _part(observation, model, world_from_object)
    if part is None:
        return NOT_IN_VIEW
    drawn = _draw(observation, model, world_from_object, renderer, part)
    range_m = observation.range_m[part]
    reach_m = range_m * (1.0 + BEHIND_SHARE) + BEHIND_M
    is_behind = (range_m > 0) & (drawn.range_m > reach_m)
    free = (1.0 - observation.hidden[part]) * ~is_behind
    silhouette = np.asarray(drawn.alpha * free, dtype=np.float32)
    area_px, open_px = float(drawn.alpha.sum()), float(silhouette.sum())
    if open_px < LEAST_PX:
        return PoseSupport(0.0, 0.0, open_px / max(area_px, LEAST_PX), 0.0, area_px)
    live, empty, changed = (
        picture[part] for picture in (observation.live, observation.empty, observation.changed)
    )
    behind = np.asarray((1.0 - drawn.alpha)[..., None] * empty, dtype=np.float32)
    radius = radius_px(observation, model, world_from_object)
    shared_px2 = _shared_px2(observation, model, radius)
    weight = (silhouette * np.maximum(changed, LEAST_CHANGED)).astype(np.float32)
    gains, light_nats = _light(drawn, (live - behind).astype(np.float32), weight, shared_px2)
    most = tolerance.most_misfit
    wider2 = (RESIDUAL_SIGMA / tolerance.sigma) ** 2
    residual = (live - drawn.rgb * gains - behind).astype(np.float32)
    object_misfit = misfit(residual, tolerance.sigma)
    as_object = np.exp(-np.minimum(object_misfit, most))
    as_foreign = np.exp(-np.minimum(wider2 * observation.foreign_misfit[part], most))
    as_room = np.exp(-np.minimum(observation.room_misfit[part], most))
    # What hides the object would have to look like the room behind it.
    as_occluder = changed * as_foreign + (1.0 - changed) * math.exp(-most)
    absent = (1.0 - FOREIGN) * as_room + FOREIGN * as_foreign
    present = (1.0 - tolerance.occluded) * as_object + tolerance.occluded * as_occluder
    present_nats = float((silhouette * np.log(present)).sum()) / shared_px2 + light_nats
    absent_nats = float((silhouette * np.log(absent)).sum()) / shared_px2
    ring = np.asarray(_ring(drawn.alpha, radius) * (1.0 - observation.hidden[part]), np.float32)
    ratio = present_nats - absent_nats
    relit_nats = _relit_nats(observation, part, silhouette, ring, tolerance, shared_px2)
    relit_ratio = min(ratio, ratio - relit_nats)
    # Once the room's light has been learned, a shade is sooner a passer-by's: it takes evidence for
    # the object away, and is none that the object has left.
    least = -math.inf if observation.is_first else min(ratio, 0.0)
    return PoseSupport(
        nats=max(relit_ratio, least),
        samples=open_px / shared_px2,
        open_fraction=open_px / area_px,
        matched_fraction=float((silhouette * as_object).sum()) / open_px,
        area_px=area_px,
    )


def radius_px(observation: Observation, model: TrackModel, world_from_object: Pose) -> float:
    """Radius of an object's sphere in an observation's pixels."""
    eye = observation.world_from_camera.translation
    range_m = float(np.linalg.norm(model.centre_at(world_from_object) - eye))
    return observation.camera.f_px * model.radius_m / max(range_m, model.radius_m)


def _shared_px2(observation: Observation, model: TrackModel, radius: float) -> float:
    """Pixels that share one error: of the lens, and of the object's scan."""
    scan_px = radius * SHARED_M / model.radius_m
    return (SHARED_PX / observation.lens_px) ** 2 + scan_px**2


def _part(
    observation: Observation, model: TrackModel, world_from_object: Pose
) -> tuple[slice, slice] | None:
    """Rows and columns around an object's box; None if it is outside the window."""
    camera = observation.camera
    corners = observation.world_from_camera.inverse() @ model.box_at(world_from_object)
    pixels, seen = camera.project(corners)
    size = np.array([camera.width_px, camera.height_px])
    margin = MARGIN_PX + RING * radius_px(observation, model, world_from_object)
    low = np.maximum(np.floor(pixels.min(axis=0) - margin), 0).astype(int)
    high = np.minimum(np.ceil(pixels.max(axis=0) + margin), size).astype(int)
    if not seen.any() or (low >= high).any():
        return None
    return slice(int(low[1]), int(high[1])), slice(int(low[0]), int(high[0]))


def _draw(
    observation: Observation,
    model: TrackModel,
    world_from_object: Pose,
    renderer: Renderer,
    part: tuple[slice, slice],
) -> _Drawn:
    camera: Fisheye = part_of(observation.camera, part)
    size = (camera.width_px, camera.height_px)
    finer = 2 if max(size) < FINE_PX else 1
    fine = camera.resized(finer * size[0], finer * size[1]) if finer > 1 else camera
    world_from_camera = observation.world_from_camera
    level = model.level_for(radius_px(observation, model, world_from_object))
    colours, compass = (
        renderer.render(
            (PosedSplats(cloud, world_from_object),), fine, world_from_camera, RENDER_OPTIONS
        )
        for cloud in (level.splats, level.relightable.compass)
    )
    pictures = colours.rgb, colours.alpha, compass.rgb, compass.alpha
    range_m = colours.depth
    if finer > 1:
        pictures = tuple(resized(picture, size) for picture in pictures)
        nearest = cv2.resize(range_m, size, interpolation=cv2.INTER_NEAREST)
        range_m = np.asarray(nearest, dtype=np.float32)
    rgb, alpha, normals, known = pictures
    facing = 2.0 * normals / np.maximum(known, 1e-3)[..., None] - 1.0
    # The foot has no normals: it was scanned with the shadow it stood in.
    facing *= (known > RELIGHTING.seen)[..., None]
    return _Drawn(
        bell_blurred(rgb, LENS_BLUR_PX, LENS_REACH_PX),
        bell_blurred(alpha, LENS_BLUR_PX, LENS_REACH_PX),
        range_m,
        facing.astype(np.float32),
    )


def _ring(alpha: FloatArray, radius: float) -> FloatArray:
    """(H, W) 0..1: the surroundings of a silhouette, without it."""
    side = 2 * max(round(RING * radius), 1) + 1
    reached = cv2.dilate(alpha, np.ones((side, side), np.uint8))
    return np.asarray(np.clip(reached, 0.0, 1.0) * (1.0 - np.clip(alpha, 0.0, 1.0)), np.float32)


def _relit_nats(
    observation: Observation,
    part: tuple[slice, slice],
    silhouette: FloatArray,
    ring: FloatArray,
    tolerance: Tolerance,
    shared_px2: float,
) -> float:
    """Nats by which the room in another light accounts better for a place than the room as it was.

    Light does not change in the shape of one object: what surrounds the silhouette is in it, too.
    """
    live, expected = observation.live[part], observation.expected[part]
    here = silhouette + ring
    height, width = here.shape
    y, x = np.mgrid[-1 : 1 : height * 1j, -1 : 1 : width * 1j]
    across = np.stack([x, y, np.zeros_like(x)], axis=2).astype(np.float32)
    room = _Drawn(expected, here, np.zeros_like(here), across)
    gains, light_nats = _light(room, live, here, shared_px2)
    # A pose that is off makes no room lighter: no tolerance here.
    relit_misfit = misfit((live - expected * gains).astype(np.float32))
    most, wider2 = tolerance.most_misfit, (RESIDUAL_SIGMA / tolerance.sigma) ** 2
    as_foreign = np.exp(-np.minimum(wider2 * observation.foreign_misfit[part], most))
    relit, same = (
        np.log((1.0 - FOREIGN) * np.exp(-np.minimum(apart, most)) + FOREIGN * as_foreign)
        for apart in (relit_misfit, observation.room_misfit[part])
    )
    inside, around = (float((area * (relit - same)).sum()) for area in (silhouette, ring))
    # Around an object that is there, the light may have changed as well.
    return (inside + min(around, 0.0)) / shared_px2 + light_nats


def _light(
    drawn: _Drawn, shown: FloatArray, weight: FloatArray, shared_px2: float
) -> tuple[FloatArray, float]:
    """Gains (H, W, 3) of the likeliest light, and the log of its prior, 0 at most."""
    prior = LightPrior(LIGHT_SIGMA, 1.0 / (RESIDUAL_SIGMA**2 * shared_px2))
    count, light = fit_light(drawn.rgb, drawn.facing, shown, weight, prior=prior)
    if count < LEAST_LIT:
        return np.ones_like(drawn.rgb), 0.0
    return light.gains(drawn.facing), prior.nats(light)
