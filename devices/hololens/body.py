"""Head, eyes and hands of the wearer, handed to every consumer."""

from __future__ import annotations

from devices.clock import Clock
from devices.hololens.axes import head_and_hands
from devices.hololens.configuration import Configuration
from devices.hololens.links.connection import Connection, StoppedError
from devices.hololens.links.fan_out import FanOut
from devices.hololens.links.health import StreamHealth
from devices.hololens.links.link import Link
from devices.hololens.plan import MAX_RETRY_S
from devices.hololens.values import HeadAndHands, StreamStatus
from devices.hololens.wire.packets import read_packet
from devices.hololens.wire.spatial_input import INPUT_LAYOUT, read_input


class Body:
    """Spatial input of one headset; starts at once.

    Args:
        address: of the port.
        clock: session time.
        configuration: of the same headset.
        retry_s: longest wait between two attempts to connect.
    """

    def __init__(
        self,
        address: tuple[str, int],
        clock: Clock,
        *,
        configuration: Configuration,
        retry_s: float = MAX_RETRY_S,
    ) -> None:
        self.samples: FanOut[HeadAndHands] = FanOut()
        self.health = StreamHealth("body", clock)
        self._clock, self._configuration = clock, configuration
        self._seq = 0
        self._link = Link(
            address,
            clock,
            health=self.health,
            talk=self._talk,
            name="hololens body",
            retry_s=retry_s,
            silent_hint=": answer the question about eye tracking on the headset, or close another "
            "program that is connected to this port",
        )

    def status(self) -> StreamStatus:
        """Return how it is doing."""
        return self.health.status(dropped=self.samples.dropped)

    def close(self) -> None:
        """Hang up; waits for the thread."""
        self._link.close()
        self.samples.close()

    def _talk(self, connection: Connection) -> None:
        while not connection.is_stopped:
            packet = read_packet(connection.take, has_pose=False, max_bytes=INPUT_LAYOUT.itemsize)
            arrived_ns = self._clock.now_ns()
            sample = read_input(packet.payload)
            t_ns = self._configuration.session_ns(packet.ticks)
            self.health.came(
                len(packet.payload), delay_ns=None if t_ns is None else arrived_ns - t_ns
            )
            found = head_and_hands(
                sample,
                seq=self._seq,
                t_ns=arrived_ns if t_ns is None else t_ns,
                arrived_ns=arrived_ns,
            )
            self._seq += 1
            self.samples.put(found)
        raise StoppedError
