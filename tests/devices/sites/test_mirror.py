"""A room's state elsewhere: the same objects, lines and surfaces, and nothing that is gone."""

import numpy as np

from devices.sites.channels import DRAWN, OBJECTS
from devices.sites.drawn import item_name, pack_item
from devices.sites.mirror import Mirror, as_lost
from devices.sites.objects import pack_objects
from devices.transport.followed import LogNews, News
from devices.transport.keys import room
from devices.transport.wire import Entry
from scenes.state import Annotation, TrackState
from tests.devices.sites.test_bytes import LINE, SHAPE, SURFACE, tracked


def news(*, objects=None, t_ns=10, items=(), is_whole=False, is_new=False):
    values = {} if objects is None else {OBJECTS: pack_objects(objects, t_ns)}
    entries = tuple(Entry(n + 1, item_name(item), pack_item(item)) for n, item in enumerate(items))
    logs = {DRAWN: LogNews(is_whole, entries)} if items or is_whole else {}
    return News(room("lab"), is_new, False, {}, None, values, logs)


def test_what_changes_is_reduced_and_what_does_not_stays_the_same_value():
    mirror = Mirror()
    assert mirror.take(news(objects=[tracked("chair", 1), tracked("desk", 2)]))
    before = mirror.state
    assert mirror.take(news(objects=[tracked("chair", 1.5, t_ns=8), tracked("desk", 2)], t_ns=20))
    assert mirror.state.objects["desk"] is before.objects["desk"]
    assert mirror.state.objects["chair"].world_from_object.translation[0] == 1.5
    assert (mirror.state.t_ns, mirror.state.version) == (20, 3)
    assert not mirror.take(
        news(objects=[tracked("chair", 1.5, t_ns=8), tracked("desk", 2)], t_ns=30)
    )


def test_an_object_that_is_gone_is_gone():
    mirror = Mirror()
    mirror.take(
        news(objects=[tracked("chair", 1), tracked("desk", 2)], items=[LINE, SURFACE, SHAPE])
    )
    version = mirror.state.version
    mirror.take(news(objects=[tracked("desk", 2)]))
    assert set(mirror.state.objects) == {"desk"}
    assert set(mirror.state.annotations) == {"north.p1/a"}
    assert set(mirror.state.surfaces) == {"p2/s"}
    assert set(mirror.state.primitives) == {"p1/b"}
    assert mirror.state.version > version


def test_lines_come_and_go_and_a_whole_log_leaves_nothing_else():
    mirror = Mirror()
    mirror.take(news(items=[LINE, SURFACE, SHAPE]))
    gone = Annotation(LINE.annotation_id, "", np.zeros((0, 3)), (1, 1, 1))
    mirror.take(news(items=[gone]))
    assert not mirror.state.annotations
    mirror.take(news(items=[LINE], is_whole=True))
    assert set(mirror.state.annotations) == {"north.p1/a"}
    assert not mirror.state.surfaces
    assert not mirror.state.primitives
    mirror.take(news(is_whole=True))
    assert not mirror.state.annotations


def test_a_room_that_starts_again_has_nothing_of_before():
    mirror = Mirror()
    mirror.take(news(objects=[tracked("chair", 1, t_ns=10**12)], items=[LINE]))
    assert mirror.take(news(objects=[tracked("chair", 3, t_ns=5)], is_new=True))
    assert mirror.state.objects["chair"].world_from_object.translation[0] == 3
    assert not mirror.state.annotations


def test_what_cannot_be_read_is_counted_and_changes_nothing():
    mirror = Mirror()
    mirror.take(news(objects=[tracked("chair", 1)]))
    before = mirror.state
    entries = LogNews(False, (Entry(1, "line:a", b"junk"),))
    bad = News(room("lab"), False, False, {}, None, {OBJECTS: b"junk"}, {DRAWN: entries})
    assert not mirror.take(bad)
    assert mirror.state is before
    assert mirror.refused == 2


def test_nobody_is_sure_of_a_room_that_is_not_reached():
    mirror = Mirror()
    mirror.take(news(objects=[tracked("chair", 1)], items=[LINE]))
    lost = as_lost(mirror.state)
    assert lost.objects["chair"].state is TrackState.LOST
    assert lost.objects["chair"].confidence == 0.0
    assert lost.annotations is mirror.state.annotations
    assert mirror.state.objects["chair"].state is TrackState.TRACKED
