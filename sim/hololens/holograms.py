"""Display of a simulated HoloLens: the stock scene behind its message queue."""

from __future__ import annotations

import threading
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.hololens.wire.message_queue import USE_ID, USE_LAST, Command, Order, UnknownOrder
from scenes.pose import Pose
from sim.hololens.axes import from_unity

FIRST_KEY = 101
"""Key of the first item that is made."""

MAX_HOLOGRAMS = 10_000
"""Most items that it holds; further ones are refused."""

TEXT = 6
"""Number of a text among shapes 0 to 5."""

YES, NO = 1, 0
"""Results."""


@dataclass(frozen=True, slots=True, eq=False)
class Hologram:
    """One item as it is seen.

    Attributes:
        key: its number.
        shape: 0 to 5 as the protocol counts shapes, or `TEXT`.
        world_from_item: in the headset's world, z up.
        scale: (3,) along its own axes.
        colour: red, green, blue, opacity.
        is_active: whether it is seen.
        text: of a text.
        is_local: whether it hangs before the wearer's eyes.
        texture: size of its picture in bytes.
    """

    key: int
    shape: int
    world_from_item: Pose
    scale: NDArray[np.float64]
    colour: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    is_active: bool = True
    text: str = ""
    is_local: bool = False
    texture: int = 0


class Holograms:
    """All that the headset shows; any thread may ask.

    Attributes:
        said: the last words that it was to speak.
        lists: display lists so far.
        orders: commands so far.
    """

    def __init__(self) -> None:
        self.said, self.lists, self.orders = "", 0, 0
        self._lock = threading.Lock()
        self._key = FIRST_KEY
        self._shown: dict[int, Hologram] = {}
        self._next: dict[int, Hologram] = {}
        self._is_listing = False
        self._mode, self._last = USE_ID, 0

    def shown(self) -> tuple[Hologram, ...]:
        """Return what is seen: a list that has not ended is not."""
        with self._lock:
            return tuple(each for each in self._shown.values() if each.is_active)

    @property
    def is_listing(self) -> bool:
        """Whether a display list has begun and not ended."""
        return self._is_listing

    def begin(self) -> None:
        """A client has connected: a list that another has begun is given up."""
        with self._lock:
            self._next, self._is_listing = dict(self._shown), False
            self._mode = USE_ID

    def obey(self, order: Order | UnknownOrder) -> int:
        """Do as a command says; return its result."""
        with self._lock:
            self.orders += 1
            if isinstance(order, UnknownOrder):
                return NO
            result = self._obey(order)
            if not self._is_listing:
                self._shown = dict(self._next)
            return result

    def _obey(self, order: Order) -> int:
        values = order.values
        match order.command:
            case Command.CREATE_PRIMITIVE:
                return self._make(values[0]) if values[0] < TEXT else NO
            case Command.CREATE_TEXT:
                return self._make(TEXT)
            case Command.REMOVE:
                return YES if self._next.pop(self._target(values[0]), None) else NO
            case Command.REMOVE_ALL:
                self._next.clear()
                return YES
            case Command.BEGIN_DISPLAY_LIST:
                self._is_listing = True
                return YES
            case Command.END_DISPLAY_LIST:
                self.lists += self._is_listing
                self._is_listing = False
                return YES
            case Command.SET_TARGET_MODE:
                if values[0] not in (USE_ID, USE_LAST):
                    return NO
                self._mode = values[0]
                return YES
            case Command.SAY:
                self.said = order.rest.decode(errors="replace")
                return YES
            case Command.LOAD_MESH | Command.DISCONNECT:
                return NO
            case _:
                return self._change(order)

    def _make(self, shape: int) -> int:
        if len(self._next) >= MAX_HOLOGRAMS:
            return NO
        key, self._key = self._key, self._key + 1
        self._last = key
        self._next[key] = Hologram(key, shape, Pose.identity(), np.ones(3))
        return key

    def _target(self, key: int) -> int:
        return self._last if self._mode == USE_LAST else key

    def _change(self, order: Order) -> int:
        key, *values = order.values
        was = self._next.get(self._target(key))
        if was is None:
            return NO
        changes: dict[str, Any] = {}
        match order.command:
            case Command.SET_ACTIVE:
                changes["is_active"] = bool(values[0])
            case Command.SET_WORLD_TRANSFORM | Command.SET_LOCAL_TRANSFORM:
                found = from_unity(tuple(values))
                if found is None:
                    return NO
                changes["world_from_item"], changes["scale"] = found
                changes["is_local"] = order.command is Command.SET_LOCAL_TRANSFORM
            case Command.SET_COLOR:
                changes["colour"] = tuple(values)
            case Command.SET_TEXT:
                changes["colour"] = tuple(values[1:])
                changes["text"] = order.rest.decode(errors="replace")
            case Command.SET_TEXTURE:
                changes["texture"] = len(order.rest)
            case _:
                return NO
        self._next[was.key] = replace(was, **changes)
        return YES
