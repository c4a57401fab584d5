"""The hub's HTTP: the page and its files, pairing, and the door to the WebSocket."""

from __future__ import annotations

import asyncio
import gzip
import hashlib
import ipaddress
import re
import traceback
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from aiohttp import web

from devices.clock import Clock
from devices.hub.channels import to_text
from devices.hub.contract import Asset
from devices.hub.entry.admission import Refused
from devices.hub.entry.pairing import PairingRefused
from devices.hub.protocol.fields import MessageError, read_object
from devices.hub.protocol.messages import clean_name
from devices.hub.session import Session

MAX_PAIR_BYTES = 4096
"""Length of a request to pair: a code and a name."""

MAX_POST_BYTES = 64 * 1024
"""Length of what somebody posts to a file of the page: the longest questionnaire, answered."""

READ_S = 10.0
"""Time for such a request to arrive."""

POLICY = "; ".join(
    (
        "default-src 'self'",
        "script-src 'self' 'wasm-unsafe-eval'",
        "worker-src 'self' blob:",
        "style-src 'self' 'unsafe-inline'",
        "img-src 'self' data: blob:",
        "media-src 'self' blob:",
        "connect-src 'self' data: blob:",
        "object-src 'none'",
        "base-uri 'none'",
        "form-action 'self'",
        "frame-ancestors 'none'",
    )
)
"""Content that the page may use: its own; `data:` and `blob:` for decoders in WebAssembly."""

HEADERS: Mapping[str, str] = {
    "Content-Security-Policy": POLICY,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Server": "GaussianNexus",
    "Permissions-Policy": "xr-spatial-tracking=(self), microphone=(self), camera=()",
}
"""Sent with every answer."""

HASHED = re.compile(r"[-.][0-9A-Za-z_-]{8,}\.[a-z0-9]+$")
"""File name that changes with the file's content, as bundlers make them."""

KEPT = "public, max-age=31536000, immutable"
"""Caching of a file whose name changes with its content."""

ASKED = "no-cache"
"""Caching of the others: kept, but asked about each time."""

PRIVATE = "private, no-cache"
"""Caching of files that are not for everybody."""


MIN_PACKED_BYTES = 1024
"""Length from which a file is compressed: below, the headers are longer."""

PACKED = re.compile(r"text/|application/(javascript|json|wasm)|image/svg|model/mesh")
"""Types that compression makes smaller."""

PACK_LEVEL = 6
"""Of gzip: each further one costs twice the time for 1 %."""


@dataclass(frozen=True, slots=True)
class _Kept:
    """A file as it is sent.

    Attributes:
        content: its bytes.
        tag: a text that changes with them.
        packed: the same by gzip; None where that is no shorter.
    """

    content: bytes
    tag: str
    packed: bytes | None


def defect_line(error: BaseException | None, *, otherwise: str = "unknown") -> str:
    """Return a log's line for an error of the hub: its kind and place, no stranger's words.

    Args:
        error: None where there is none.
        otherwise: said in its stead.
    """
    said = otherwise if error is None else type(error).__name__
    steps = traceback.extract_tb(None if error is None else error.__traceback__)
    own = [step for step in steps if Path(step.filename).is_relative_to(Path(__file__).parent)]
    for word, last in (("at", steps[-1:]), ("from", own[-1:] if own[-1:] != steps[-1:] else [])):
        said += "".join(f" {word} {Path(step.filename).name}:{step.lineno}" for step in last)
    return f"people: defect in the hub: {said}"


