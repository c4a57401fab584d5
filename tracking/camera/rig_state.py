"""Where the 360° camera stands, and whether it still does."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from devices.messages import Frame
from scenes.pose import Pose, rotation_angle, rotation_from_vector
from tracking.background.images import BackgroundImages
from tracking.camera.calibration import Calibration
from tracking.camera.watch import Watch, turned_since

RIG_MOVED_M = 0.02
RIG_TURNED_RAD = np.deg2rad(0.6)
"""A marker that moved more than this means that the camera was moved, not that the marker shook."""

BUMPED_RAD = np.deg2rad(0.12)
BUMPED_LOOKS = 2
"""So many looks in a row that find it turned by more mean that it was bumped."""


@dataclass(frozen=True, slots=True, eq=False)
class RigState:
    """Where the camera stands.

    Attributes:
        marker_world_from_rig: what the marker said when the camera was last refined.
        calibration: the refined pose.
        background: the empty room from there.
        watches: what each lens saw then.
        turned_looks: looks in a row, until the last, that found the camera turned.
    """

    marker_world_from_rig: Pose
    calibration: Calibration
    background: BackgroundImages
    watches: tuple[Watch, ...]
    turned_looks: int = 0

    def is_unmoved(self, marker_world_from_rig: Pose) -> bool:
        """Whether the marker still says so, apart from its shaking."""
        moved = self.marker_world_from_rig.inverse() @ marker_world_from_rig
        return (
            float(np.linalg.norm(moved.translation)) < RIG_MOVED_M
            and rotation_angle(moved.rotation) < RIG_TURNED_RAD
        )

    @property
    def is_bumped(self) -> bool:
        """Whether the picture says that it does not stand so any more."""
        return self.turned_looks >= BUMPED_LOOKS


def looked_through(known: RigState, frame: Frame, turn: int | None) -> tuple[RigState, Pose]:
    """The rig's state after a look through one lens, if it is time, and how far it has turned.

    A bumped camera moves in all its lenses; somebody in front of one is seen by that alone.

    Args:
        known: the state so far.
        frame: what is looked at.
        turn: which lens it is the turn of, counted on for ever; None if of none.
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
