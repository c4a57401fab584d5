"""Collision bits of all bodies, and the stiffness of contacts."""

from __future__ import annotations

STATIC_BIT = 1
OBJECT_BIT = 2
HAND_BIT = 4
TORSO_BIT = 8
TRACKED_BIT = 16
"""Bodies moved by a tracker: they push free objects and are stopped by nothing."""

# MuJoCo takes the larger friction of two surfaces, so the room leaves the choice to the object.
ROOM_FRICTION = (0.05, 0.001, 0.0001)
FLOOR_HALF_SIZE_M = 20.0
CONTACT_TIME_S = 0.008
"""Time constant of a contact (four steps): a book sinks by well under a millimetre."""
