"""Spatial input, port 3812: head, eyes and hands. The client sends nothing at all."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntFlag
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.hololens.wire.taking import WireError

HAND_JOINTS = 26
"""Joints of a hand: palm, wrist, four of the thumb, five of each other finger."""

JOINT_LAYOUT = np.dtype(
    [
        ("orientation", "<f4", (4,)),
        ("position", "<f4", (3,)),
        ("radius", "<f4"),
        ("accuracy", "<i4"),
    ]
)
"""One joint, 36 bytes: quaternion x y z w, metres, metres, 0 for high accuracy or 1."""

INPUT_LAYOUT = np.dtype(
    [
        ("valid", "<u4"),
        ("head", "<f4", (3, 3)),
        ("eyes", "<f4", (2, 3)),
        ("left", JOINT_LAYOUT, (HAND_JOINTS,)),
        ("right", JOINT_LAYOUT, (HAND_JOINTS,)),
    ]
)
"""One payload, 1936 bytes: flags; head as position, forward, up; eyes as origin, direction."""


class Valid(IntFlag):
    """Parts of a payload that are of this moment; the others are what they were."""

    HEAD = 1
    EYES = 2
    LEFT = 4
    RIGHT = 8


@dataclass(frozen=True, slots=True, eq=False)
class SpatialInput:
    """One sample.

    Attributes:
        valid: which parts are of this moment.
        head: (3, 3) float32: position, forward, up.
        eyes: (2, 3) float32: origin, direction.
        left: (26,) of `JOINT_LAYOUT`.
        right: (26,) of `JOINT_LAYOUT`.
    """

    valid: Valid
    head: NDArray[np.float32]
    eyes: NDArray[np.float32]
    left: NDArray[Any]
    right: NDArray[Any]


def encode_input(sample: SpatialInput) -> bytes:
    """Return a sample's 1936 bytes."""
    payload = np.zeros((), INPUT_LAYOUT)
    payload["valid"] = int(sample.valid)
    for name in ("head", "eyes", "left", "right"):
        payload[name] = getattr(sample, name)
    return payload.tobytes()


def read_input(payload: bytes) -> SpatialInput:
    """Read a sample.

    Raises:
        WireError: it has another size.
    """
    if len(payload) != INPUT_LAYOUT.itemsize:
        raise WireError(
            f"spatial input: payload of {len(payload)} bytes, wanted {INPUT_LAYOUT.itemsize}"
        )
    values = np.frombuffer(payload, INPUT_LAYOUT)[0]
    valid = Valid(int(values["valid"]) & 15)
    return SpatialInput(valid, values["head"], values["eyes"], values["left"], values["right"])
