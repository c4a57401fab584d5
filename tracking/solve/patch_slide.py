"""Slides a small object over its window to where it accounts for most of the change.

Its silhouette alone would follow its shadow.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye
from scenes.pose import Pose
from scenes.render.renderer import PosedSplats
from tracking.evidence.surroundings import Surroundings
from tracking.model.object_model import RENDER_OPTIONS
from tracking.solve.slide import shifted
from tracking.window.extent import part_of
from tracking.window.filters import resized

FloatArray = NDArray[np.float32]

SLID = 1.0
"""Largest slide, in radii of the object."""

GAIN_RANGE = (0.5, 2.5)
"""Brightness of the object relative to its scan, lower and upper limit."""


SHRINK = 2
"""Pictures are halved first: what follows is right to a pixel."""


class SmallSlide:
    """Slides an object over its window.

    Args:
        around: the window.
    """

    def __init__(self, around: Surroundings) -> None:
        evidence, model = around.evidence, around.model
        free = 1.0 - evidence.hidden
        apart = evidence.live - around.empty
        changed = np.einsum("hwc,hwc->hw", apart, apart)
        changed -= np.einsum("hwc,hwc->hw", evidence.live, evidence.live)
        radius_px = evidence.camera.f_px * model.radius_m / evidence.view.target_range_m
        self._reach_px = max(round(SLID * radius_px / SHRINK), 1)
        self._changed = self._framed((free * changed).astype(np.float32))
        self._live = self._framed(free[..., None] * evidence.live)
        self._camera = _halved_camera(evidence.camera)
        self._around = around

    def best(self, world_from_object: Pose) -> Pose:
        """The pose of the best slide, without a turn."""
        evidence, model, reach = self._around.evidence, self._around.model, self._reach_px
        drawn = self._around.renderer.render(
            (PosedSplats(model.relightable.splats, world_from_object),),
            self._camera,
            evidence.world_from_camera,
            RENDER_OPTIONS,
        )
        colours, alpha = drawn.rgb, drawn.alpha
        rows, columns = (np.flatnonzero(alpha.any(axis=axis)) for axis in (1, 0))
        if len(rows) == 0:
            return world_from_object
        part = slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)
        near = tuple(slice(side.start, side.stop + 2 * reach) for side in part)
        colours, alpha = np.ascontiguousarray(colours[part]), np.ascontiguousarray(alpha[part])
        # The explained energy of the change is `bare + 2 · gain · both - gain² · power`.
        bare = cv2.matchTemplate(self._changed[near], alpha, cv2.TM_CCORR)
        both = cv2.matchTemplate(self._live[near], colours, cv2.TM_CCORR)
        power = max(float((colours * colours).sum()), 1e-6)
        gain = np.clip(both / power, *GAIN_RANGE)
        explained_energy = bare + 2.0 * gain * both - gain * gain * power
        row, column = np.unravel_index(np.argmax(explained_energy), explained_energy.shape)
        shift = SHRINK * (np.array([column, row], dtype=np.float64) - reach)
        return shifted(world_from_object, shift, evidence, model, grounded=True)

    def _framed(self, picture: FloatArray) -> FloatArray:
        reach, picture = self._reach_px, _halved(picture)
        framed = cv2.copyMakeBorder(
            picture, reach, reach, reach, reach, cv2.BORDER_CONSTANT, value=(0.0, 0.0, 0.0)
        )
        return np.asarray(framed, dtype=np.float32)


def _halved_camera(camera: Fisheye) -> Fisheye:
    width, height = camera.width_px // SHRINK, camera.height_px // SHRINK
    even = part_of(camera, (slice(0, height * SHRINK), slice(0, width * SHRINK)))
    return even.resized(width, height)


def _halved(picture: FloatArray) -> FloatArray:
    height, width = picture.shape[:2]
    even = np.ascontiguousarray(picture[: height // SHRINK * SHRINK, : width // SHRINK * SHRINK])
    return resized(even, (width // SHRINK, height // SHRINK))
