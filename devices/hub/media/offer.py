"""An offer of WebRTC from a browser: what we need of it is read, and written anew for our side.

The text of a stranger goes no further than this module. Its addresses are left out, too: the
address that the WebSocket comes from stands for all of them, so that nobody can let this machine
send anything to somebody else, and no name of a network is asked for.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from types import MappingProxyType

MAX_OFFER_BYTES = 64 * 1024
"""Length of an offer: Chromium's of eleven tracks is 20 kB."""

MAX_LINES, MAX_LINE = 2500, 1024
"""Lines of an offer, and letters of a line."""

MAX_TRACKS = 24
"""Tracks of an offer."""

MAX_PORTS = 8
"""Addresses of one device that are tried."""

EXTENSIONS = MappingProxyType(
    {
        "urn:ietf:params:rtp-hdrext:sdes:mid": "mid",
        "urn:ietf:params:rtp-hdrext:ssrc-audio-level": "level",
        "http://www.webrtc.org/experiments/rtp-hdrext/abs-send-time": "time",
    }
)
"""Extensions of packets that we use."""

CODECS = MappingProxyType({"audio": ("opus", "48000"), "video": ("vp8", "90000")})
"""Codecs: those that every browser has to have (RFC 7874, RFC 7742), and their clocks."""

DIRECTIONS = ("sendonly", "recvonly", "sendrecv", "inactive")
"""Ways a track may go, from the browser's side."""

VOICE_LINE = "minptime=10;useinbandfec=1;usedtx=1;maxaveragebitrate=32000"
"""Opus as we ask for it: lost packets are made good, silence costs nothing, 32 kbit/s."""

_MEDIA = re.compile(r"(audio|video) (\d{1,5}) [A-Z/]{1,20}((?: \d{1,3}){1,64})")
"""A track: its kind, its port, codecs."""

_MAP = re.compile(r"(\d{1,3}) ([A-Za-z0-9-]{1,20})/(\d{4,6})(?:/\d)?")
"""A codec: number, name, clock."""

_EXTENSION = re.compile(r"(\d{1,2})(?:/[a-z]{1,10})? (\S{1,120})")
"""An extension: number, name."""

_REPAIR = re.compile(r"(\d{1,3}) apt=(\d{1,3})")
"""A retransmission: its number, and the codec that it repairs."""

_CANDIDATE = re.compile(r"\S{1,40} 1 udp \d{1,10} \S{1,80} (\d{1,5}) typ host(?: .*)?", re.I)
"""A port of the device's own, over UDP."""

_SOURCE = re.compile(r"(\d{1,10}) \S.*")
"""A stream: its number."""

_PATTERNS = MappingProxyType(
    {
        "ice-ufrag": re.compile(r"[A-Za-z0-9+/]{4,256}"),
        "ice-pwd": re.compile(r"[A-Za-z0-9+/]{22,256}"),
        "fingerprint": re.compile(r"sha-256 (?:[0-9A-Fa-f]{2}:){31}[0-9A-Fa-f]{2}", re.I),
        "mid": re.compile(r"[A-Za-z0-9_-]{1,16}"),
    }
)
"""Texts that are taken over as they are: secrets, fingerprint, names."""


class OfferError(ValueError):
    """A text that is no offer we can answer; says which part."""


@dataclass(slots=True)
class Track:
    """One track of an offer.

    Attributes:
        kind: "audio" or "video".
        is_offered: whether it is really offered; one that is not stays refused.
        mid: the browser's name of it.
        direction: one of `DIRECTIONS`, from the browser's side.
        payload: number of the codec; None where the browser has not ours.
        repair: number of its retransmissions; None without.
        extensions: numbers of `EXTENSIONS` by their short name.
        source: number of the browser's own stream; None where it sends none.
    """

    kind: str
    is_offered: bool
    mid: str = ""
    direction: str = "sendrecv"
    payload: int | None = None
    repair: int | None = None
    extensions: dict[str, int] = field(default_factory=dict[str, int])
    source: int | None = None

    @property
    def is_from_guest(self) -> bool:
        """Whether the browser sends on it."""
        return self.direction in ("sendonly", "sendrecv")


