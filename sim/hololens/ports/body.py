"""Port 3812 of a simulated HoloLens: head, eyes and hands, 60 times a second."""

from __future__ import annotations

from devices.hololens.wire.packets import Packet, encode_packet
from devices.hololens.wire.spatial_input import encode_input
from sim.hololens.axes import input_of, nothing_seen
from sim.hololens.faults import HoloLensFaultKind
from sim.hololens.ports.serving import Guest, HeadsetPort
from sim.hololens.world import Counts, HeadsetWorld

PERIOD_NS = 1_000_000_000 // 60
"""Time between two samples, nanoseconds."""


class BodyPort:
    """Spatial input.

    Args:
        place: host and port.
        world: what all ports share.

    Raises:
        OSError: the port is taken.
    """

    def __init__(self, place: tuple[str, int], world: HeadsetWorld) -> None:
        self._world = world
        self.counts = Counts()
        self._port = HeadsetPort(
            place, world, serve=self._serve, name="hololens body port", counts=self.counts
        )

    @property
    def number(self) -> int:
        """The real number of the port."""
        return self._port.number

    def close(self) -> None:
        """Stop; waits for the thread."""
        self._port.close()

    def _serve(self, guest: Guest) -> None:
        world = self._world
        sample = nothing_seen()
        due_ns = world.clock.now_ns()
        while not world.is_hung_up():
            # What is sensed at an instant is known when it comes: no time is lost in reckoning.
            t_s = world.seconds(due_ns)
            world_from_room = world.room_from_world(t_s).inverse()
            sample = input_of(world.body(t_s), world_from_room, before=sample)
            data = encode_packet(Packet(world.ticks(due_ns), encode_input(sample)))
            world.clock.sleep_until(due_ns)
            if guest.random.random() >= world.faults.size_of(HoloLensFaultKind.DROP, t_s):
                guest.send(data)
                self.counts.messages += 1
            late = max(0, world.clock.now_ns() - due_ns) // PERIOD_NS
            due_ns += PERIOD_NS * (1 + late)
