"""Bytes between a room and its sites: round trips; damaged ones are refused, never a crash."""

from random import Random

import numpy as np
import pytest

from devices.hub.entities.drawn import drawn_entity
from devices.hub.protocol.messages import Do, Wish
from devices.hub.protocol.wire import Body, encode_body
from devices.hub.roles import Op, Person, Role
from devices.sites.about import RoomAbout, read_about
from devices.sites.channels import SiteBytesError
from devices.sites.drawn import ended, item_name, pack_item, read_item
from devices.sites.objects import pack_objects, read_object, read_objects
from devices.sites.people import pack_bodies, pack_people, read_bodies, read_people
from devices.sites.pictures import pack_picture, read_picture
from devices.sites.wishes import Answers, pack_answers, pack_wish, read_answers, read_wish
from scenes.pose import Pose
from scenes.state import (
    Annotation,
    LiveSurface,
    SharedPrimitive,
    TrackedObject,
    TrackState,
    is_there,
)

CORNERS = np.array([[0, 0, 1], [1, 0, 1], [1, 0, 0], [0, 0, 0]], dtype=float)
LINE = Annotation("north.p1/a", "north.p1", np.array([[0.12345, 2, 3], [1, 2, 3]]), (1.0, 0.5, 0))
SURFACE = LiveSurface("p2/s", CORNERS, (640, 480), "camera-360")
BODY = encode_body(Body(1, 2, Pose.from_yaw(0.3, (1, 2, 3))))


SHAPE = SharedPrimitive(
    "p1/b", "north.p1", "box", (0.25, 0.5, 1.0), (1.0, 0.5, 0.0), Pose.from_yaw(0.3, (1, 2, 0))
)
WISH = Wish("p1", Do(7, Op.PRIMITIVE, drawn_entity(SHAPE)))
ANSWERS = Answers(6, 12, {13: "Ben has it"})


def tracked(name, x, state=TrackState.TRACKED, t_ns=7):
    return TrackedObject(name, t_ns, Pose.from_yaw(0.5, (x, 0, 0)), np.eye(4), 0.75, state, 0.5, 9)


def test_objects_come_as_they_were_but_for_the_covariance():
    data = pack_objects([tracked("chair", 1.25), tracked("ü", 2, TrackState.LOST)], 123)
    t_ns, found = read_objects(data)
    chair = read_object("chair", found["chair"])
    assert t_ns == 123
    assert (chair.t_ns, chair.source_seq, chair.confidence, chair.visible_fraction) == (
        7,
        9,
        0.5,
        0.75,
    )
    np.testing.assert_allclose(
        chair.world_from_object.matrix(), tracked("chair", 1.25).world_from_object.matrix()
    )
    assert read_object("ü", found["ü"]).state is TrackState.LOST
    assert np.isnan(chair.covariance).all()


def test_lines_and_surfaces_come_as_they_were():
    line = read_item(item_name(LINE), pack_item(LINE))
    assert (line.annotation_id, line.user_id) == ("north.p1/a", "north.p1")
    assert line.colour == (1, 0.5, 0)
    np.testing.assert_allclose(line.points_in_world, LINE.points_in_world, atol=1e-4)
    surface = read_item(item_name(SURFACE), pack_item(SURFACE))
    assert (surface.size_px, surface.stream_id) == ((640, 480), "camera-360")
    gone = Annotation("a", "p1", np.zeros((0, 3)), (1, 1, 1))
    assert pack_item(gone) == b""
    assert len(read_item(item_name(gone), b"").points_in_world) == 0
    assert len(read_item("surface:s", b"").corners_in_world) == 0


def test_shapes_wishes_and_answers_come_as_they_were():
    shape = read_item(item_name(SHAPE), pack_item(SHAPE))
    assert drawn_entity(shape).entry() == drawn_entity(SHAPE).entry()
    assert pack_item(ended(SHAPE)) == b""
    assert not is_there(read_item(item_name(SHAPE), b""))
    wish = read_wish(pack_wish(WISH, room_epoch=5), room_epoch=5)
    assert (wish.person_id, wish.do.op_id, wish.do.op) == ("p1", 7, Op.PRIMITIVE)
    assert wish.do.drawn.fields() == WISH.do.drawn.fields()
    gone = Wish("p1", Do(8, Op.PRIMITIVE, drawn_entity(ended(SHAPE))))
    assert not read_wish(pack_wish(gone, room_epoch=5), room_epoch=5).do.drawn.is_there
    gift = Wish("p1", Do(9, Op.GIVE, drawn_entity(SHAPE), to="lab.p2"))
    given = read_wish(pack_wish(gift, room_epoch=5), room_epoch=5).do
    assert (given.op, given.drawn.key, given.to) == (Op.GIVE, "p1/b", "lab.p2")
    assert read_answers(pack_answers(ANSWERS)) == ANSWERS
    for damaged in (b"{}", b'{"site":"x","done":1,"refused":{}}', b'{"refused":[]}'):
        with pytest.raises(SiteBytesError, match="answers"):
            read_answers(damaged)


