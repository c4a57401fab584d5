"""The headset's display: the newest list wins, 20 times a second at most, what changed only."""

from __future__ import annotations

import threading
from collections.abc import Mapping

from devices.clock import Clock
from devices.hololens.display_list import MAX_ITEMS, DisplayList, Item
from devices.hololens.display_orders import Shown, transform_of, update_between
from devices.hololens.links.connection import Connection, StoppedError
from devices.hololens.links.health import StreamHealth
from devices.hololens.links.link import Link
from devices.hololens.plan import MAX_RETRY_S
from devices.hololens.values import StreamStatus
from devices.hololens.wire.message_queue import (
    Command,
    Order,
    encode_order,
    key_of,
    read_result,
)
from devices.hololens.wire.taking import WireError

PERIOD_NS = 50_000_000
"""Shortest time between two updates, nanoseconds: 20 a second. The headset applies a list in one
of its pictures, and more lists than that make it stutter."""

IDLE_S = 0.2
"""How often an idle connection is looked at."""


class Display:
    """Message queue of one headset; starts at once.

    Args:
        address: of the port.
        clock: session time.
        retry_s: longest wait between two attempts to connect.
    """

    def __init__(
        self, address: tuple[str, int], clock: Clock, *, retry_s: float = MAX_RETRY_S
    ) -> None:
        self.health = StreamHealth("display", clock, is_steady=False)
        self._clock = clock
        self._wanted: Mapping[str, Item] = {}
        self._changed = threading.Event()
        self._shown: dict[str, Shown] = {}
        self._link = Link(
            address,
            clock,
            health=self.health,
            talk=self._talk,
            name="hololens display",
            retry_s=retry_s,
        )

    @property
    def drawn(self) -> int:
        """Items that the headset has confirmed."""
        return len(self._shown)

    def draw(self, items: DisplayList) -> None:
        """Have this and nothing else on the display; never waits, the newest list wins.

        Raises:
            ValueError: there are more than `MAX_ITEMS`.
        """
        if len(items) > MAX_ITEMS:
            raise ValueError(f"display: {len(items)} items, limit {MAX_ITEMS}; draw fewer")
        self._wanted = dict(items)
        self._changed.set()

    def status(self) -> StreamStatus:
        """Return how it is doing."""
        return self.health.status()

    def close(self) -> None:
        """Take everything off the display and hang up; waits for the thread."""
        self._link.close()

    def _talk(self, connection: Connection) -> None:
        # What an earlier connection has drawn is nobody's.
        self._shown = {}
        self._send(connection, [Order(Command.REMOVE_ALL)])
        self._changed.set()
        try:
            while not connection.is_stopped:
                if not self._changed.wait(IDLE_S):
                    connection.check()
                    continue
                self._changed.clear()
                begun_ns = self._clock.now_ns()
                self._update(connection)
                wait_ns = begun_ns + PERIOD_NS - self._clock.now_ns()
                connection.pause(max(0, wait_ns) * 1e-9)
        except StoppedError:
            connection.send(encode_order(Order(Command.REMOVE_ALL)))
            raise
        connection.send(encode_order(Order(Command.REMOVE_ALL)))
        raise StoppedError

    def _update(self, connection: Connection) -> None:
        wanted = self._wanted
        update = update_between(self._shown, wanted)
        if not update.orders:
            return
        results = self._send(connection, list(update.orders))
        for name in update.gone:
            self._shown.pop(name, None)
        self._shown.update(update.changed)
        for name, place in update.made.items():
            item = wanted[name]
            self._shown[name] = Shown(key_of(results[place]), item, transform_of(item))

    def _send(self, connection: Connection, orders: list[Order]) -> list[int]:
        """Send commands together, and take the result of each.

        Raises:
            WireError: one was refused; what the headset shows is not known then.
        """
        sent_ns = self._clock.now_ns()
        data = b"".join(map(encode_order, orders))
        connection.send(data)
        results = [read_result(connection.take) for _ in orders]
        self.health.came(len(data), delay_ns=(self._clock.now_ns() - sent_ns) // 2)
        for order, result in zip(orders, results, strict=True):
            if not result:
                raise WireError(f"message queue: {order.command.name} was refused; drawing anew")
        return results
