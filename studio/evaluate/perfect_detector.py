"""A detector without errors, for measuring the stages after it: the simulator's own masks.

The paper segments with a trained network, which cannot be had here without its weights. Its
optimiser is therefore measured with the best masks there can be; the network's errors are left out.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from devices.messages import Frame
from scenes.pose import Pose
from scenes.warp import WarpTable, warp, warp_table
from sim.truth import GroundTruth, Masks
from tracking.baseline.detect import Detection, Expected
from tracking.baseline.rectify import RectifiedView

SMALLEST_PX = 12
"""Pixels of the rectified view; objects with fewer visible ones are not reported."""


class PerfectDetector:
    """Reports every visible object of the front lens's view, with exactly its visible pixels.

    A `studio.session.trackers.methods.TruthDetector`.
    """

    def __init__(self) -> None:
        self._frame: Frame | None = None
        self._masks: Masks | None = None
        self._table: WarpTable | None = None

    def see(self, frame: Frame, truth: GroundTruth) -> None:
        """Take the frame that the next calls of `detect` are about, and its ground truth."""
        self.see_masks(frame, truth.masks)

    def see_masks(self, frame: Frame, masks: Masks | None) -> None:
        """The same, where masks are known without a simulator's ground truth."""
        self._frame = frame
        self._masks = masks

    def detect(self, view: RectifiedView, expected: Sequence[Expected]) -> tuple[Detection, ...]:
        """The visible part of each expected object in the front lens's rectified view.

        Raises:
            ValueError: `see` was not called before, or the ground truth that it was given has no
                masks, as a recording's has none.
        """
        if self._frame is None:
            raise ValueError("PerfectDetector.detect: no frame was shown; call see() first")
        if self._masks is None:
            raise ValueError(f"frame {self._frame.seq}: its ground truth has no masks")
        table = self._table
        if table is None or table.valid.shape != (view.camera.height_px, view.camera.width_px):
            table = warp_table(self._frame.rig.lenses[0], view.camera, Pose.identity())
            self._table = table
        found = []
        for candidate in expected:
            if candidate.object_id not in self._masks:
                continue
            lens_mask = self._masks[candidate.object_id][0].astype(np.float32)
            mask = warp(lens_mask, table) > 0.5
            if int(mask.sum()) < SMALLEST_PX:
                continue
            rows = np.flatnonzero(mask.any(axis=1))
            columns = np.flatnonzero(mask.any(axis=0))
            box = np.array([columns[0], rows[0], columns[-1] + 1, rows[-1] + 1], dtype=np.float64)
            found.append(Detection(candidate.object_id, 1.0, box, mask))
        return tuple(found)
