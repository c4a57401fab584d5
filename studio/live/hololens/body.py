"""A headset's wearer as people in a session see them: head, hands, what they point and look at."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devices.hololens.values import HandJoints, HeadAndHands, Joint
from devices.hub.protocol.wire import Body, Hand
from scenes.frames import OPENGL_FROM_OPENCV, WORLD_FROM_GLTF
from scenes.pose import Pose
from scenes.state import Avatar

Floats = NDArray[np.float64]

RAY_M = 2.5
"""Length of a pointing ray, metres: to the other side of a room."""

STRAIGHT, BENT = 0.9, 0.6
"""Cosines between the first and the last bone of a finger: above the first it is stretched, below
the second it is curled; chosen: 26 and 53 degrees."""

FINGERS = (
    (Joint.INDEX_PROXIMAL, Joint.INDEX_INTERMEDIATE, Joint.INDEX_DISTAL, Joint.INDEX_TIP),
    (Joint.MIDDLE_PROXIMAL, Joint.MIDDLE_INTERMEDIATE, Joint.MIDDLE_DISTAL, Joint.MIDDLE_TIP),
)
"""Joints by which pointing is told: a stretched index finger beside a curled middle finger."""


def avatar_of(
    sample: HeadAndHands, world_from_device: Pose, *, user_id: str, name: str
) -> Avatar | None:
    """Return the wearer in the room; None while the headset does not know where it is.

    Args:
        sample: of the headset.
        world_from_device: where its own world is in the room.
        user_id: of the wearer.
        name: of the wearer.
    """
    if sample.world_from_head is None:
        return None
    hands = tuple(
        world_from_device @ _without_palm(hand.positions_m)
        for hand in (sample.left, sample.right)
        if hand is not None
    )
    ray, gaze = pointing_ray(sample), None
    if sample.gaze is not None:
        eye, ahead = sample.gaze.origin_m, sample.gaze.direction
        gaze = world_from_device @ np.stack([eye, eye + ahead])
    return Avatar(
        user_id,
        "local",
        world_from_device @ sample.world_from_head,
        hands,
        None if ray is None else world_from_device @ ray,
        name,
        gaze,
    )


def body_of(sample: HeadAndHands, world_from_device: Pose) -> Body | None:
    """Return the wearer as a body that hubs send on; None as for `avatar_of`."""
    if sample.world_from_head is None:
        return None
    room_from_device = WORLD_FROM_GLTF.inverse() @ world_from_device
    ray = pointing_ray(sample)
    return Body(
        sample.seq & 0xFFFFFFFF,
        max(sample.t_ns // 1000, 0),
        room_from_device @ sample.world_from_head @ OPENGL_FROM_OPENCV,
        hands=(_hand(sample.left, room_from_device), _hand(sample.right, room_from_device)),
        ray=None if ray is None else room_from_device @ ray,
    )


def pointing_ray(sample: HeadAndHands) -> Floats | None:
    """Return (2, 3) from a fingertip along the finger, in the headset's world; None if none points.

    The right hand is looked at first.
    """
    for hand in (sample.right, sample.left):
        if hand is None:
            continue
        index, middle = (_straightness(hand, finger) for finger in FINGERS)
        if index < STRAIGHT or middle > BENT:
            continue
        tip = hand.positions_m[Joint.INDEX_TIP]
        along = tip - hand.positions_m[Joint.INDEX_PROXIMAL]
        return np.stack([tip, tip + RAY_M * along / max(float(np.linalg.norm(along)), 1e-6)])
    return None


def _straightness(hand: HandJoints, finger: tuple[Joint, ...]) -> float:
    """Return the cosine between a finger's first and last bone."""
    places = hand.positions_m[list(finger)]
    first, last = places[1] - places[0], places[-1] - places[-2]
    size = float(np.linalg.norm(first) * np.linalg.norm(last))
    return float(first @ last) / size if size > 1e-9 else 0.0


def _without_palm(joints: Floats) -> Floats:
    """Return 25 joints as WebXR has them, of 26 as OpenXR has them: there is no palm."""
    return np.delete(joints, Joint.PALM, axis=0)


def _hand(hand: HandJoints | None, room_from_device: Pose) -> Hand | None:
    if hand is None:
        return None
    joints = room_from_device @ _without_palm(hand.positions_m)
    return Hand(joints, np.delete(hand.radii_m, Joint.PALM))
