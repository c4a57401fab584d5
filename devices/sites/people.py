"""Everybody and their bodies, from one hub to the others."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterable, Mapping
from typing import Any, cast

from devices.hub.protocol.messages import clean_name
from devices.hub.protocol.wire import MAX_BODY_BYTES, WireError, check_body
from devices.hub.roles import Person, Role
from devices.sites.channels import SiteBytesError

MAX_ID = 120
"""Characters of a person's id: a room's, a site's and the hub's own."""

_BODY = struct.Struct("<BH")
"""Length of a person's id and of their body."""


def pack_people(people: Iterable[Person]) -> bytes:
    """Return a list of people."""
    rows = [[p.person_id, p.name, str(p.role), p.is_muted, p.is_yielding] for p in people]
    return json.dumps(rows, separators=(",", ":")).encode()


def read_people(data: bytes, *, limit: int) -> tuple[Person, ...]:
    """Return people of a list; their numbers are their places in it.

    Raises:
        SiteBytesError: it is none, or a longer one than may be.
    """
    try:
        found: dict[str, Person] = {}
        for person_id, name, role, is_muted, is_yielding in _rows(json.loads(data), limit):
            key = _id(person_id)
            found[key] = Person(
                key,
                len(found),
                clean_name(name),
                Role(role),
                is_muted=bool(is_muted),
                is_yielding=bool(is_yielding),
            )
        return tuple(found.values())
    except SiteBytesError:
        raise
    except (ValueError, TypeError, RecursionError) as error:
        raise SiteBytesError(f"people: {type(error).__name__}") from None


def pack_bodies(bodies: Iterable[tuple[str, bytes]]) -> bytes:
    """Return bodies of people by their ids."""
    return b"".join(
        _BODY.pack(len(key), len(body)) + key + body
        for key, body in ((person_id.encode(), body) for person_id, body in bodies)
    )


def read_bodies(data: bytes, known: Mapping[str, bytes], *, limit: int) -> dict[str, bytes]:
    """Return bodies by their people's ids, each checked as if the person were here.

    Args:
        data: as it came.
        known: those before: what is the same need not be checked again.
        limit: of people.

    Raises:
        SiteBytesError: they are cut short, or there are too many.
    """
    found: dict[str, bytes] = {}
    at = 0
    while at < len(data):
        if len(found) >= limit or len(data) - at < _BODY.size:
            raise SiteBytesError(f"bodies: after {len(found)} of at most {limit}")
        id_length, length = _BODY.unpack_from(data, at)
        at += _BODY.size
        if length > MAX_BODY_BYTES or id_length + length > len(data) - at:
            raise SiteBytesError(f"bodies: number {len(found)} of {length} bytes is cut short")
        try:
            person_id = data[at : at + id_length].decode()
        except UnicodeDecodeError:
            raise SiteBytesError("bodies: an id that is none") from None
        body = data[at + id_length : at + id_length + length]
        if body == known.get(person_id):
            body = known[person_id]
        else:
            _check(body)
        found[person_id] = body
        at += id_length + length
    return found


def _check(body: bytes) -> None:
    try:
        check_body(body)
    except WireError as error:
        raise SiteBytesError(str(error)) from None


def _rows(value: object, limit: int) -> list[Any]:
    if not isinstance(value, list) or len(cast(list[Any], value)) > limit:
        raise SiteBytesError(f"people: wanted a list of at most {limit}")
    return cast(list[Any], value)


def _id(value: object) -> str:
    if not isinstance(value, str) or not 0 < len(value) <= MAX_ID:
        raise SiteBytesError(f"people: an id that is none, wanted 1 to {MAX_ID} characters")
    if not (value.isascii() and value.isprintable()):
        raise SiteBytesError("people: an id that cannot be shown")
    return value
