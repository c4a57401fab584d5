"""Port 3816 of a simulated HoloLens: commands to its display, each answered in order."""

from __future__ import annotations

from devices.hololens.wire.message_queue import Command, Order, encode_result, read_order
from sim.hololens.holograms import Holograms
from sim.hololens.ports.serving import Guest, HeadsetPort
from sim.hololens.world import Counts, HeadsetWorld


class DisplayPort:
    """Message queue of the display.

    Args:
        place: host and port.
        world: what all ports share.
        holograms: what is shown.

    Raises:
        OSError: the port is taken.
    """

    def __init__(
        self, place: tuple[str, int], world: HeadsetWorld, *, holograms: Holograms
    ) -> None:
        self._holograms = holograms
        self.counts = Counts()
        self._port = HeadsetPort(
            place, world, serve=self._serve, name="hololens display port", counts=self.counts
        )

    @property
    def number(self) -> int:
        """The real number of the port."""
        return self._port.number

    def close(self) -> None:
        """Stop; waits for the thread."""
        self._port.close()

    def _serve(self, guest: Guest) -> None:
        self._holograms.begin()
        while True:
            guest.message_ended()
            order = read_order(guest.take)
            if isinstance(order, Order) and order.command is Command.DISCONNECT:
                return
            # A list comes as one piece: all of it is as late as its first command.
            if not self._holograms.is_listing:
                guest.delay()
            guest.reply(encode_result(self._holograms.obey(order)))
            self.counts.messages += 1
