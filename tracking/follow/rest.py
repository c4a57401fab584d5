"""Patches of an object at rest, or around one that was never seen: unchanged, it is left alone."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.state import TrackState
from tracking.evidence.evidence import view_of
from tracking.follow.belief import Belief
from tracking.follow.track import Rest, Task
from tracking.hypotheses.proposals import MIN_CHANGED
from tracking.kernels import native
from tracking.solve.gauss_newton import Fit

CHANGED_LEVEL = 0.055
"""Colour difference (channel of 0..1) of a changed patch. Chosen on the rooms lab and desk."""

CHANGED_SHARE = 0.02
"""Share of changed patches from which a resting object is measured again. Chosen on the rooms lab
and desk."""

PATCH_PX = 5
"""Side in px of the patches compared at rest."""

BESIDE_PX = 6.0
"""Distance in px outside the contour of the patches around an object."""

BESIDE_STEP = 4
"""Contour points per patch around an object."""


def first_look(task: Task) -> bool:
    """Whether a resting object's patches are unchanged, so that nothing needs to be solved."""
    rest, track = task.track.rest, task.track
    if rest is None or track.state is not TrackState.STATIC or rest.inside == 0:
        return False
    apart = _colours_at(task, rest.lens, rest.corners) - rest.colours
    # Exposure drifts equally everywhere; changes are deviations from the median.
    apart = np.abs(apart - np.median(apart, axis=0))[: rest.inside]
    return float((apart.max(axis=1) > CHANGED_LEVEL).mean()) < CHANGED_SHARE


def rest_of(task: Task, fit: Fit) -> Rest:
    """Patch colours on and around an object at rest, including those of its occluders."""
    reduced, view = fit.reduced, view_of(task.scene, task.model, fit.world_from_object)
    camera_from_object = view.world_from_camera.inverse() @ fit.world_from_object
    inside, _ = view.camera.project(camera_from_object @ reduced.surface)
    border, _ = view.camera.project(camera_from_object @ reduced.contour.points)
    around = (border + BESIDE_PX * reduced.contour.normals)[::BESIDE_STEP]
    pixels = view.lens_pixels(np.concatenate([inside, around]))
    lens = task.scene.frame.rig.lenses[view.lens]
    limit = np.array([lens.width_px, lens.height_px]) - PATCH_PX
    corners = np.clip(np.floor(pixels - 0.5 * PATCH_PX), 0, limit).astype(np.int64)
    return Rest(view.lens, corners, _colours_at(task, view.lens, corners), len(inside))


def around(belief: Belief) -> NDArray[np.float32]:
    """(h, w, 3) colours of what a window shows, in patches.

    One that changes is as much as must differ from the empty room where an object is supposed.
    """
    side = max(math.sqrt(MIN_CHANGED * belief.before.area_px), 1.0)
    height, width = belief.observation.changed.shape
    size = (math.ceil(width / side), math.ceil(height / side))
    live = cv2.resize(belief.observation.live, size, interpolation=cv2.INTER_AREA)
    return np.asarray(live, dtype=np.float32)


def has_stirred(before: NDArray[np.float32] | None, now: NDArray[np.float32]) -> bool:
    """Whether something has moved between two pictures `around` an object, or they cannot say."""
    if before is None or before.shape != now.shape:
        return True
    apart = (now - before).reshape(-1, 3)
    # Exposure drifts equally everywhere.
    return float(np.abs(apart - np.median(apart, axis=0)).max()) > CHANGED_LEVEL


def _colours_at(task: Task, lens: int, corners: NDArray[np.int64]) -> NDArray[np.float32]:
    means = native.patch_means(task.scene.frame.images[lens], corners, PATCH_PX)
    return means.reshape(-1, 3)
