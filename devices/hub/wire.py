"""Head, controllers and hands of a person in bytes, as they travel at a headset's display rate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose

VERSION = 1
"""Of the layout; others are refused."""

JOINTS = 25
"""Joints of a hand as WebXR names them, wrist first."""


@dataclass(frozen=True, slots=True, eq=False)
class Hand:
    """A tracked hand.

    Attributes:
        joints: (25, 3) metres in the room, y up.
        radii_m: (25,) radius of the skin around each.
    """

    joints: NDArray[np.float64]
    radii_m: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Controller:
    """A controller: where it points from and how it is held, both in glTF axes; its buttons, axes."""

    room_from_aim: Pose
    room_from_grip: Pose
    buttons: int = 0
    axes: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Body:
    """A person's body at one instant. Poses are in glTF axes: metres, y up, looking along -z.

    Attributes:
        seq: counts a person's bodies.
        t_us: the device's own clock.
        room_from_head: None where it is not known.
        controllers: left, right; None where there is none.
        hands: left, right; None where none is tracked.
        ray: (2, 3) start and end of what they point with, metres; None if they do not point.
    """

    seq: int
    t_us: int
    room_from_head: Pose | None
    controllers: tuple[Controller | None, Controller | None] = (None, None)
    hands: tuple[Hand | None, Hand | None] = (None, None)
    ray: NDArray[np.float64] | None = None


def encode_body(body: Body) -> bytes:
    """Return a body as bytes, little endian.

    Layout: `u8 version, u8 kind = 1, u16 flags (1 head, 2 and 4 controllers, 8 and 16 hands, 32 ray),
    u32 seq, u64 t_us`, then what the flags name, in this order: head and poses of controllers as
    7 f32 (x y z, qx qy qz qw), a controller as aim, grip, `u16 buttons, 4 i16 axes`; a hand as
    `3 f32` of its wrist, then 25 × (`3 i16` millimetres from the wrist, `u8` radius, millimetres);
    a ray as 6 f32.
    """
    raise NotImplementedError


def decode_body(data: bytes) -> Body:
    """Return the body in bytes of somebody else.

    Raises:
        WireError: it is cut short, too long, of another version, or a number is not finite or out
            of a room's range (100 m).
    """
    raise NotImplementedError


class WireError(ValueError):
    """Bytes that are no body; says which part, and how many bytes were wanted."""
