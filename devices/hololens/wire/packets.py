"""Packets of the headset's streams: time, payload and, where it was asked for, a pose."""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.hololens.wire.taking import Take, checked_count, taken

TICK_NS = 100
"""Unit of the headset's times, nanoseconds."""

PACKET_HEADER = struct.Struct("<QI")
"""Before a payload: time in ticks of the headset's own clock, and the payload's size in bytes."""

POSE_BYTES = 64
"""Size of a pose after a payload: a matrix of 4 × 4 float32."""

MODE_DATA, MODE_POSE, MODE_CALIBRATION = 0, 1, 2
"""First byte that a client sends: packets, packets with poses, or one answer about the sensor."""

Matrix = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Packet:
    """One packet.

    Attributes:
        ticks: headset time, 100 ns.
        payload: what the stream is of.
        pose: (4, 4) float32 for row vectors, world = local @ pose; None in a stream without poses.
            All zeros where the headset did not know where it was.
    """

    ticks: int
    payload: bytes
    pose: Matrix | None = None

    @property
    def is_located(self) -> bool:
        """Whether there is a pose that says something."""
        return self.pose is not None and float(self.pose[3, 3]) != 0.0


def encode_packet(packet: Packet) -> bytes:
    """Return a packet's bytes."""
    header = PACKET_HEADER.pack(packet.ticks, len(packet.payload))
    pose = b"" if packet.pose is None else np.asarray(packet.pose, dtype="<f4").tobytes()
    return header + packet.payload + pose


def read_packet(take: Take, *, has_pose: bool, max_bytes: int) -> Packet:
    """Read a packet.

    Args:
        take: where from.
        has_pose: whether the stream was asked for with poses.
        max_bytes: of the payload.

    Raises:
        WireError: the payload is said to be larger than that.
    """
    ticks, size = taken(take, PACKET_HEADER)
    payload = take(checked_count("packet: payload bytes", size, most=max_bytes))
    return Packet(ticks, payload, read_matrix(take(POSE_BYTES)) if has_pose else None)


def read_matrix(data: bytes) -> Matrix:
    """Return (4, 4) float32 of 64 bytes."""
    return np.frombuffer(data, dtype="<f4", count=16).reshape(4, 4)
