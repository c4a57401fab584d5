"""Parsers of people in a session, as targets of `fuzz.py`: bodies, texts, pairing, tokens."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from random import Random

from devices.hub.entities.board import Board
from devices.hub.entry.tokens import Ticket, TokenRefused, Tokens
from devices.hub.media.offer import OfferError, clean_offer, read_offer
from devices.hub.media.voice_wire import Voice, decode_voice, encode_voice
from devices.hub.protocol.fields import MessageError, read_object
from devices.hub.protocol.messages import Do, OpError, clean_name, read_message
from devices.hub.protocol.wire import WireError, check_body, decode_body, pack_bodies, unpack_bodies
from devices.hub.roles import Person, Role
from sim.wire.people_messages import valid_bodies, valid_texts

PeopleTarget = tuple[tuple[bytes, ...], Callable[[bytes], object], tuple[type[Exception], ...]]
"""Valid inputs, what reads one, and what it raises for what it cannot read."""

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

ANNA = Person("p1", 1, "Anna", Role.REMOTE)
"""A person who sends the texts."""

BEN = Person("p2", 2, "Ben", Role.LOCAL)
"""Somebody to whom a shape can be given."""


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
            done = self._board.carry_out(ANNA, message, here=(ANNA, BEN), now_ns=self._now_ns)
            json.dumps(done.entry(), allow_nan=False)


def _read_pairing(data: bytes) -> None:
    clean_name(read_object(data).get("name", "somebody"))
