"""Pose of the 360° camera, and whether it still holds."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from devices.messages import Frame
from scenes.pose import Pose, rotation_angle, rotation_from_vector
from tracking.background.images import BackgroundImages
from tracking.camera.calibration import Calibration
from tracking.camera.watch import Watch, turned_since

RIG_MOVED_M = 0.02
"""Marker displacement in m from which the camera was moved."""

RIG_TURNED_RAD = np.deg2rad(0.6)
"""Marker turn in rad from which the camera was moved."""


BUMPED_RAD = np.deg2rad(0.12)
"""Turn in rad measured in a lens from which the camera may have been bumped."""

BUMPED_LOOKS = 2
"""Consecutive such measurements that mean that it was bumped."""


@dataclass(frozen=True, slots=True, eq=False)
class RigState:
    """Pose of the camera and what depends on it.

    Attributes:
        marker_world_from_rig: the marker's pose of the camera at the last refinement.
        calibration: the refined pose.
        background: the empty room from there.
        watches: reference details of each lens.
        turned_looks: consecutive checks, until the last, that found the camera turned.
    """

    marker_world_from_rig: Pose
    calibration: Calibration
    background: BackgroundImages
    watches: tuple[Watch, ...]
    turned_looks: int = 0

    def is_unmoved(self, marker_world_from_rig: Pose) -> bool:
        """Whether the marker's pose is unchanged but for its jitter."""
        moved = self.marker_world_from_rig.inverse() @ marker_world_from_rig
        return (
            float(np.linalg.norm(moved.translation)) < RIG_MOVED_M
            and rotation_angle(moved.rotation) < RIG_TURNED_RAD
        )

    @property
    def is_bumped(self) -> bool:
        """Whether the lens pictures show that the camera has turned."""
        return self.turned_looks >= BUMPED_LOOKS


def looked_through(known: RigState, frame: Frame, turn: int | None) -> tuple[RigState, Pose]:
    """The rig's state after a check of one lens, if one is due, and the turn that it found.

    A bumped camera turns in all its lenses; a person in front of one changes only that.

    Args:
        known: the state so far.
        frame: the live pictures.
        turn: running number of the lens to check; None if none is due.
    """
    if turn is None:
        return known, Pose.identity()
    lens = turn % len(known.watches)
    vector = turned_since(known.watches[lens], frame.images[lens])
    if vector is None or float(np.linalg.norm(vector)) < BUMPED_RAD:
        return replace(known, turned_looks=0), Pose.identity()
    rig_from_lens = frame.rig.rig_from_lens[lens]
    turned = Pose(rotation_from_vector(vector), np.zeros(3))
    rig_from_turned = rig_from_lens @ turned @ rig_from_lens.inverse()
    return replace(known, turned_looks=known.turned_looks + 1), rig_from_turned
