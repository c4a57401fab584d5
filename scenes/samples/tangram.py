"""The built-in room `tangram`: a puzzle on the table of `desk` (paper section 6.1, figure 7)."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from scenes.mesh import PhysicalObject, PhysicalRoom
from scenes.pose import Pose
from scenes.samples import desk
from scenes.samples.light import UnlitRoom
from scenes.samples.pieces import piece
from scenes.samples.room import lit_room

RIG = np.array([0.0, -0.3, desk.TABLE_HIGH[2] + 0.5])
"""Position of the 360° camera, metres: half a metre above the table's edge."""

SCATTERED = {
    "large-1": (40.0, -0.40, 0.20),
    "large-2": (-60.0, 0.60, 0.28),
    "medium-1": (30.0, 0.36, 0.61),
    "small-1": (-35.0, 0.13, 0.63),
    "small-2": (65.0, -0.04, 0.63),
    "square-1": (20.0, -0.22, 0.63),
    "parallelogram-1": (-15.0, -0.38, 0.60),
}
"""Yaw in degrees and place (x, y) in metres of every piece at the start."""


def build() -> PhysicalRoom:
    """The room, lit; the same one each time."""
    room = lit_room(
        "desk", unlit, _objects(), inside=desk.BOX, rig=RIG, towards_light=desk.TOWARDS_WINDOW
    )
    return replace(room, name="tangram")


def unlit() -> UnlitRoom:
    """Build the fixed part, before there is light: that of `desk`, whose traced light it shares."""
    return desk.unlit()


def _objects() -> tuple[PhysicalObject, ...]:
    top = desk.TABLE_HIGH[2]
    return tuple(
        piece(object_id, Pose.from_yaw(math.radians(yaw_deg), (x, y, top)))
        for object_id, (yaw_deg, x, y) in SCATTERED.items()
    )
