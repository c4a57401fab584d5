"""Address of a camera, parsed from the text that a person types."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from enum import StrEnum
from pathlib import Path
from urllib.parse import SplitResult, parse_qsl, urlsplit

from devices.video_files import VIDEO_SUFFIXES

RTMP_PORT = 1935
"""TCP port of RTMP where an address gives none: the one registered for it."""

RTSP_PORT = 554
"""TCP port of RTSP where an address gives none (RFC 2326)."""

INSTA360_PORT, INSTA360_HTTP_PORT = 6666, 80
"""TCP ports on which Insta360 cameras answer in their own Wi-Fi: with pictures, over HTTP."""

DEVICE_MODES = {"size": "video_size", "fps": "framerate", "format": "input_format"}
"""Settings of a V4L2 device, as in `v4l2:/dev/video0?size=2880x1440`: our name, FFmpeg's."""

EXAMPLES = (
    "rtmp://:1935/live/room, rtsp://HOST/stream, udp://:5000, https://HOST/stream.m3u8, "
    "v4l2:/dev/video0, insta360://HOST or a video file"
)
"""Examples of addresses, for messages."""


class AddressKind(StrEnum):
    """How the pictures travel."""

    RTMP_LISTEN = "rtmp"
    RTSP = "rtsp"
    UDP = "udp"
    HLS = "hls"
    V4L2 = "v4l2"
    FILE = "file"
    INSTA360 = "insta360"


class AddressError(ValueError):
    """An address that names no camera: says what is wrong and what it could be."""


@dataclass(frozen=True, slots=True)
class CameraAddress:
    """One camera's address.

    Attributes:
        kind: how the pictures travel.
        text: the address as FFmpeg or a person reads it; a password is still in it.
        host: where to connect or listen; empty for every interface, devices and files.
        port: TCP or UDP port, 0 for any free one or where there is none.
        path: RTMP's `application/key`, a device or a file; empty where it does not matter.
        udp_transport: of RTSP, whether the pictures come over UDP instead of the same connection.
        modes: of a device, what it is set to: pairs of a name in `DEVICE_MODES` and a value.
        http_port: of an Insta360 camera's HTTP interface, else 0.
    """

    kind: AddressKind
    text: str
    host: str = ""
    port: int = 0
    path: str = ""
    udp_transport: bool = False
    modes: tuple[tuple[str, str], ...] = ()
    http_port: int = 0

    @property
    def shown(self) -> str:
        """The address without user and password, for messages and logs."""
        scheme, mark, rest = self.text.partition("://")
        scheme += "+udp" if self.udp_transport else ""
        authority, slash, path = rest.partition("/")
        if not mark:
            return self.text
        return f"{scheme}://{authority.rpartition('@')[2]}{slash}{path}"


def address_to_json(address: CameraAddress) -> str:
    """One line that `address_from_json` reads; a password is in it."""
    return json.dumps(asdict(address))


def address_from_json(text: str) -> CameraAddress:
    """Inverse of `address_to_json`.

    Raises:
        ValueError, KeyError, TypeError: it is none.
    """
    fields = json.loads(text)
    fields["kind"] = AddressKind(fields["kind"])
    fields["modes"] = tuple((str(name), str(value)) for name, value in fields["modes"])
    return CameraAddress(**fields)


def parse_address(text: str) -> CameraAddress:
    """The address in a text.

    `rtsp+udp://` asks for RTSP with the pictures over UDP.

    Raises:
        AddressError: it is none; the message says what it could be.
    """
    typed = text.strip()
    if not typed:
        raise AddressError(f"camera address: empty, wanted one of {EXAMPLES}")
    if any(ord(letter) < 0x20 for letter in typed):
        raise AddressError(f"camera address {typed!r}: control characters in it")
    if typed.lower().startswith("v4l2:"):
        return _device(typed)
    if "://" not in typed:
        return _file(typed)
    url = _split(typed)
    scheme = url.scheme.lower()
    if scheme == "file":
        return _file(url.path)
    if scheme == "rtmp":
        return _rtmp(url, typed)
    if scheme in ("rtsp", "rtsp+udp"):
        return _rtsp(url, typed)
    if scheme == "udp":
        return _udp(url, typed)
    if scheme in ("http", "https"):
        return _hls(url, typed)
    if scheme == "insta360":
        return _insta360(url, typed)
    raise AddressError(f"camera address {typed!r}: {scheme}:// is not known, wanted {EXAMPLES}")


