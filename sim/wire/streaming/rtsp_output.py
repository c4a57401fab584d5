"""A camera's units for whoever asks over RTSP, and the camera's faults there."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable
from dataclasses import dataclass

from scenes.workers.task import Task
from sim.wire.faults import WireState
from sim.wire.film.film import Film
from sim.wire.rtsp.packets import session_description
from sim.wire.rtsp.server import RtspFaults, RtspServer, RtspStream, StreamUnit
from sim.wire.streaming.outbox import Outbox
from sim.wire.streaming.output import LOOK_S, OutputSetting
from sim.wire.unit_faults import OutgoingUnit

PATH = "room"
"""Of the stream's URL."""


@dataclass(frozen=True, slots=True)
class RtspPlace:
    """Address at which it listens.

    Attributes:
        host: address.
        port: 0 for any free one.
    """

    host: str = "127.0.0.1"
    port: int = 0


class RtspOutput:
    """One stream for several players.

    Args:
        place: where it listens.
        film: for the description of the stream.
        setting: see `OutputSetting`.
        wall_ns: nanoseconds since 1970, for the reports.

    Raises:
        OSError: the port is taken.
        ValueError: the film's first picture has no parameter sets.
    """

    name = "rtsp"

    def __init__(
        self,
        place: RtspPlace,
        film: Film,
        setting: OutputSetting,
        *,
        wall_ns: Callable[[], int],
    ) -> None:
        self._setting, self._place = setting, place
        keyframe, fps = film.unit(0).data, film.form.fps
        session_description(keyframe, fps=fps, host=place.host)
        self._stream = RtspStream(
            PATH,
            lambda host: session_description(keyframe, fps=fps, host=host),
            self._view,
            wall_ns,
        )
        self._lock = threading.Lock()
        self._viewings: list[_Viewing] = []
        self._task = Task("camera RTSP faults", self._watch)
        self._state = WireState()
        self._connections_before = 0
        self._plays = 0
        self.sent_units = 0
        self._server: RtspServer | None = self._listen()
        self._place = RtspPlace(place.host, self._server.address[1])
        self._task.start()

    @property
    def url(self) -> str:
        """See `Output.url`."""
        return f"rtsp://{self._place.host}:{self._place.port}/{PATH}"

    @property
    def port(self) -> int:
        """The port that it really has."""
        return self._place.port

    @property
    def connections(self) -> int:
        """See `Output.connections`."""
        server = self._server
        return self._connections_before + (0 if server is None else server.connections)

    def put(self, unit: OutgoingUnit) -> None:
        """See `Output.put`."""
        with self._lock:
            for viewing in self._viewings:
                viewing.outbox.put(unit)

    def close(self) -> None:
        """See `Output.close`."""
        self._task.cancel()
        self._task.join()
        self._switch_off()

    def sent(self, unit: OutgoingUnit) -> None:
        """A player was sent a unit."""
        self.sent_units += 1
        self._setting.sent(unit, self.name)

    def leave(self, viewing: _Viewing) -> None:
        """A player has left."""
        with self._lock:
            self._viewings.remove(viewing)

    def _view(self) -> _Viewing:
        viewing = _Viewing(self, self._setting.now)
        with self._lock:
            self._viewings.append(viewing)
            self._plays += 1
            number = self._plays
        self._setting.report("connected", to=self.name, connection=number)
        return viewing

    def _listen(self) -> RtspServer:
        place = self._place
        return RtspServer(self._stream, self._setting.random, host=place.host, port=place.port)

    def _watch(self, _task: Task[None]) -> None:
        """Be as faulty as the schedule has it."""
        while not self._task.is_cancelled:
            state = self._setting.current()
            if state != self._state or (self._server is None and not state.away):
                self._become(state)
                self._state = state
            self._task.pause(LOOK_S)

    def _become(self, state: WireState) -> None:
        if state.away:
            self._switch_off()
        elif self._server is None:
            # Somebody else may have the port by now: it is tried again at the next look.
            with contextlib.suppress(OSError):
                self._server = self._listen()
        if self._server is None:
            return
        if state.vanished != self._state.vanished:
            self._server.abandon()
        silent = state.black_hole or state.vanished
        was_silent = self._server.faults.silent
        self._server.faults = RtspFaults(silent, state.garbage_bytes)
        with self._lock:
            for viewing in self._viewings:
                if silent:
                    viewing.outbox.shut()
                elif was_silent:
                    viewing.outbox.open()

    def _switch_off(self) -> None:
        server, self._server = self._server, None
        if server is not None:
            self._connections_before += server.connections
            server.close()


class _Viewing:
    """The packets for one player: see `sim.wire.rtsp.server.Viewing`."""

    def __init__(self, output: RtspOutput, now: Callable[[], int]) -> None:
        self.outbox = Outbox()
        self.outbox.open()
        self._output, self._now = output, now
        self._taken: OutgoingUnit | None = None

    def take(self, timeout_s: float) -> StreamUnit | None:
        unit = self._taken = self.outbox.take(self._now, timeout_s)
        if unit is None:
            return None
        return StreamUnit(max(0, unit.stamp_ns), unit.data, unit.is_lost, unit.loss)

    def sent(self, unit: StreamUnit) -> None:
        del unit
        if self._taken is not None:
            self._output.sent(self._taken)

    def close(self) -> None:
        self._output.leave(self)
