"""The display: lists shown at once, targets, and what is refused."""

from __future__ import annotations

import math

import pytest

from devices.hololens.wire.message_queue import Command, Order, UnknownOrder
from sim.hololens.holograms import Holograms

NUMBERS = (1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0)


def test_a_list_is_seen_when_it_has_ended():
    holograms = Holograms()
    assert holograms.obey(Order(Command.BEGIN_DISPLAY_LIST)) == 1
    assert holograms.obey(Order(Command.CREATE_PRIMITIVE, (0,))) == 101
    assert holograms.shown() == ()
    assert holograms.obey(Order(Command.END_DISPLAY_LIST)) == 1
    assert len(holograms.shown()) == 1


def test_the_last_one_made_can_be_meant():
    holograms = Holograms()
    first = holograms.obey(Order(Command.CREATE_PRIMITIVE, (3,)))
    second = holograms.obey(Order(Command.CREATE_TEXT))
    assert holograms.obey(Order(Command.SET_TARGET_MODE, (1,))) == 1
    assert holograms.obey(Order(Command.SET_WORLD_TRANSFORM, (0, *NUMBERS))) == 1
    moved = {h.key: h.world_from_item.translation.tolist() for h in holograms.shown()}
    assert moved == {first: [0, 0, 0], second: [1, 3, 2]}
    assert holograms.obey(Order(Command.REMOVE, (0,))) == 1
    assert [h.key for h in holograms.shown()] == [first]


@pytest.mark.parametrize(
    "order",
    [
        Order(Command.CREATE_PRIMITIVE, (9,)),
        Order(Command.SET_ACTIVE, (77, 1)),
        Order(Command.SET_TARGET_MODE, (5,)),
        Order(Command.REMOVE, (77,)),
        Order(Command.LOAD_MESH, (), b"mesh"),
        UnknownOrder(99, 4),
    ],
)
def test_what_cannot_be_done_is_refused(order):
    assert Holograms().obey(order) == 0


def test_a_transform_of_no_numbers_is_refused():
    holograms = Holograms()
    key = holograms.obey(Order(Command.CREATE_PRIMITIVE, (3,)))
    assert holograms.obey(Order(Command.SET_WORLD_TRANSFORM, (key, *(math.nan,) * 10))) == 0
    assert holograms.obey(Order(Command.SET_WORLD_TRANSFORM, (key, *(0.0,) * 10))) == 0


def test_hidden_items_are_not_seen():
    holograms = Holograms()
    key = holograms.obey(Order(Command.CREATE_PRIMITIVE, (3,)))
    assert holograms.obey(Order(Command.SET_ACTIVE, (key, 0))) == 1
    assert holograms.shown() == ()


def test_another_client_finds_no_open_list():
    holograms = Holograms()
    holograms.obey(Order(Command.BEGIN_DISPLAY_LIST))
    holograms.obey(Order(Command.CREATE_PRIMITIVE, (3,)))
    holograms.begin()
    assert holograms.shown() == ()
    holograms.obey(Order(Command.CREATE_PRIMITIVE, (3,)))
    assert len(holograms.shown()) == 1
    holograms.obey(Order(Command.SAY, (), b"hello"))
    assert holograms.said == "hello"
