"""Pictures of live surfaces, from the room to its sites."""

from __future__ import annotations

import struct

from devices.hub.protocol.wire import MAX_PICTURE_BYTES
from devices.sites.channels import MAX_NAME_BYTES, SiteBytesError

JPEG = b"\xff\xd8\xff"
"""First bytes of every JPEG."""

_NAME = struct.Struct("<H")
"""Length of the surface's id."""


def pack_picture(surface_id: str, jpeg: bytes) -> bytes:
    """Return what a surface shows as it is sent.

    Raises:
        ValueError: the id or the picture is too long.
    """
    name = surface_id.encode()
    if len(name) > MAX_NAME_BYTES or len(jpeg) > MAX_PICTURE_BYTES:
        raise ValueError(
            f"picture of {surface_id[:40]!r}: {len(jpeg)} bytes, at most {MAX_PICTURE_BYTES}"
        )
    return _NAME.pack(len(name)) + name + jpeg


def read_picture(data: bytes) -> tuple[str, bytes]:
    """Return a surface's id and its picture.

    Raises:
        SiteBytesError: it is none.
    """
    length = _NAME.unpack_from(data)[0] if len(data) >= _NAME.size else 0
    at = _NAME.size + length
    if not 0 < length <= MAX_NAME_BYTES or at > len(data):
        raise SiteBytesError(f"picture: {len(data)} bytes, wanted at least {at}")
    try:
        name = data[_NAME.size : at].decode()
    except UnicodeDecodeError as error:
        raise SiteBytesError(f"picture: id: {error.reason}") from None
    jpeg = data[at:]
    if len(jpeg) > MAX_PICTURE_BYTES or not jpeg.startswith(JPEG):
        raise SiteBytesError(
            f"picture of {name[:40]!r}: no JPEG of at most {MAX_PICTURE_BYTES} bytes"
        )
    return name, jpeg