def _split(typed: str) -> SplitResult:
    try:
        url = urlsplit(typed)
        _ = url.port
    except ValueError as error:
        raise AddressError(f"camera address {typed!r}: {error}") from None
    return url


def _wanted_host(url: SplitResult, typed: str) -> str:
    if not url.hostname:
        raise AddressError(f"camera address {typed!r}: no host in it, wanted {EXAMPLES}")
    return url.hostname


def _rtmp(url: SplitResult, typed: str) -> CameraAddress:
    port = RTMP_PORT if url.port is None else url.port
    return CameraAddress(
        AddressKind.RTMP_LISTEN, typed, url.hostname or "", port, url.path.strip("/")
    )


def _rtsp(url: SplitResult, typed: str) -> CameraAddress:
    host = _wanted_host(url, typed)
    over_udp = url.scheme.lower() == "rtsp+udp"
    plain = "rtsp://" + typed.partition("://")[2]
    return CameraAddress(
        AddressKind.RTSP, plain, host, url.port or RTSP_PORT, url.path, udp_transport=over_udp
    )


def _udp(url: SplitResult, typed: str) -> CameraAddress:
    if not url.port:
        raise AddressError(f"camera address {typed!r}: no port in it, wanted e.g. udp://:5000")
    return CameraAddress(AddressKind.UDP, typed, url.hostname or "", url.port)


def _insta360(url: SplitResult, typed: str) -> CameraAddress:
    host = _wanted_host(url, typed)
    http_port = INSTA360_HTTP_PORT
    for name, value in parse_qsl(url.query, keep_blank_values=True):
        if name != "http" or not value.isascii() or not value.isdigit() or int(value) > 65535:
            raise AddressError(
                f"camera address {typed!r}: {name}={value} is not known, wanted at most the port "
                "of its HTTP interface, e.g. insta360://192.168.42.1?http=80"
            )
        http_port = int(value)
    return CameraAddress(
        AddressKind.INSTA360, typed, host, url.port or INSTA360_PORT, http_port=http_port
    )


def _hls(url: SplitResult, typed: str) -> CameraAddress:
    host = _wanted_host(url, typed)
    if not url.path.lower().endswith(".m3u8"):
        raise AddressError(
            f"camera address {typed!r}: of http only HLS is received, wanted a path that ends "
            "in .m3u8"
        )
    return CameraAddress(AddressKind.HLS, typed, host, url.port or 0, url.path)


def _device(typed: str) -> CameraAddress:
    path, _, query = typed[len("v4l2:") :].removeprefix("//").partition("?")
    if not path.startswith("/dev/"):
        raise AddressError(
            f"camera address {typed!r}: {path!r} is no device, wanted e.g. v4l2:/dev/video0"
        )
    modes = tuple(parse_qsl(query, keep_blank_values=True))
    for name, value in modes:
        if name not in DEVICE_MODES or not value.isascii() or not value.isalnum():
            raise AddressError(
                f"camera address {typed!r}: {name}={value} is no mode of a device, wanted e.g. "
                "v4l2:/dev/video0?size=2880x1440&fps=30&format=mjpeg"
            )
    return CameraAddress(AddressKind.V4L2, typed, path=path, modes=modes)


def _file(path: str) -> CameraAddress:
    if Path(path).suffix.lower() not in VIDEO_SUFFIXES:
        raise AddressError(
            f"camera address {path!r}: no video ({', '.join(sorted(VIDEO_SUFFIXES))}) and no "
            f"network address; wanted {EXAMPLES}"
        )
    return CameraAddress(AddressKind.FILE, path, path=path)
