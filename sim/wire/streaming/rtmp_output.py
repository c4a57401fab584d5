"""Pushes a camera's units over RTMP, connects again when that breaks, and fails on request."""

from __future__ import annotations

import contextlib
from collections import deque

from devices.camera.rtmp.chunks import RtmpError
from scenes.workers.task import Task
from sim.wire.flv_packets import avc_header, avc_picture
from sim.wire.rtmp_client import RETRY_S, STALLED_S, RtmpClient
from sim.wire.streaming.outbox import Outbox
from sim.wire.streaming.output import LOOK_S, OutputSetting
from sim.wire.unit_faults import OutgoingUnit

MAX_ABANDONED = 8
"""Connections that are left open after the camera vanished from them; the oldest is closed."""


class RtmpOutput:
    """One pushed stream, on a thread of its own.

    Args:
        url: where to, e.g. `rtmp://127.0.0.1:1935/live/room`.
        setting: see `OutputSetting`.
    """

    name = "rtmp"

    def __init__(self, url: str, setting: OutputSetting) -> None:
        self.url = url
        self._setting = setting
        self._outbox = Outbox()
        self._task = Task("camera pushes", self._run)
        self._abandoned: deque[RtmpClient] = deque()
        self._refusal = ""
        self.connections = 0
        self.sent_units = 0
        self._task.start()

    def put(self, unit: OutgoingUnit) -> None:
        """See `Output.put`."""
        self._outbox.put(unit)

    def close(self) -> None:
        """See `Output.close`."""
        self._task.cancel()
        self._task.join(2 * STALLED_S)
        for client in self._abandoned:
            client.close()

    def _run(self, _task: Task[None]) -> None:
        while not self._task.is_cancelled:
            state = self._setting.current()
            if not state.is_on or state.black_hole:
                self._task.pause(LOOK_S)
                continue
            try:
                client = RtmpClient(self.url, timeout_s=STALLED_S)
            except (OSError, RtmpError) as error:
                self._refused(str(getattr(error, "strerror", None) or error))
            else:
                self._refusal = ""
                self._connected(client)
            if self._setting.current().is_on:
                self._task.pause(RETRY_S)

    def _refused(self, words: str) -> None:
        """Say why there is no connection, once."""
        if words != self._refusal:
            self._setting.report("refused", to=self.name, error=words)
        self._refusal = words

    def _connected(self, client: RtmpClient) -> None:
        self.connections += 1
        self._setting.report("connected", to=self.name, connection=self.connections)
        self._outbox.open()
        why = "the connection broke"
        try:
            why = self._stream(client)
        except (OSError, RtmpError) as error:
            why = str(getattr(error, "strerror", None) or error)
            client.close()
        self._outbox.shut()
        self._setting.report("disconnected", to=self.name, connection=self.connections, error=why)

    def _stream(self, client: RtmpClient) -> str:
        """Send until the camera or the receiver leaves; why, in words."""
        while not self._task.is_cancelled:
            state = self._setting.current()
            if state.vanished:
                self._abandon(client)
                return "the camera vanished"
            if state.away:
                client.finish()
                return "the camera was switched off"
            if state.black_hole:
                self._outbox.shut()
                self._task.pause(LOOK_S)
                continue
            if not self._outbox.is_open:
                self._outbox.open()
            unit = self._outbox.take(self._setting.now, LOOK_S)
            if unit is None:
                client.look()
            if unit is None or unit.is_lost:
                continue
            if state.garbage_bytes:
                client.send_bytes(self._setting.random.randbytes(state.garbage_bytes))
            self._send(client, unit)
        client.finish()
        return "the stream ended"

    def _send(self, client: RtmpClient, unit: OutgoingUnit) -> None:
        time_ms = unit.stamp_ns // 1_000_000
        if unit.keyframe:
            client.send_video(avc_header(unit.data), time_ms)
        client.send_video(avc_picture(unit.data, keyframe=unit.keyframe), time_ms)
        self.sent_units += 1
        self._setting.sent(unit, self.name)

    def _abandon(self, client: RtmpClient) -> None:
        """Leave a connection open and look at it never again."""
        self._abandoned.append(client)
        while len(self._abandoned) > MAX_ABANDONED:
            with contextlib.suppress(OSError):
                self._abandoned.popleft().close()
