"""A camera's units as an Insta360 camera gives them: TCP 6666, and its HTTP interface beside it."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass

from devices.clock import Clock
from devices.insta360.commands import CameraInfo
from devices.messages import EncodedFrame
from scenes.workers.task import Task
from sim.wire.faults import WireState
from sim.wire.osc_camera import OscCamera
from sim.wire.osc_server import OscFaults, OscServer
from sim.wire.preview_server import PreviewFaults, PreviewServer
from sim.wire.streaming.outbox import Outbox
from sim.wire.streaming.output import LOOK_S, OutputSetting
from sim.wire.unit_faults import OutgoingUnit

INFO = CameraInfo("IXSESIM001", "Insta360 X4", "v1.4.6", 0.8)
"""Identity, firmware and charge that the simulated camera reports."""


@dataclass(frozen=True, slots=True)
class Insta360Ports:
    """Ports at which it listens; 0 for any free one.

    Attributes:
        host: address.
        preview: of the live pictures.
        osc: of the HTTP interface; None for none.
    """

    host: str = "127.0.0.1"
    preview: int = 0
    osc: int | None = None


class Insta360Output:
    """One camera, one client at a time.

    Args:
        ports: where it listens.
        clock: session time.
        setting: see `OutputSetting`.

    Raises:
        OSError: a port is taken.
    """

    name = "insta360"

    def __init__(self, ports: Insta360Ports, clock: Clock, setting: OutputSetting) -> None:
        self._clock, self._setting = clock, setting
        self._outbox = Outbox()
        self._task = Task("camera faults", self._watch)
        self._connections_before = 0
        self._state = WireState()
        self._ports = ports
        self.sent_units = 0
        self._preview: PreviewServer | None = self._listen()
        port = self._preview.address[1]
        self._osc: OscServer | None = None
        try:
            self._osc = self._listen_http()
        except OSError:
            self._preview.close()
            raise
        osc_port = None if self._osc is None else self._osc.address[1]
        self._ports = Insta360Ports(ports.host, port, osc_port)
        self._task.start()

    @property
    def url(self) -> str:
        """See `Output.url`."""
        http = "" if self._ports.osc is None else f"?http={self._ports.osc}"
        return f"insta360://{self._ports.host}:{self._ports.preview}{http}"

    @property
    def ports(self) -> Insta360Ports:
        """The ports that it really has."""
        return self._ports

    @property
    def connections(self) -> int:
        """See `Output.connections`."""
        now = 0 if self._preview is None else self._preview.connections
        return self._connections_before + now

    def put(self, unit: OutgoingUnit) -> None:
        """See `Output.put`."""
        self._outbox.put(unit)

    def close(self) -> None:
        """See `Output.close`."""
        self._task.cancel()
        self._task.join()
        self._switch_off()

    def _listen(self) -> PreviewServer:
        return PreviewServer(
            self._feed,
            self._clock,
            INFO,
            host=self._ports.host,
            port=self._ports.preview,
            seed=self._setting.random.getrandbits(32),
            paced=False,
        )

    def _listen_http(self) -> OscServer | None:
        if self._ports.osc is None:
            return None
        camera = OscCamera(self._clock, INFO)
        return OscServer(camera, host=self._ports.host, port=self._ports.osc)

    def _feed(self) -> Iterator[EncodedFrame]:
        """Yield the units for one preview, from a keyframe on."""
        outbox = self._outbox = Outbox()
        outbox.open()
        # Another preview has an outbox of its own: two never share a stream.
        while not self._task.is_cancelled and outbox is self._outbox:
            unit = outbox.take(self._setting.now, LOOK_S)
            if unit is None or unit.is_lost:
                continue
            yield EncodedFrame(
                self.name, unit.number, max(0, unit.stamp_ns), unit.data, unit.keyframe
            )
            self.sent_units += 1
            self._setting.sent(unit, self.name)

    def _watch(self, _task: Task[None]) -> None:
        """Report clients, and be as faulty as the schedule has it."""
        known = 0
        while not self._task.is_cancelled:
            state = self._setting.current()
            if state != self._state or (self._preview is None and not state.away):
                self._become(state)
                self._state = state
            if self.connections > known:
                known = self.connections
                self._setting.report("connected", to=self.name, connection=known)
            self._task.pause(LOOK_S)

    def _become(self, state: WireState) -> None:
        if state.away and self._preview is not None:
            self._switch_off()
        if not state.away and self._preview is None:
            # Somebody else may have the port by now: it is tried again at the next look.
            with contextlib.suppress(OSError):
                self._preview, self._osc = self._listen(), self._listen_http()
        if self._preview is None:
            return
        if state.vanished != self._state.vanished:
            self._preview.abandon()
        silent = state.black_hole or state.vanished
        # What is sent after a silence begins with a keyframe, as nothing before it was sent.
        if silent:
            self._outbox.shut()
        elif self._preview.faults.half_open:
            self._outbox.open()
        self._preview.faults = PreviewFaults(half_open=silent, garbage=state.garbage_bytes > 0)
        if self._osc is not None:
            self._osc.faults = OscFaults(half_open=silent, garbage=state.garbage_bytes > 0)

    def _switch_off(self) -> None:
        if self._preview is not None:
            self._connections_before += self._preview.connections
            self._preview.close()
        if self._osc is not None:
            self._osc.close()
        self._preview, self._osc = None, None
