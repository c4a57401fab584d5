"""A detector that makes no mistakes, for measuring what comes after it: the simulator's own masks.

The paper segments with a trained network, which cannot be had here without its weights. Its
optimiser is therefore measured with the best masks there can be; the network's errors are left out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from devices.messages import Frame
from scenes.pose import Pose
from scenes.warp import WarpTable, warp, warp_table
from tracking.baseline.detect import Detection, Expected
from tracking.baseline.rectify import RectifiedView

Masks = Mapping[str, tuple[NDArray[np.bool_], ...]]
"""Per object id one (H, W) bool mask per lens."""

SMALLEST_PX = 12
"""Objects with fewer visible pixels in the view are not reported."""


class PerfectDetector:
    """Reports every object that is seen, with exactly its visible pixels.

    Shown each frame by the session before the tracker asks; knows the front lens's view only.
    """

    def __init__(self) -> None:
        self._frame: Frame | None = None
        self._masks: Masks = {}
        self._table: WarpTable | None = None

    def see(self, frame: Frame, masks: Masks) -> None:
        """The frame that will be asked about, and where each body really is in its lenses."""
        self._frame = frame
        self._masks = masks

    def detect(self, view: RectifiedView, expected: Sequence[Expected]) -> tuple[Detection, ...]:
        """The visible part of each expected object in the front lens's rectified view.

        Raises:
            ValueError: no frame was shown.
        """
        if self._frame is None:
            raise ValueError("PerfectDetector.detect: no frame was shown; call see() first")
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
