"""RTSP 1.0 requests out of bytes, and replies (RFC 2326); every length is bounded."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

MAX_HEADER_BYTES = 8192
"""Limit of a request's line and headers; those of players are about 300 bytes."""

MAX_HEADERS = 64
"""Limit of a request's headers; players send up to ten."""

MAX_BODY_BYTES = 16384
"""Limit of a request's body; players send none, or a few names of parameters."""

MARK = 0x24
"""The "$" before binary data between requests (section 10.12)."""

_LINE = re.compile(r"([A-Z_]{3,20}) (\S{1,2000}) RTSP/1\.0")
_HEADER = re.compile(r"([!-9;-~]{1,64}):[ \t]*([ -~\t\x80-\xff]*)")

REASONS = MappingProxyType(
    {
        200: "OK",
        400: "Bad Request",
        404: "Not Found",
        405: "Method Not Allowed",
        454: "Session Not Found",
        455: "Method Not Valid in This State",
        461: "Unsupported Transport",
        503: "Service Unavailable",
        551: "Option Not Supported",
    }
)
"""Words of the status codes that are given (section 7.1.1)."""


class RtspError(ValueError):
    """Bytes that are no request: the connection cannot be followed any further."""


@dataclass(frozen=True, slots=True)
class Request:
    """One request.

    Attributes:
        method: such as "DESCRIBE".
        url: what it is about.
        cseq: its number, which the reply repeats.
        headers: by name in small letters.
        body: its contents.
    """

    method: str
    url: str
    cseq: int
    headers: Mapping[str, str] = field(default_factory=dict[str, str])
    body: bytes = b""


@dataclass(frozen=True, slots=True)
class Interleaved:
    """Binary data between requests: what a player reports of a stream.

    Attributes:
        channel: which of the connection's channels.
        data: one packet.
    """

    channel: int
    data: bytes


class RequestReader:
    """Takes a connection's bytes in any pieces; holds at most one request of them."""

    def __init__(self) -> None:
        self._held = bytearray()

    @property
    def held_bytes(self) -> int:
        """Bytes of a request that is not whole yet."""
        return len(self._held)

    def feed(self, data: bytes) -> list[Request | Interleaved]:
        """Return all requests that are whole.

        Raises:
            RtspError: it is no RTSP, or longer than allowed.
        """
        self._held += data
        found: list[Request | Interleaved] = []
        while (taken := self._take()) is not None:
            found.append(taken)
        return found

    def _take(self) -> Request | Interleaved | None:
        while self._held and self._held[0] in b"\r\n":
            del self._held[:1]
        if not self._held:
            return None
        if self._held[0] == MARK:
            return self._interleaved()
        end, after = _header_end(self._held)
        if end < 0:
            if len(self._held) > MAX_HEADER_BYTES:
                raise RtspError(f"RTSP: no end of headers within {MAX_HEADER_BYTES} bytes")
            return None
        if end > MAX_HEADER_BYTES:
            raise RtspError(f"RTSP: {end} bytes of headers, at most {MAX_HEADER_BYTES}")
        request = _request(bytes(self._held[:end]).decode("latin-1"))
        size = _body_size(request)
        if len(self._held) < after + size:
            return None
        body = bytes(self._held[after : after + size])
        del self._held[: after + size]
        return Request(request.method, request.url, request.cseq, request.headers, body)

    def _interleaved(self) -> Interleaved | None:
        size = int.from_bytes(self._held[2:4], "big")
        if len(self._held) < 4 + size or len(self._held) < 4:
            return None
        taken = Interleaved(self._held[1], bytes(self._held[4 : 4 + size]))
        del self._held[: 4 + size]
        return taken


def interleaved(channel: int, data: bytes) -> bytes:
    """A packet as it stands between replies.

    Raises:
        ValueError: it is longer than 65,535 bytes.
    """
    if len(data) > 0xFFFF:
        raise ValueError(f"RTSP: a packet of {len(data)} bytes, at most 65535 between replies")
    return bytes([MARK, channel]) + len(data).to_bytes(2, "big") + data


def reply(
    code: int, cseq: int, headers: Mapping[str, str] = MappingProxyType({}), body: str = ""
) -> bytes:
    """A reply; `headers` must hold no line breaks."""
    lines = [f"RTSP/1.0 {code} {REASONS[code]}", f"CSeq: {cseq}"]
    lines += [f"{name}: {value}" for name, value in headers.items()]
    data = body.encode()
    if data:
        lines.append(f"Content-Length: {len(data)}")
    return "\r\n".join([*lines, "", ""]).encode("latin-1") + data


def _header_end(held: bytearray) -> tuple[int, int]:
    """Index at which the headers end and the body begins; -1 if they do not end yet."""
    found = re.search(rb"\r?\n\r?\n", bytes(held[: MAX_HEADER_BYTES + 4]))
    return (-1, -1) if found is None else (found.start(), found.end())


def _request(text: str) -> Request:
    first, *rest = re.split(r"\r?\n", text)
    line = _LINE.fullmatch(first)
    if line is None:
        raise RtspError(f"RTSP: {first[:60]!r} is no request")
    if len(rest) > MAX_HEADERS:
        raise RtspError(f"RTSP: {len(rest)} headers, at most {MAX_HEADERS}")
    headers: dict[str, str] = {}
    for each in rest:
        header = _HEADER.fullmatch(each)
        if header is None:
            raise RtspError(f"RTSP: {each[:60]!r} is no header")
        headers[header[1].lower()] = header[2].strip()
    cseq = headers.get("cseq", "")
    if not re.fullmatch(r"[0-9]{1,9}", cseq):
        raise RtspError(f"RTSP: CSeq {cseq[:20]!r}, wanted a number of at most nine digits")
    return Request(line[1], line[2], int(cseq), headers)


def _body_size(request: Request) -> int:
    text = request.headers.get("content-length", "0")
    if not re.fullmatch(r"[0-9]{1,9}", text) or int(text) > MAX_BODY_BYTES:
        raise RtspError(f"RTSP: Content-Length {text[:20]!r}, wanted at most {MAX_BODY_BYTES}")
    return int(text)
