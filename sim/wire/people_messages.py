"""Messages of people's clients, each kind once, as bytes on the wire of a hub's port."""

from __future__ import annotations

import base64
import json
import struct
from typing import Any

import numpy as np

from devices.hub.protocol.wire import JOINTS, Body, Controller, Hand, encode_body
from scenes.pose import Pose

MASK = b"\x11\x22\x33\x44"
"""Mask of a client's frames; any does."""

LINE: dict[str, Any] = {
    "kind": "do",
    "id": 4,
    "op": "line",
    "line": "a",
    "points": [[0, 1, 2.5], [3, 4, 5]],
    "colour": [1, 0.5, 0],
}
"""A line as clients draw one."""

TEXTS: tuple[dict[str, Any], ...] = (
    LINE,
    {**LINE, "points": []},
    {"kind": "do", "id": "s", "op": "surface", "surface": "tv", "corners": [[0, 1, 0]] * 4},
    {
        "kind": "do",
        "id": 5,
        "op": "surface",
        "surface": "tv",
        "corners": [[0, 1, 0], [1, 1, 0], [1, 0, 0], [0, 0, 0]],
        "seen": [[0, 2, 0], [1, 2, 0], [1, 1, 0], [0, 1, 0]],
        "drag": 3,
    },
    {
        "kind": "do",
        "id": 6,
        "op": "primitive",
        "primitive": "b",
        "shape": "arrow",
        "size": [0.5, 0.1, 0.1],
        "colour": [1, 0, 0],
        "pose": [0, 0, 0, 0, 0, 0, 1],
    },
    {
        "kind": "do",
        "id": 7,
        "op": "propose",
        "proposal": "c",
        "object": "chair-1",
        "pose": [1, 0, 2, 0, 1, 0, 0],
    },
    {"kind": "do", "id": 1, "op": "undo"},
    {"kind": "do", "id": 8, "op": "give", "primitive": "b", "to": "p2"},
    {
        "kind": "device",
        "model": "Quest 3",
        "immersion": "vr",
        "worn": True,
        "hz": 72.0,
        "battery": 80,
        "charging": False,
    },
    {"kind": "seen", "version": 3},
    {"kind": "ping", "t_us": 12.5},
    {"kind": "hello", "token": "t", "name": "Anna", "log_seq": 3},
    {"kind": "media", "voice": "socket", "microphone": True, "videos": ["p1/tv"]},
    {"kind": "offer", "sdp": "v=0"},
)
"""Everything that clients say in text."""


def valid_bodies() -> tuple[bytes, ...]:
    """Return a body with everything, and one of a head alone."""
    pose = Pose.from_yaw(0.3, (1, 2, 3))
    hand = Hand(np.full((JOINTS, 3), 1.0), np.full(JOINTS, 0.01))
    controller = Controller(pose, pose, 3, (0.5, -1.0, 0.0, 1.0))
    ray = np.array([[0.0, 1.0, 0.0], [0.0, 1.0, -2.0]])
    whole = Body(7, 8, pose, (controller, controller), (hand, hand), ray)
    return encode_body(whole), encode_body(Body(9, 10, pose))


def valid_texts() -> tuple[bytes, ...]:
    """Return each kind of text once."""
    return tuple(json.dumps(fields).encode() for fields in TEXTS)


def frame(data: bytes, *, opcode: int) -> bytes:
    """Return a WebSocket frame as a client sends it.

    Args:
        data: its content.
        opcode: 1 text, 2 binary, 8 end, 9 ping.
    """
    if len(data) < 126:
        head = bytes([0x80 | opcode, 0x80 | len(data)])
    else:
        head = bytes([0x80 | opcode, 0x80 | 126]) + struct.pack(">H", len(data))
    whole = MASK * (len(data) // 4 + 1)
    return head + MASK + bytes(a ^ b for a, b in zip(data, whole, strict=False))


def upgrade(address: tuple[str, int]) -> bytes:
    """Return the request by which a client asks for a WebSocket."""
    key = base64.b64encode(bytes(range(16)))
    return (
        b"GET /people HTTP/1.1\r\nHost: %b:%d\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: %b\r\n\r\n"
        % (address[0].encode(), address[1], key)
    )


def greeting_of(address: tuple[str, int], token: str) -> bytes:
    """Return an upgrade and a hello with a token that is good."""
    hello = json.dumps({"kind": "hello", "token": token, "name": "Eve"}).encode()
    return upgrade(address) + frame(hello, opcode=1)
