"""From what the headset shows to what it shall show: the commands of one update."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from devices.hololens.axes import unity_transform
from devices.hololens.display_list import MAX_ITEMS, MAX_TEXT, Item, Label, Shape, Solid
from devices.hololens.wire.message_queue import USE_ID, USE_LAST, Command, Order

UNIT_SIZES = {
    Shape.SPHERE: (1.0, 1.0, 1.0),
    Shape.CAPSULE: (1.0, 1.0, 2.0),
    Shape.CYLINDER: (1.0, 1.0, 2.0),
    Shape.CUBE: (1.0, 1.0, 1.0),
    Shape.PLANE: (10.0, 10.0, 1.0),
    Shape.QUAD: (1.0, 1.0, 1.0),
}
"""Size of each shape at scale 1 along x, y, z of the studio, metres: Unity's own meshes."""

FONT_SIZE_OF_M = 10.0
"""Size of a font over the height of its lines in metres, at scale 1."""

SAME = 1e-5
"""Numbers of a transform that differ by less are the same: 0.01 mm, 0.001°."""


@dataclass(frozen=True, slots=True)
class Shown:
    """An item as the headset has it.

    Attributes:
        key: the headset's own.
        item: as it was sent.
        transform: its ten numbers.
    """

    key: int
    item: Item
    transform: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Update:
    """One update of the display.

    Attributes:
        orders: commands in order; none where nothing changed.
        made: place among `orders` of the command that makes each new item.
        changed: new values of items that are there already.
        gone: names of items that are removed.
    """

    orders: tuple[Order, ...]
    made: Mapping[str, int]
    changed: Mapping[str, Shown]
    gone: tuple[str, ...]


def update_between(shown: Mapping[str, Shown], wanted: Mapping[str, Item]) -> Update:
    """Return the commands that change what is shown to what is wanted, in one picture."""
    orders: list[Order] = [Order(Command.BEGIN_DISPLAY_LIST)]
    gone = tuple(
        name
        for name, each in shown.items()
        if name not in wanted or not _is_same_thing(each.item, wanted[name])
    )
    orders += [Order(Command.REMOVE, (shown[name].key,)) for name in gone]
    made: dict[str, int] = {}
    changed: dict[str, Shown] = {}
    for name, item in list(wanted.items())[:MAX_ITEMS]:
        transform = transform_of(item)
        if name in shown and name not in gone:
            was = shown[name]
            more = _changes(was, item, transform=transform)
            if more:
                orders += more
                changed[name] = Shown(was.key, item, transform)
        else:
            made[name] = len(orders)
            orders += _making(item, transform)
    if len(orders) == 1:
        return Update((), {}, {}, ())
    return Update((*orders, Order(Command.END_DISPLAY_LIST)), made, changed, gone)


def transform_of(item: Item) -> tuple[float, ...]:
    """Return the ten numbers of an item."""
    if isinstance(item, Label):
        return unity_transform(item.world_from_item, (1.0, 1.0, 1.0))
    sizes = np.asarray(item.size_m) / UNIT_SIZES[item.shape]
    return unity_transform(item.world_from_item, sizes)


def _is_same_thing(a: Item, b: Item) -> bool:
    """Whether one can become the other without being made anew."""
    if isinstance(a, Solid) and isinstance(b, Solid):
        return a.shape == b.shape
    return isinstance(a, Label) and isinstance(b, Label)


def _making(item: Item, transform: tuple[float, ...]) -> list[Order]:
    if isinstance(item, Label):
        make = Order(Command.CREATE_TEXT)
    else:
        make = Order(Command.CREATE_PRIMITIVE, (int(item.shape),))
    return [
        make,
        Order(Command.SET_TARGET_MODE, (USE_LAST,)),
        Order(Command.SET_WORLD_TRANSFORM, (0, *transform)),
        _appearance(0, item),
        Order(Command.SET_ACTIVE, (0, 1)),
        Order(Command.SET_TARGET_MODE, (USE_ID,)),
    ]


def _changes(was: Shown, item: Item, *, transform: tuple[float, ...]) -> list[Order]:
    orders: list[Order] = []
    if max(abs(a - b) for a, b in zip(was.transform, transform, strict=True)) > SAME:
        orders.append(Order(Command.SET_WORLD_TRANSFORM, (was.key, *transform)))
    if _appearance(0, was.item) != _appearance(0, item):
        orders.append(_appearance(was.key, item))
    return orders


def _appearance(key: int, item: Item) -> Order:
    if isinstance(item, Label):
        size = item.height_m * FONT_SIZE_OF_M
        text = item.text[:MAX_TEXT].encode()
        return Order(Command.SET_TEXT, (key, size, *item.colour), text)
    return Order(Command.SET_COLOR, (key, *item.colour))
