"""Only what changed is sent to the display."""

from __future__ import annotations

import pytest

from devices.hololens.display_list import Label, Shape, Solid
from devices.hololens.display_orders import Shown, transform_of, update_between
from devices.hololens.wire.message_queue import Command
from scenes.pose import Pose

CUBE = Solid(Shape.CUBE, Pose.from_yaw(0.2, (1, 2, 3)), (0.1, 0.1, 0.1), (1, 0, 0, 1))
LABEL = Label("here", Pose.identity())


def shown(items):
    return {
        name: Shown(number, item, transform_of(item))
        for number, (name, item) in enumerate(items.items(), 101)
    }


def commands(update):
    return [order.command for order in update.orders]


def test_new_items_are_made_within_one_list():
    update = update_between({}, {"a": CUBE, "b": LABEL})
    assert commands(update)[0] is Command.BEGIN_DISPLAY_LIST
    assert commands(update)[-1] is Command.END_DISPLAY_LIST
    assert update.orders[update.made["a"]].values == (Shape.CUBE,)
    assert update.orders[update.made["b"]].command is Command.CREATE_TEXT


def test_what_stays_is_not_sent():
    update = update_between(shown({"a": CUBE, "b": LABEL}), {"a": CUBE, "b": LABEL})
    assert update.orders == ()


def test_what_moved_is_moved_and_what_is_gone_goes():
    moved = Solid(CUBE.shape, Pose.from_yaw(0.2, (1, 2, 3.01)), CUBE.size_m, CUBE.colour)
    update = update_between(shown({"a": CUBE, "b": LABEL}), {"a": moved})
    assert commands(update) == [
        Command.BEGIN_DISPLAY_LIST,
        Command.REMOVE,
        Command.SET_WORLD_TRANSFORM,
        Command.END_DISPLAY_LIST,
    ]
    assert update.orders[1].values == (102,)
    assert update.orders[2].values[0] == 101
    assert update.gone == ("b",)
    assert set(update.changed) == {"a"}


def test_a_hundredth_of_a_millimetre_is_no_move():
    same = Solid(CUBE.shape, Pose.from_yaw(0.2, (1, 2, 3.000001)), CUBE.size_m, CUBE.colour)
    assert update_between(shown({"a": CUBE}), {"a": same}).orders == ()


def test_colours_and_texts_change_alone():
    green = Solid(CUBE.shape, CUBE.world_from_item, CUBE.size_m, (0, 1, 0, 1))
    words = Label("there", LABEL.world_from_item)
    update = update_between(shown({"a": CUBE, "b": LABEL}), {"a": green, "b": words})
    assert commands(update)[1:-1] == [Command.SET_COLOR, Command.SET_TEXT]
    assert update.orders[2].rest == b"there"


def test_another_shape_is_made_anew():
    ball = Solid(Shape.SPHERE, CUBE.world_from_item, CUBE.size_m, CUBE.colour)
    update = update_between(shown({"a": CUBE}), {"a": ball})
    assert commands(update)[1:3] == [Command.REMOVE, Command.CREATE_PRIMITIVE]


@pytest.mark.parametrize(
    ("shape", "scale"),
    [
        (Shape.CUBE, (0.2, 0.6, 0.4)),
        (Shape.CYLINDER, (0.2, 0.3, 0.4)),
        (Shape.PLANE, (0.02, 0.6, 0.04)),
    ],
)
def test_sizes_are_metres_whatever_the_shape_s_own_size(shape, scale):
    item = Solid(shape, Pose.identity(), (0.2, 0.4, 0.6))
    assert transform_of(item)[7:] == pytest.approx(scale)