class Site:
    """Answers requests.

    Args:
        session: who may have private files.
        assets: files by path.
        clock: session time.
        is_own_host: whether a host name, without its port, means this machine.
        talk: takes over a WebSocket.
        root_pem: certificate that headsets install; None without TLS.
        say: takes a line for the log.
    """

    def __init__(
        self,
        session: Session,
        assets: Mapping[str, Asset],
        *,
        clock: Clock,
        is_own_host: Callable[[str], bool],
        talk: Callable[[web.BaseRequest, str], Awaitable[web.StreamResponse]],
        root_pem: bytes | None,
        say: Callable[[str], None],
    ) -> None:
        self._session, self._assets, self._clock = session, assets, clock
        self._is_own_host, self._talk = is_own_host, talk
        self._root_pem, self._say = root_pem, say
        self._kept: dict[str, _Kept] = {}

    async def answer(self, request: web.BaseRequest) -> web.StreamResponse:
        """Return the response to one request."""
        try:
            return await self._answer(request)
        except ConnectionError:
            raise
        except Exception as error:  # noqa: BLE001 - a defect, said without a stranger's words
            self._say(defect_line(error))
            return _error(500, "the hub has a defect, see its log")

    async def _answer(self, request: web.BaseRequest) -> web.StreamResponse:
        # aiohttp quotes an upgrade's headers in its refusal, which fails where they are no text.
        if not all(_is_unicode(value) for value in request.headers.values()):
            self._refuse(request, "a header that is no UTF-8", kind="header")
            return _error(400, "a header is no UTF-8")
        if not self._is_own_host(_name_of(request.headers.get("Host", ""))):
            self._refuse(request, "a foreign host name", kind="host")
            return _error(421, "this machine has no such name")
        path = request.rel_url.path
        is_change = path in ("/people", "/pair") or request.method == "POST"
        if is_change and not _is_same_origin(request):
            self._refuse(request, "a page of a foreign origin", kind="origin")
            return _error(403, "only pages of this hub may do that")
        if path == "/people":
            return await self._talk(request, address_of(request))
        if path == "/pair":
            return await self._pair(request)
        asset = self._assets.get(path)
        if request.method == "POST" and asset is not None and asset.takes is not None:
            return await self._post(request, asset.takes)
        if request.method not in ("GET", "HEAD"):
            return _error(405, "only GET")
        if path == "/root.crt" and self._root_pem is not None:
            headers = _headers("application/x-x509-ca-cert", ASKED)
            return web.Response(body=self._root_pem, headers=headers)
        return await self._asset(request, path)

    async def _pair(self, request: web.BaseRequest) -> web.StreamResponse:
        if request.method != "POST":
            return _error(405, "only POST")
        try:
            async with asyncio.timeout(READ_S):
                data = await _read_at_most(request, MAX_PAIR_BYTES)
            code, name = _read_pairing(data)
        except (MessageError, TimeoutError) as error:
            self._refuse(request, f"pair: {error}", kind="message")
            return _error(400, f"pair: {error}")
        try:
            with self._session.lock:
                token = self._session.pair(
                    code, name=name, address=address_of(request), now_ns=self._clock.now_ns()
                )
        except PairingRefused as error:
            return _error(error.status, str(error))
        except Refused as error:
            return _error(503, str(error))
        return _json({"token": token})

    async def _post(
        self, request: web.BaseRequest, takes: Callable[[str, bytes], str]
    ) -> web.StreamResponse:
        person = self._person(request)
        if not person:
            self._refuse(request, "an answer without a token", kind="token")
            return _error(401, "pair first")
        try:
            async with asyncio.timeout(READ_S):
                data = await _read_at_most(request, MAX_POST_BYTES)
        except (MessageError, TimeoutError) as error:
            return _error(400, f"post: {error}")
        why = await asyncio.to_thread(takes, person, data)
        return _error(422, why) if why else _json({})

    async def _asset(self, request: web.BaseRequest, path: str) -> web.StreamResponse:
        asset = self._assets.get(path)
        if asset is None:
            return _error(404, "no such file")
        if asset.is_private and not self._person(request):
            self._refuse(request, "a private file without a token", kind="token")
            return _error(401, "pair first")
        caching = KEPT if HASHED.search(path) else ASKED
        caching = PRIVATE if asset.is_private else caching
        content = asset.content
        if isinstance(content, Path):
            if not content.is_file():
                return _error(404, "no such file")
            return web.FileResponse(content, headers=_headers(asset.content_type, caching))
        kept = self._kept.get(path)
        if kept is None or kept.content is not content:
            kept = await asyncio.to_thread(_keep, content, asset.content_type)
            self._kept[path] = kept  # of paths that are assets: as many as there are
        return _send(kept, request, headers=_headers(asset.content_type, caching))

    def _person(self, request: web.BaseRequest) -> str:
        """Return who sends their token with a request; empty where nobody does."""
        scheme, _, token = request.headers.get("Authorization", "").partition(" ")
        if scheme.lower() != "bearer":
            return ""
        with self._session.lock:
            return self._session.known_by(token.strip(), self._clock.now_ns())

    def _refuse(self, request: web.BaseRequest, text: str, *, kind: str) -> None:
        with self._session.lock:
            self._session.refuse(
                f"{address_of(request)}: {text}", kind=kind, now_ns=self._clock.now_ns()
            )