def test_people_and_bodies_come_as_they_were():
    people = [Person("p1", 1, "Ann", Role.REMOTE), Person("p2", 2, "Ben", Role.SPECTATOR, True)]
    found = read_people(pack_people(people), limit=2)
    (wearer,) = read_people(
        pack_people([Person("hololens", 0, "Ana", Role.LOCAL, is_yielding=True)]), limit=1
    )
    assert wearer.is_yielding
    assert [(p.person_id, p.name, p.role, p.is_muted) for p in found] == [
        ("p1", "Ann", Role.REMOTE, False),
        ("p2", "Ben", Role.SPECTATOR, True),
    ]
    bodies = read_bodies(pack_bodies([("p1", BODY)]), {}, limit=2)
    assert bodies == {"p1": BODY}
    again = read_bodies(pack_bodies([("p1", BODY)]), bodies, limit=2)
    assert again["p1"] is bodies["p1"], "what is the same stays the same value"
    with pytest.raises(SiteBytesError, match="at most 1"):
        read_people(pack_people(people), limit=1)
    with pytest.raises(SiteBytesError, match="at most 1"):
        read_bodies(pack_bodies([("p1", BODY), ("p2", BODY)]), {}, limit=1)
    with pytest.raises(SiteBytesError):
        read_bodies(pack_bodies([("p1", b"no body")]), {}, limit=2)


def test_pictures_come_as_they_were():
    assert read_picture(pack_picture("p1/s", b"\xff\xd8\xffx")) == (
        "p1/s",
        b"\xff\xd8\xffx",
    )
    with pytest.raises(SiteBytesError, match="JPEG"):
        read_picture(pack_picture("p1/s", b"GIF89a"))
    with pytest.raises(ValueError, match="at most"):
        pack_picture("p1/s", bytes(600_000))


def test_a_name_of_another_machine_is_cleaned():
    (person,) = read_people(b'[["p1","a\\nb\\u0000","remote",0,0]]', limit=9)
    assert person.name == "a b"
    assert read_about({"scene": "lab\n\x1b[31m", "digest": 5, "people": "many"}) == RoomAbout(
        "lab  [31m", "", 0
    )
    about = RoomAbout("lab", "abc", 3)
    assert read_about(about.fields()) == about


@pytest.mark.parametrize(
    "data",
    [
        b"{}",
        b"[[1]]",
        b'[["p1","n","king",0,0]]',
        b'[["","n","remote",0,0]]',
        b'[["p\\n","n","remote",0,0]]',
        b'[[7,"n","remote",0,0]]',
        b"[" * 5000,
    ],
)
def test_people_that_are_none(data):
    with pytest.raises(SiteBytesError):
        read_people(data, limit=9)


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("circle:a", b"{}"),
        ("line:", b"{}"),
        ("line:a", b"[]"),
        ("line:a", b'{"by":"p1","points":[[0,0,0]],"colour":[1,1]}'),
        ("line:a", b'{"by":"p1","points":[[0,0]],"colour":[1,1,1]}'),
        ("line:a", b'{"by":"p1","points":[[0,0,1e9]],"colour":[1,1,1]}'),
        ("line:a", b'{"by":"p1","points":[[0,0,NaN]],"colour":[1,1,1]}'),
        ("line:a", b'{"by":"p1","points":[],"colour":[1,1,1]}'),
        ("line:a\n", b'{"by":"p1","points":[[0,0,0]],"colour":[1,1,1]}'),
        ("surface:s", b'{"corners":[[0,0,0]],"size_px":[1,1],"stream":""}'),
        ("surface:s", b'{"corners":7,"size_px":[1,1],"stream":""}'),
        ("shape:a", b"{}"),
        ("shape:a", pack_item(SHAPE).replace(b'"box"', b'"cone"')),
        ("shape:a", pack_item(SHAPE).replace(b"0.25", b"-1")),
        ("shape:a", pack_item(SHAPE).replace(b"0.25", b"1e9")),
        ("shape:a", pack_item(SHAPE).replace(b"[0.0,0.0,1.0,0.0]", b"[1.0,0.0,1.0,0.0]")),
    ],
)
def test_lines_and_surfaces_that_are_none(name, data):
    with pytest.raises(SiteBytesError):
        read_item(name, data)


def any_object(data):
    _t_ns, found = read_objects(data)
    for name, each in found.items():
        read_object(name, each)


@pytest.mark.parametrize(
    ("read", "good"),
    [
        (any_object, pack_objects([tracked("chair", 1), tracked("desk", 2)], 123)),
        (lambda data: read_bodies(data, {}, limit=9), pack_bodies([("p1", BODY), ("p2", BODY)])),
        (read_picture, pack_picture("p1/s", b"\xff\xd8\xffx")),
        (lambda data: read_item("line:a", data), pack_item(LINE)),
        (lambda data: read_item("surface:a", data), pack_item(SURFACE)),
        (lambda data: read_item("shape:a", data), pack_item(SHAPE)),
        (lambda data: read_wish(data, room_epoch=5), pack_wish(WISH, room_epoch=5)),
        (read_answers, pack_answers(ANSWERS)),
        (lambda data: read_people(data, limit=9), pack_people([Person("p1", 1, "A", Role.REMOTE)])),
    ],
    ids=["objects", "bodies", "picture", "line", "surface", "shape", "wish", "answers", "people"],
)
def test_damaged_bytes_are_refused_or_read(read, good):
    random = Random(0)
    for length in range(len(good)):
        if length:
            _try(read, good[:length])
    for _ in range(3_000):
        data = bytearray(good)
        for _ in range(random.randint(1, 4)):
            data[random.randrange(len(data))] = random.randrange(256)
        _try(read, bytes(data))


def _try(read, data):
    try:
        read(data)
    except SiteBytesError:
        return