@dataclass(frozen=True, slots=True)
class Offer:
    """Everything of an offer that is used.

    Attributes:
        user: first half of the browser's secret for addresses.
        password: the other one.
        fingerprint: of the browser's certificate.
        ports: at which it waits.
        tracks: in its order.
    """

    user: str
    password: str
    fingerprint: str
    ports: tuple[int, ...]
    tracks: tuple[Track, ...]


def read_offer(text: str) -> Offer:
    """Return what an offer says.

    Raises:
        OfferError: it is none, or too long.
    """
    if len(text) > MAX_OFFER_BYTES:
        raise OfferError(f"offer: {len(text)} letters, at most {MAX_OFFER_BYTES}")
    lines = text.split("\n")
    if len(lines) > MAX_LINES:
        raise OfferError(f"offer: {len(lines)} lines, at most {MAX_LINES}")
    common: dict[str, str] = {}
    ports: list[int] = []
    tracks: list[Track] = []
    repairs: dict[int, int] = {}
    for raw in lines:
        line = raw.rstrip("\r")
        if len(line) > MAX_LINE:
            raise OfferError(f"offer: a line of {len(line)} letters, at most {MAX_LINE}")
        if line.startswith("m="):
            tracks.append(_track(line[2:], len(tracks)))
            repairs = {}
        elif line.startswith("a="):
            name, _, value = line[2:].partition(":")
            if name == "candidate":
                _add_port(ports, value)
            elif name == "fingerprint" and not value.lower().startswith("sha-256 "):
                continue  # the same certificate by another sum
            elif name in _PATTERNS and name != "mid":
                _keep(common, name=name, value=value)
            elif tracks:
                _read_line(tracks[-1], repairs, name=name, value=value)
    if missing := [name for name in ("ice-ufrag", "ice-pwd", "fingerprint") if name not in common]:
        raise OfferError(f"offer: without {', '.join(missing)}")
    _check(tracks)
    keys = (common["ice-ufrag"], common["ice-pwd"], common["fingerprint"])
    return Offer(*keys, tuple(ports), tuple(tracks))


def clean_offer(offer: Offer, address: str) -> str:
    """Return an offer as our side is to see it.

    Args:
        offer: as it was read.
        address: from which the person's WebSocket comes.
    """
    version = "IP6" if ":" in address else "IP4"
    mids = " ".join(track.mid for track in offer.tracks)
    lines = ["v=0", "o=- 1 1 IN IP4 0.0.0.0", "s=-", "t=0 0", f"a=group:BUNDLE {mids}"]
    for track in offer.tracks:
        codec, clock = CODECS[track.kind]
        channels = "/2" if track.kind == "audio" else ""
        numbers = str(track.payload) + ("" if track.repair is None else f" {track.repair}")
        lines += [
            f"m={track.kind} 9 UDP/TLS/RTP/SAVPF {numbers}",
            f"c=IN {version} {address}",
            f"a=ice-ufrag:{offer.user}",
            f"a=ice-pwd:{offer.password}",
            f"a=fingerprint:{offer.fingerprint}",
            "a=setup:actpass",
            f"a=mid:{track.mid}",
            f"a={track.direction}",
            "a=rtcp-mux",
            f"a=rtpmap:{track.payload} {codec.upper() if codec == 'vp8' else codec}/{clock}"
            f"{channels}",
        ]
        if track.kind == "audio":
            lines.append(f"a=fmtp:{track.payload} minptime=10;useinbandfec=1")
        else:
            lines += [f"a=rtcp-fb:{track.payload} {kind}" for kind in ("nack", "nack pli")]
        if track.repair is not None:
            lines.append(f"a=rtpmap:{track.repair} rtx/{clock}")
            lines.append(f"a=fmtp:{track.repair} apt={track.payload}")
        for uri, name in EXTENSIONS.items():
            if (number := track.extensions.get(name)) is not None:
                lines.append(f"a=extmap:{number} {uri}")
        if track.source is not None and track.is_from_guest:
            lines.append(f"a=ssrc:{track.source} cname:guest")
        for number, port in enumerate(offer.ports):
            lines.append(f"a=candidate:{number} 1 udp {1000 - number} {address} {port} typ host")
        lines.append("a=end-of-candidates")
    return "\r\n".join(lines) + "\r\n"


