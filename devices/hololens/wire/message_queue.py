"""Message queue of the headset's display, port 3816: a command, then its result, in order."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

from devices.hololens.wire.taking import Take, WireError, checked_count, taken

COMMAND_HEADER = struct.Struct("<II")
"""Before a command's data: its number, and the size of its data in bytes."""

RESULT = struct.Struct("<I")
"""Answer to each command: 0 for no, 1 for yes, or the key of what was made."""

MAX_DATA_BYTES = 1 << 22
"""Largest data of a command, bytes, chosen: a texture of 2048 × 2048 pixels as PNG."""

USE_ID, USE_LAST = 0, 1
"""Targets: the key in each command, or what was made last."""


class Command(IntEnum):
    """Commands."""

    CREATE_PRIMITIVE = 0
    SET_ACTIVE = 1
    SET_WORLD_TRANSFORM = 2
    SET_LOCAL_TRANSFORM = 3
    SET_COLOR = 4
    SET_TEXTURE = 5
    CREATE_TEXT = 6
    SET_TEXT = 7
    SAY = 8
    LOAD_MESH = 15
    REMOVE = 16
    REMOVE_ALL = 17
    BEGIN_DISPLAY_LIST = 18
    END_DISPLAY_LIST = 19
    SET_TARGET_MODE = 20
    DISCONNECT = 0xFFFFFFFF


ARGUMENTS: dict[Command, str] = {
    Command.CREATE_PRIMITIVE: "<I",
    Command.SET_ACTIVE: "<iI",
    Command.SET_WORLD_TRANSFORM: "<i10f",
    Command.SET_LOCAL_TRANSFORM: "<i10f",
    Command.SET_COLOR: "<i4f",
    Command.SET_TEXTURE: "<i",
    Command.CREATE_TEXT: "<",
    Command.SET_TEXT: "<i5f",
    Command.SAY: "<",
    Command.LOAD_MESH: "<",
    Command.REMOVE: "<i",
    Command.REMOVE_ALL: "<",
    Command.BEGIN_DISPLAY_LIST: "<",
    Command.END_DISPLAY_LIST: "<",
    Command.SET_TARGET_MODE: "<I",
    Command.DISCONNECT: "<",
}
"""Values of a command's data: keys; position, quaternion x y z w and scale, left-handed, y up;
red, green, blue, opacity; a text's size and colour."""

WITH_REST = frozenset(
    {Command.SET_TEXTURE, Command.SET_TEXT, Command.SAY, Command.LOAD_MESH, Command.DISCONNECT}
)
"""Commands whose values are followed by bytes: a picture, or UTF-8."""


@dataclass(frozen=True, slots=True)
class Order:
    """One command with its data.

    Attributes:
        command: which.
        values: as `ARGUMENTS` says.
        rest: bytes after them.
    """

    command: Command
    values: tuple[Any, ...] = ()
    rest: bytes = b""


def encode_order(order: Order) -> bytes:
    """Return a command's bytes."""
    data = struct.pack(ARGUMENTS[order.command], *order.values) + order.rest
    return COMMAND_HEADER.pack(order.command, len(data)) + data


@dataclass(frozen=True, slots=True)
class UnknownOrder:
    """A command of another number, or whose data are not its own; it is answered with 0."""

    number: int
    size: int


def read_order(take: Take) -> Order | UnknownOrder:
    """Read a command.

    Raises:
        WireError: its data are said to be larger than `MAX_DATA_BYTES`.
    """
    number, size = taken(take, COMMAND_HEADER)
    data = take(checked_count("message queue: bytes of data", size, most=MAX_DATA_BYTES))
    try:
        command = Command(number)
    except ValueError:
        return UnknownOrder(number, size)
    layout = struct.Struct(ARGUMENTS[command])
    if size < layout.size or (size > layout.size and command not in WITH_REST):
        return UnknownOrder(number, size)
    return Order(command, layout.unpack(data[: layout.size]), data[layout.size :])


def encode_result(result: int) -> bytes:
    """Return the bytes of a result; keys below 0 as the same 32 bits."""
    return RESULT.pack(result & 0xFFFFFFFF)


def read_result(take: Take) -> int:
    """Read a result."""
    return int(taken(take, RESULT)[0])


def key_of(result: int) -> int:
    """Return the key that a result means: 32 bits with a sign.

    Raises:
        WireError: the result is 0: nothing was made.
    """
    if not result:
        raise WireError("message queue: result 0, wanted the key of what was to be made")
    return result - (1 << 32) if result >= 1 << 31 else result
