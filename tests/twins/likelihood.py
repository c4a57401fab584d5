"""Readable twin of `scenes._native.PoseLikelihood`: the same nats in numpy and OpenCV."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from tracking.evidence.observation import Observation
from tracking.likelihood.drawn_object import RING, DrawnObject, radius_px
from tracking.likelihood.pixel_model import (
    BEHIND_M,
    BEHIND_SHARE,
    FOREIGN,
    MIN_CHANGED,
    MIN_LIT,
    MIN_PX,
    UNKNOWN_EDGE,
    UNKNOWN_GAP_PX,
    UNKNOWN_PRIOR,
    UNKNOWN_RANGE,
    UNKNOWN_REACH,
    PoseSupport,
    Tolerance,
)
from tracking.likelihood.pose_likelihood import SHARED_M, SHARED_PX
from tracking.model.misfit import RESIDUAL_SIGMA, misfit
from tracking.model.object_model import TrackModel
from tracking.model.relighting import LIGHT_SIGMA, RELIGHTING, LightPrior, fit_light
from tracking.model.similarity import LENS_BLUR_PX, LENS_REACH_PX
from tracking.window.filters import bell_blurred, resized

FloatArray = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Terms:
    """How one pose is compared.

    Attributes:
        tolerance: how exactly it has to be right.
        ring_px: width of the surroundings in which another light would show, too.
        reach_px: distance over which surroundings tell of something unknown.
        shared_px2: pixels of the window that share one error.
    """

    tolerance: Tolerance
    ring_px: int
    reach_px: float
    shared_px2: float


def terms_of(
    observation: Observation, model: TrackModel, world_from_object: Pose, tolerance: Tolerance
) -> Terms:
    """How an object at a pose is compared with an observation."""
    radius = radius_px(observation, model, world_from_object)
    scan_px = radius * SHARED_M / model.radius_m
    shared_px2 = (SHARED_PX / observation.lens_px) ** 2 + scan_px**2
    return Terms(tolerance, max(round(RING * radius), 1), UNKNOWN_REACH * radius, shared_px2)


@dataclass(frozen=True, slots=True, eq=False)
class _Seen:
    """An object alone in a part of a window: colours over black, alpha, range, normals."""

    rgb: FloatArray
    alpha: FloatArray
    range_m: FloatArray
    facing: FloatArray


def support_of(observation: Observation, pictures: DrawnObject, terms: Terms) -> PoseSupport:
    """Support of an observation for an object that is drawn at a pose.

    Args:
        observation: of a window around the pose.
        pictures: the object drawn alone in a part of it.
        terms: how it is compared.
    """
    part, tolerance, shared_px2 = pictures.part, terms.tolerance, terms.shared_px2
    drawn = _seen(pictures)
    range_m = observation.range_m[part]
    reach_m = range_m * (1.0 + BEHIND_SHARE) + BEHIND_M
    is_behind = (range_m > 0) & (drawn.range_m > reach_m)
    free = (1.0 - observation.hidden[part]) * ~is_behind
    silhouette = np.asarray(drawn.alpha * free, dtype=np.float32)
    area_px, open_px = float(drawn.alpha.sum()), float(silhouette.sum())
    if open_px < MIN_PX:
        return PoseSupport(0.0, 0.0, open_px / max(area_px, MIN_PX), 0.0, 0.0, area_px)
    live, empty, changed = (
        picture[part] for picture in (observation.live, observation.empty, observation.changed)
    )
    behind = np.asarray((1.0 - drawn.alpha)[..., None] * empty, dtype=np.float32)
    unknown = _unknown(observation, part, drawn.alpha, terms.reach_px)
    # What is in front of the object says nothing of its light.
    uncovered = np.maximum(changed, MIN_CHANGED) * (1.0 - unknown.certain)
    weight = (silhouette * uncovered).astype(np.float32)
    gains, light_nats = _light(drawn, (live - behind).astype(np.float32), weight, shared_px2)
    most = tolerance.most_misfit
    wider2 = (RESIDUAL_SIGMA / tolerance.sigma) ** 2
    residual = (live - drawn.rgb * gains - behind).astype(np.float32)
    object_misfit = misfit(residual, tolerance.sigma)
    as_object = np.exp(-np.minimum(object_misfit, most))
    as_foreign = np.exp(-np.minimum(wider2 * observation.foreign_misfit[part], most))
    as_room = np.exp(-np.minimum(observation.room_misfit[part], most))
    # What hides the object would have to look like the room behind it, unless it is known to be
    # there.
    shown = np.maximum(changed, unknown.certain)
    as_occluder = shown * as_foreign + (1.0 - shown) * math.exp(-most)
    is_foreign, is_occluded = map(unknown.probability, (FOREIGN, tolerance.occluded))
    absent = (1.0 - is_foreign) * as_room + is_foreign * as_foreign
    present = (1.0 - is_occluded) * as_object + is_occluded * as_occluder
    present_nats = float((silhouette * np.log(present)).sum()) / shared_px2 + light_nats
    absent_nats = float((silhouette * np.log(absent)).sum()) / shared_px2
    ratio = present_nats - absent_nats
    relit_nats = 0.0
    # What is followed is known to be there: a shade that falls on it takes nothing away from it.
    if observation.in_any_light:
        ring = np.asarray(
            _ring(drawn.alpha, terms.ring_px) * (1.0 - observation.hidden[part]), np.float32
        )
        relit_nats = _relit_nats(observation, part, silhouette, ring, tolerance, shared_px2)
    return PoseSupport(
        nats=ratio - max(relit_nats, 0.0),
        samples=open_px / shared_px2,
        open_fraction=open_px / area_px,
        matched_fraction=float((silhouette * as_object).sum()) / open_px,
        unknown_fraction=float((silhouette * unknown.certain).sum()) / open_px,
        area_px=area_px,
    )


def _seen(pictures: DrawnObject) -> _Seen:
    """The object as the window's pixels and the lens would see it."""
    colours, compass = pictures.colours, pictures.compass
    drawn, range_m = (colours.rgb, colours.alpha, compass.rgb, compass.alpha), colours.depth
    if pictures.finer > 1:
        height, width = range_m.shape
        size = width // pictures.finer, height // pictures.finer
        drawn = tuple(resized(picture, size) for picture in drawn)
        nearest = cv2.resize(range_m, size, interpolation=cv2.INTER_NEAREST)
        range_m = np.asarray(nearest, dtype=np.float32)
    rgb, alpha, normals, known = drawn
    facing = 2.0 * normals / np.maximum(known, 1e-3)[..., None] - 1.0
    # The foot has no normals: it was scanned with the shadow it stood in.
    facing *= (known > RELIGHTING.seen)[..., None]
    return _Seen(
        bell_blurred(rgb, LENS_BLUR_PX, LENS_REACH_PX),
        bell_blurred(alpha, LENS_BLUR_PX, LENS_REACH_PX),
        range_m,
        facing.astype(np.float32),
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Unknown:
    """(H, W) how far a silhouette's surroundings reach each pixel, and their foreground."""

    foreground: FloatArray
    reached: FloatArray

    @property
    def certain(self) -> FloatArray:
        """The probability of something unknown that the surroundings alone account for."""
        return np.asarray(self.foreground / (self.reached + UNKNOWN_PRIOR), np.float32)

    def probability(self, prior: float) -> FloatArray:
        """That a pixel shows something unknown; the prior where nothing around reaches it."""
        share = (self.foreground + UNKNOWN_PRIOR * prior) / (self.reached + UNKNOWN_PRIOR)
        return np.asarray(np.clip(share, *UNKNOWN_RANGE), np.float32)


def _unknown(
    observation: Observation, part: tuple[slice, slice], alpha: FloatArray, reach_px: float
) -> _Unknown:
    """The probability of something unknown in every pixel, by a silhouette's surroundings."""
    side = 2 * UNKNOWN_GAP_PX + 1
    alpha = np.maximum(alpha, observation.claimed[part])
    near = np.clip(cv2.dilate(alpha, np.ones((side, side), np.uint8)), 0.0, 1.0)
    outside = np.asarray((1.0 - near) * (1.0 - observation.hidden[part]), np.float32)
    foreground = np.asarray(outside * observation.foreground[part], np.float32)
    kept = math.exp(-1.0 / max(reach_px, 1.0))
    live = observation.live[part]
    across, down = (
        kept * np.exp(-(np.diff(live, axis=axis) ** 2).sum(axis=2) / (2 * UNKNOWN_EDGE**2))
        for axis in (1, 0)
    )
    scale = (1.0 - kept) / (1.0 + kept)

    def spread(values: FloatArray) -> FloatArray:
        one = _spread_along(_spread_along(values.T, across.T, scale).T, down, scale)
        other = _spread_along(_spread_along(values, down, scale).T, across.T, scale).T
        return np.asarray(0.5 * (one + other), np.float32)

    return _Unknown(spread(foreground), spread(outside))


def _spread_along(values: FloatArray, passed: FloatArray, scale: float) -> FloatArray:
    """(N, M) values spread along the first axis; `passed`, (N - 1, M), from a row to its next."""
    down, up = values.astype(np.float64), values.astype(np.float64)
    for row in range(1, len(values)):
        down[row] += passed[row - 1] * down[row - 1]
        up[-row - 1] += passed[-row] * up[-row]
    return np.asarray(scale * (down + up - values), np.float32)


def _ring(alpha: FloatArray, ring_px: int) -> FloatArray:
    """(H, W) 0..1: the surroundings of a silhouette, without it."""
    side = 2 * ring_px + 1
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
    room = _Seen(expected, here, np.zeros_like(here), across)
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
    drawn: _Seen, shown: FloatArray, weight: FloatArray, shared_px2: float
) -> tuple[FloatArray, float]:
    """Gains (H, W, 3) of the likeliest light, and the log of its prior, 0 at most."""
    prior = LightPrior(LIGHT_SIGMA, 1.0 / (RESIDUAL_SIGMA**2 * shared_px2))
    count, light = fit_light(drawn.rgb, drawn.facing, shown, weight, prior=prior)
    if count < MIN_LIT:
        return np.ones_like(drawn.rgb), 0.0
    return light.gains(drawn.facing), prior.nats(light)
