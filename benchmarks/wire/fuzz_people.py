"""Parsers of people in a session, as targets of `fuzz.py`: bodies, texts, pairing, tokens."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from random import Random
from typing import Any

import numpy as np

from devices.hub.entities.board import Board
from devices.hub.entry.tokens import Ticket, TokenRefused, Tokens
from devices.hub.fields import MessageError, read_object
from devices.hub.media.offer import OfferError, clean_offer, read_offer
from devices.hub.media.voice_wire import Voice, decode_voice, encode_voice
from devices.hub.messages import Do, OpError, clean_name, read_message
from devices.hub.roles import Role
from devices.hub.wire import (
    JOINTS,
    Body,
    Controller,
    Hand,
    WireError,
    check_body,
    decode_body,
    encode_body,
    pack_bodies,
    unpack_bodies,
)
from scenes.pose import Pose

PeopleTarget = tuple[tuple[bytes, ...], Callable[[bytes], object], tuple[type[Exception], ...]]
"""Valid inputs, what reads one, and what it raises for what it cannot read."""

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
    {"kind": "seen", "version": 3},
    {"kind": "ping", "t_us": 12.5},
    {"kind": "hello", "token": "t", "name": "Anna", "log_seq": 3},
    {"kind": "media", "voice": "socket", "microphone": True, "videos": ["p1/tv"]},
    {"kind": "offer", "sdp": "v=0"},
)
"""Everything that clients say in text."""

OFFER = "\r\n".join(
    (
        "v=0",
        "m=audio 9 UDP/TLS/RTP/SAVPF 111",
        "a=candidate:1 1 udp 2113937151 f00f.local 50123 typ host",
        "a=ice-ufrag:4ZcD",
        "a=ice-pwd:FyI7SBP3LySPGxNVL9fFVFPW",
        f"a=fingerprint:sha-256 {':'.join(['AB'] * 32)}",
        "a=mid:0",
        "a=extmap:1 urn:ietf:params:rtp-hdrext:ssrc-audio-level",
        "a=sendonly",
        "a=rtpmap:111 opus/48000/2",
        "a=ssrc:3570614608 cname:a",
    )
)
"""A microphone as browsers offer it."""


VOICE = Voice(3, 2880, 20, bytes([120]) + bytes(40))
"""A moment of 20 ms."""


def people_targets() -> Mapping[str, PeopleTarget]:
    """Return all of them by name."""
    bodies = valid_bodies()
    bundles = (pack_bodies([(1, bodies[0]), (2, bodies[1])]), pack_bodies([]))
    pairing = (b'{"code":"123456","name":"Anna"}', b'{"code":"000000"}')
    tokens = Tokens(Random(0).randbytes)
    token = tokens.make(Ticket("p1", Role.REMOTE, 1), 0).encode()
    return {
        "bodies": (bodies, _read_body, (WireError,)),
        "bundles of bodies": (bundles, _read_bundle, (WireError,)),
        "voices": ((encode_voice(VOICE),), _read_voice, (WireError,)),
        "offers of WebRTC": ((OFFER.encode(),), _read_offer, (OfferError,)),
        "texts of people": (valid_texts(), _Reading().read, (MessageError, OpError)),
        "requests to pair": (pairing, _read_pairing, (MessageError,)),
        "tokens": (
            (token,),
            lambda data: tokens.read(data.decode("utf-8", "replace"), 0),
            (TokenRefused,),
        ),
    }


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


def _read_body(data: bytes) -> None:
    """As the hub does, and then the session: one that is let through can be decoded."""
    check_body(data)
    decode_body(data)


def _read_voice(data: bytes) -> None:
    if encode_voice(decode_voice(data)) != data:
        raise AssertionError("a voice does not give the bytes back")


def _read_offer(data: bytes) -> None:
    """As the hub does: what our side gets is an offer that can be read."""
    read_offer(clean_offer(read_offer(data.decode("utf-8", "replace")), "127.0.0.1"))


def _read_bundle(data: bytes) -> None:
    if pack_bodies(unpack_bodies(data)) != data:
        raise AssertionError("bodies do not give the bytes back")


class _Reading:
    """Texts of one person, which are done on a board that lives on."""

    def __init__(self) -> None:
        self._board, self._now_ns = Board(), 0

    def read(self, data: bytes) -> None:
        """Read one, and do it."""
        self._now_ns += 10**8
        message = read_message(data.decode("utf-8", "replace"))
        if isinstance(message, Do):
            json.dumps(self._board.do("p1", message, now_ns=self._now_ns).entry(), allow_nan=False)


def _read_pairing(data: bytes) -> None:
    clean_name(read_object(data).get("name", "somebody"))
