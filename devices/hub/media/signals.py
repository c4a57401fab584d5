"""Messages of a client about its media, checked: an offer of WebRTC, and how it gets what."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, cast

from devices.hub.media.offer import MAX_OFFER_BYTES, OfferError

VIDEOS = 4
"""Surfaces that are shown as video; the others stay pictures of the WebSocket."""

_SURFACE = re.compile(r"[A-Za-z0-9_.-]{1,40}(?:/[A-Za-z0-9_.-]{1,40})?")
"""Name of a surface."""


class Way(StrEnum):
    """How voices come to a client."""

    OFF = "off"
    SOCKET = "socket"
    RTC = "rtc"


@dataclass(frozen=True, slots=True)
class OfferSignal:
    """An offer of WebRTC; an empty one ends what there is."""

    sdp: str


@dataclass(frozen=True, slots=True)
class MediaSignal:
    """How a client gets and gives its media.

    Attributes:
        way: how voices are to come.
        has_microphone: whether its microphone is on.
        videos: surfaces that it sees as video, for which it needs no pictures.
    """

    way: Way
    has_microphone: bool
    videos: frozenset[str]


def read_signal(fields: dict[str, Any]) -> OfferSignal | MediaSignal | None:
    """Return what a message says about media; None where it is of another kind.

    Raises:
        OfferError: a field is wrong.
    """
    if fields.get("kind") == "offer":
        sdp: object = fields.get("sdp")
        if not isinstance(sdp, str) or len(sdp) > MAX_OFFER_BYTES:
            raise OfferError(f"offer: sdp: wanted a text of at most {MAX_OFFER_BYTES} letters")
        return OfferSignal(sdp)
    if fields.get("kind") != "media":
        return None
    microphone: object = fields.get("microphone")
    videos: object = fields.get("videos")
    if not isinstance(microphone, bool) or not isinstance(videos, list):
        raise OfferError("media: wanted microphone, true or false, and a list of videos")
    names = cast(list[object], videos)
    if len(names) > VIDEOS:
        raise OfferError(f"media: {len(names)} videos, at most {VIDEOS}")
    kept: set[str] = set()
    for name in names:
        if not isinstance(name, str) or _SURFACE.fullmatch(name) is None:
            raise OfferError("media: videos: wanted names of surfaces")
        kept.add(name)
    try:
        way = Way(str(fields.get("voice")))
    except ValueError:
        raise OfferError(f"media: voice: wanted one of {', '.join(Way)}") from None
    return MediaSignal(way, microphone, frozenset(kept))
