"""Parsers of rooms and sites on other machines, as targets of `fuzz.py`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from benchmarks.wire.fuzz_people import PeopleTarget
from devices.hub.entities.drawn import drawn_entity
from devices.hub.protocol.messages import Do, Wish
from devices.hub.roles import Op, Person, Role
from devices.sites.channels import SiteBytesError
from devices.sites.drawn import pack_item, read_item
from devices.sites.objects import pack_objects, read_object, read_objects
from devices.sites.people import pack_bodies, pack_people, read_bodies, read_people
from devices.sites.pictures import pack_picture, read_picture
from devices.sites.wishes import Answers, pack_answers, pack_wish, read_answers, read_wish
from devices.transport.wire import (
    Beat,
    Entries,
    Entry,
    MessageBytesError,
    pack_beat,
    pack_entries,
    pack_entry,
    pack_value,
    read_beat,
    read_entries,
    read_entry,
    read_value,
)
from scenes.pose import Pose
from scenes.state import Annotation, LiveSurface, SharedPrimitive, TrackedObject, TrackState
from sim.wire.people_messages import valid_bodies

LIMIT = 8
"""People that a list or bodies may hold here."""

ENTRIES = (Entry(3, "line:p1/a", b"one"), Entry(4, "surface:p1/s", b""))
"""Entries of a log."""


def site_targets() -> Mapping[str, PeopleTarget]:
    """Return all of them by name."""
    pose = Pose.from_yaw(0.3, (1, 2, 3))
    chair = TrackedObject("chair", 7, pose, np.eye(4), 1.0, TrackState.TRACKED, 0.9, 3)
    line = Annotation("p1/a", "p1", np.ones((3, 3)), (1.0, 0.5, 0.0))
    surface = LiveSurface("p1/s", np.ones((4, 3)), (640, 480), "camera")
    shape = SharedPrimitive("p1/b", "p1", "box", (0.3, 0.3, 0.3), (1.0, 0.5, 0.0), pose)
    put = Do(7, Op.PRIMITIVE, drawn_entity(shape))
    wishes = (Wish("p1", put), Wish("p1", replace(put, op=Op.GIVE, to="p2")))
    people = [Person("p1", 1, "Anna", Role.REMOTE), Person("p2", 2, "Ben", Role.SPECTATOR)]
    bodies = pack_bodies(zip(("p1", "p2"), valid_bodies(), strict=True))
    beat = Beat(5, 10**9, 4, {"objects": 3}, {"drawn": 4}, {"scene": "lab"})
    picture = pack_picture("p1/s", b"\xff\xd8\xff picture")
    message, refused = (MessageBytesError,), (SiteBytesError,)
    return {
        "values of a member": ((pack_value(5, 3, data=b"data"),), read_value, message),
        "entries of a log": ((pack_entry(5, ENTRIES[0]),), read_entry, message),
        "answers with entries": (
            (pack_entries(Entries(5, 4, True, ENTRIES)), pack_entries(Entries(5, 0, True, ()))),
            read_entries,
            message,
        ),
        "beats": ((pack_beat(beat),), read_beat, message),
        "objects of a room": ((pack_objects([chair], 9), pack_objects([], 9)), _read, refused),
        "lines of a site": ((pack_item(line),), lambda data: read_item("line:a", data), refused),
        "surfaces of a site": (
            (pack_item(surface),),
            lambda data: read_item("surface:a", data),
            refused,
        ),
        "shapes of a room": (
            (pack_item(shape),),
            lambda data: read_item("shape:a", data),
            refused,
        ),
        "wishes of a site": (
            tuple(pack_wish(each, room_epoch=5) for each in wishes),
            lambda data: read_wish(data, room_epoch=5),
            refused,
        ),
        "answers to wishes": (
            (pack_answers(Answers(6, 12, {13: "Ben has it"})),),
            read_answers,
            refused,
        ),
        "names of items": (
            (b"line:p1/a", b"surface:p1/s", b"shape:p1/b"),
            lambda data: read_item(data.decode("utf-8", "replace"), b""),
            refused,
        ),
        "people of a site": (
            (pack_people(people),),
            lambda data: read_people(data, limit=LIMIT),
            refused,
        ),
        "bodies of a site": ((bodies,), lambda data: read_bodies(data, {}, limit=LIMIT), refused),
        "pictures of surfaces": ((picture,), read_picture, refused),
    }


def _read(data: bytes) -> None:
    """As a mirror does: each object of them."""
    for object_id, each in read_objects(data)[1].items():
        read_object(object_id, each)
