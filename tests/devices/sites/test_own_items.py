"""Lines and surfaces of a site's people, to the room and back: never an older echo in its place."""

from dataclasses import replace

import numpy as np

from devices.sites.own_items import SURE_NS, OwnItems
from scenes.state import Annotation, SceneState
from tests.devices.sites.test_bytes import SHAPE, SURFACE


def line(key="p1/a", points=2, by="p1"):
    return Annotation(key, by, np.ones((points, 3)), (1.0, 0.0, 0.0))


def in_room(item):
    """The same as the room has it."""
    return replace(item, annotation_id=f"north.{item.annotation_id}", user_id="north.p1")


def state(*lines, surfaces=()):
    return SceneState(
        annotations={each.annotation_id: each for each in lines},
        surfaces={each.surface_id: each for each in surfaces},
    )


def test_names_are_the_site_s_in_the_room_and_the_room_s_here():
    own = OwnItems("north", "lab")
    assert own.is_own("north.p1/a")
    assert not own.is_own("p1/a")
    assert own.name_here("north.p1") == "p1"
    shown = own.shown(state(line("p1/a"), line("south.p1/a", by="south.p1")), 10 * SURE_NS)
    assert {key: each.user_id for key, each in shown.annotations.items()} == {
        "lab.p1/a": "lab.p1",
        "lab.south.p1/a": "lab.south.p1",
    }


def test_an_echo_is_the_newest_value_that_was_sent():
    own, short, long = OwnItems("north", "lab"), line(points=2), line(points=5)
    own.note_sent(short, 0)
    own.note_sent(long, 1)
    assert own.shown(state(in_room(short)), 2).annotations["p1/a"] is long


def test_what_is_on_its_way_stays_and_what_the_room_refused_goes():
    own, mine = OwnItems("north", "lab"), line()
    own.note_sent(mine, 0)
    assert own.shown(state(), SURE_NS - 1).annotations == {"p1/a": mine}
    assert own.shown(state(), SURE_NS).annotations == {}


def test_what_was_erased_here_does_not_come_back_with_an_old_echo():
    own = OwnItems("north", "lab")
    own.note_sent(line(), 0)
    own.note_sent(line(points=0), 1)
    assert own.shown(state(in_room(line())), 2).annotations == {}


def test_values_of_others_stay_the_same():
    own, theirs = OwnItems("north", "lab"), line("p7/x", by="p7")
    surface = replace(SURFACE, surface_id="p7/s")
    first = own.shown(state(theirs, surfaces=[surface]), 0)
    again = own.shown(state(theirs, surfaces=[surface]), 1)
    assert again.annotations["lab.p7/x"] is first.annotations["lab.p7/x"]
    assert again.surfaces["lab.p7/s"] is first.surfaces["lab.p7/s"]
    changed = own.shown(state(line("p7/x", by="p7")), 2)
    assert changed.annotations["lab.p7/x"] is not first.annotations["lab.p7/x"]
    assert changed.surfaces == {}


def test_shapes_are_as_the_room_has_them_by_the_names_of_here():
    own = OwnItems("north", "lab")
    mine, given = SHAPE, replace(SHAPE, primitive_id="north.p1/c", user_id="p2")
    room = replace(state(), primitives={"p1/b": mine, "north.p1/c": given})
    first = own.shown(room, 0).primitives
    assert {key: it.user_id for key, it in first.items()} == {"lab.p1/b": "p1", "p1/c": "lab.p2"}
    assert own.shown(room, 1).primitives["lab.p1/b"] is first["lab.p1/b"]
    for key in ("lab.p1/b", "p1/c", "lab.south.p1"):
        assert own.name_here(own.name_there(key)) == key


def test_surfaces_go_the_same_way():
    own = OwnItems("north", "lab")
    own.note_sent(SURFACE, 0)
    sent = replace(SURFACE, surface_id="north.p2/s")
    assert own.shown(state(surfaces=[sent]), 1).surfaces["p2/s"] is SURFACE
