"""Channels between a live room and its sites, and how much each may hold."""

from __future__ import annotations

from collections.abc import Mapping

OBJECTS, PEOPLE, BODIES, PICTURE = "objects", "people", "bodies", "picture"
"""Newest values: all objects, everybody, their bodies, what a surface shows (`picture-3`)."""

DRAWN = "drawn"
"""Log of lines, surfaces and shapes; a site's own has no shapes, which the room decides."""

WISHES = "wishes"
"""Log of what a site's people ask of shapes, an item each until it is answered."""

ANSWERS = "answers"
"""Log of what a room has decided of them, an item a site."""

HIDDEN = "hidden"
"""Log of a room's surfaces that hide what is behind them, by cell."""

MAX_NAME_BYTES = 255
"""Length of an id in bytes, as one byte says it."""

MAX_OBJECTS = 2_000
"""Objects of a room, chosen: far above any room's."""

MAX_PEOPLE = 1_024
"""People of a room together, as many as a hub shows of other hubs."""

MAX_PICTURES = 32
"""Pictures of live surfaces at a time, as many as people may make."""

MAX_SITE_PEOPLE = 256
"""People of one site, as many as a hub has connections."""

ROOM_LIMITS: Mapping[str, int] = {
    OBJECTS: 700_000,
    PEOPLE: 200_000,
    BODIES: 900_000,
    PICTURE: 600_000,
}
"""Longest values of a room, bytes: so many objects, people and bodies, a picture of 512 kB."""

SITE_LIMITS: Mapping[str, int] = {PEOPLE: 50_000, BODIES: 220_000}
"""Longest values of a site, bytes."""


class SiteBytesError(ValueError):
    """Bytes of another machine that say nothing; says which part, and what was wanted."""
