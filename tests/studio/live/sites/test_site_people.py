"""Messages of sites: under their own name only, within limits, gone when they are."""

import numpy as np
import pytest

from devices.hub.protocol.wire import Body, encode_body
from devices.hub.roles import Person, Role
from devices.sites.channels import BODIES, DRAWN, PEOPLE
from devices.sites.drawn import item_name, pack_item
from devices.sites.people import pack_bodies, pack_people
from devices.transport.followed import LogNews, News
from devices.transport.keys import site
from devices.transport.wire import Entry
from scenes.pose import Pose
from scenes.state import Annotation
from studio.live.sites.site_people import MAX_POINTS, SitePeople

BODY = encode_body(Body(1, 2, Pose.from_yaw(0.3, (1, 2, 3))))
ANN = Person("p1", 1, "Ann", Role.LOCAL)


def line(key="p1/a", points=2):
    return Annotation(key, "p1", np.ones((points, 3)), (1.0, 0.0, 0.0))


def news(*, people=None, bodies=None, lines=(), is_whole=False, is_new=False, is_away=False):
    values = {}
    if people is not None:
        values[PEOPLE] = people if isinstance(people, bytes) else pack_people(people)
    if bodies is not None:
        values[BODIES] = bodies if isinstance(bodies, bytes) else pack_bodies(bodies)
    entries = tuple(Entry(n + 1, item_name(each), pack_item(each)) for n, each in enumerate(lines))
    logs = {DRAWN: LogNews(is_whole, entries)} if lines or is_whole else {}
    return News(site("lab", "north"), is_new, is_away, {}, (1, 1), values, logs)


@pytest.fixture
def people():
    return SitePeople()


def test_everything_begins_with_the_site_s_name(people):
    people.take(news(people=[ANN], bodies=[("p1", BODY)], lines=[line("south.p1/a")], is_new=True))
    (each,) = people.everybody()
    assert (each.person.person_id, each.person.name, each.body) == ("north.p1", "Ann", BODY)
    (avatar,) = people.avatars()
    assert (avatar.user_id, avatar.role) == ("north.p1", "local")
    lines, _surfaces, events = people.changes()
    assert [each.annotation_id for each in lines] == ["north.south.p1/a"]
    assert events == [("joined", "site north has joined")]
    assert people.changes() == ([], [], [])


def test_a_site_that_is_not_reached_shows_nobody(people):
    people.take(news(people=[ANN], is_new=True))
    assert people.names() == ("north",)
    people.take(news(is_away=True))
    assert people.everybody() == []
    assert ("away", "site north is not reached") in people.changes()[2]
    people.take(news())
    assert [each.person.person_id for each in people.everybody()] == ["north.p1"], "they are back"


def test_a_whole_log_erases_what_is_not_in_it(people):
    people.take(news(lines=[line("p1/a"), line("p1/b")], is_whole=True))
    people.changes()
    people.take(news(lines=[line("p1/b")], is_whole=True))
    lines, _, _ = people.changes()
    assert {each.annotation_id: len(each.points_in_world) for each in lines} == {
        "north.p1/a": 0,
        "north.p1/b": 2,
    }


def test_what_cannot_be_read_is_counted(people):
    people.take(news(people=b"junk", bodies=b"junk", lines=[line(points=MAX_POINTS + 1)]))
    assert people.refused == 3
    assert people.changes()[0] == []