def asking_for_speech(answer: str) -> str:
    """Return our answer with Opus as we want it for speech."""
    found = re.search(r"a=rtpmap:(\d+) opus/48000/2\r\n", answer)
    if found is None:
        return answer
    number = found[1]
    without = re.sub(rf"a=fmtp:{number} [^\r]*\r\n", "", answer)
    return without.replace(found[0], f"{found[0]}a=fmtp:{number} {VOICE_LINE}\r\n")


def _track(line: str, number: int) -> Track:
    if number >= MAX_TRACKS:
        raise OfferError(f"offer: over {MAX_TRACKS} tracks")
    found = _MEDIA.fullmatch(line)
    if found is None:
        raise OfferError(f"offer: track {number}: neither audio nor video")
    return Track(found[1], is_offered=found[2] != "0")


def _keep(common: dict[str, str], *, name: str, value: str) -> None:
    if _PATTERNS[name].fullmatch(value) is None:
        raise OfferError(f"offer: {name} cannot be read")
    if common.setdefault(name, value) != value:
        raise OfferError(f"offer: {name}: several; all tracks have to be one bundle")


def _add_port(ports: list[int], value: str) -> None:
    found = _CANDIDATE.fullmatch(value)
    if found is None:
        return
    port = int(found[1])
    if 1024 <= port <= 65535 and port not in ports and len(ports) < MAX_PORTS:
        ports.append(port)


def _read_line(track: Track, repairs: dict[int, int], *, name: str, value: str) -> None:
    if name in DIRECTIONS:
        track.direction = name
    elif name == "mid":
        if _PATTERNS["mid"].fullmatch(value) is None:
            raise OfferError("offer: mid cannot be read")
        track.mid = value
    elif name == "rtpmap" and (found := _MAP.fullmatch(value)):
        codec, clock = CODECS[track.kind]
        if (found[2].lower(), found[3]) == (codec, clock) and track.payload is None:
            track.payload = _payload(found[1])
    elif name == "fmtp" and (found := _REPAIR.fullmatch(value)):
        repairs[int(found[2])] = _payload(found[1])
        if track.payload is not None:
            track.repair = repairs.get(track.payload)
    elif name == "extmap" and (found := _EXTENSION.fullmatch(value)):
        short = EXTENSIONS.get(found[2])
        if short is not None and 1 <= int(found[1]) <= 14:
            track.extensions[short] = int(found[1])
    elif name == "ssrc" and track.source is None and (found := _SOURCE.fullmatch(value)):
        track.source = int(found[1]) & 0xFFFFFFFF


def _payload(text: str) -> int:
    number = int(text)
    if not 0 <= number <= 127 or 64 <= number <= 95:
        raise OfferError(f"offer: payload {number}, wanted 0 to 63 or 96 to 127")
    return number


def _check(tracks: list[Track]) -> None:
    if not tracks:
        raise OfferError("offer: no tracks")
    mids = [track.mid for track in tracks]
    if "" in mids or len(set(mids)) < len(mids):
        raise OfferError("offer: each track needs a mid of its own")
    for track in tracks:
        if not track.is_offered or track.payload is None:
            raise OfferError(f"offer: track {track.mid}: wanted {CODECS[track.kind][0]}")
        if track.repair == track.payload:
            raise OfferError(f"offer: track {track.mid}: it repairs itself")