def address_of(request: web.BaseRequest) -> str:
    """Return the address of a client, without its port."""
    return request.remote or "somewhere"


def _is_unicode(text: str) -> bool:
    """Whether a header's text was UTF-8; aiohttp keeps other bytes as surrogates."""
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True


def _name_of(host: str) -> str:
    """Return a host name or address without its port, in small letters."""
    if host.startswith("["):
        return host[1:].partition("]")[0].lower()
    return host.partition(":")[0].lower()


def is_loopback(host: str) -> bool:
    """Return whether a name or address is this machine's for itself alone."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _is_same_origin(request: web.BaseRequest) -> bool:
    """Whether a page of this hub asks, or no page: programs send no origin."""
    origin = request.headers.get("Origin")
    if origin is None:
        return True
    return origin.lower() == f"{request.scheme}://{request.headers.get('Host', '')}".lower()


def _read_pairing(data: bytes) -> tuple[str, str]:
    """Return code and name of a request to pair."""
    fields = read_object(data)
    code, name = fields.get("code"), clean_name(fields.get("name", "somebody"))
    if not isinstance(code, str):
        raise MessageError("code: wanted a text")
    return code, name


async def _read_at_most(request: web.BaseRequest, limit: int) -> bytes:
    if (request.content_length or 0) > limit:
        raise MessageError(f"{request.content_length} bytes, at most {limit}")
    data = bytearray()
    async for piece in request.content.iter_any():
        data += piece
        if len(data) > limit:
            raise MessageError(f"more than {limit} bytes")
    return bytes(data)


def _headers(content_type: str, caching: str) -> dict[str, str]:
    return {**HEADERS, "Cache-Control": caching, "Content-Type": content_type}


def _keep(content: bytes, content_type: str) -> _Kept:
    tag = f'"{hashlib.sha256(content).hexdigest()[:32]}"'
    packed = None
    if len(content) >= MIN_PACKED_BYTES and PACKED.match(content_type):
        packed = gzip.compress(content, PACK_LEVEL, mtime=0)
    return _Kept(content, tag, packed if packed and len(packed) < len(content) else None)


def _send(kept: _Kept, request: web.BaseRequest, *, headers: dict[str, str]) -> web.Response:
    headers |= {"ETag": kept.tag, "Vary": "Accept-Encoding"}
    if kept.tag in request.headers.get("If-None-Match", ""):
        return web.Response(status=304, headers=headers)
    if kept.packed is not None and "gzip" in request.headers.get("Accept-Encoding", ""):
        return web.Response(body=kept.packed, headers=headers | {"Content-Encoding": "gzip"})
    return web.Response(body=kept.content, headers=headers)


def _json(fields: Mapping[str, object], status: int = 200) -> web.Response:
    headers = {**HEADERS, "Cache-Control": "no-store"}
    return web.Response(
        status=status, text=to_text(fields), content_type="application/json", headers=headers
    )


def _error(status: int, why: str) -> web.Response:
    return _json({"why": why}, status)
