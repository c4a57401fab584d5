"""A camera's stream on threads of its own: decoded at once, and the newest picture wins."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from devices.adapter import Sink
from devices.camera.address import AddressKind, CameraAddress
from devices.camera.decoding import Arrived, Decoding
from devices.camera.received import CameraState, CameraStatus, Received
from devices.camera.rtmp.listener import RtmpListener
from devices.camera.sources.file_source import FileSource
from devices.camera.sources.insta360_source import Insta360Source
from devices.camera.sources.pull_source import PullSource
from devices.camera.units import (
    Idle,
    Source,
    SourceError,
    StreamEndedError,
    StreamFormat,
    Unit,
)
from devices.clock import Clock
from devices.insta360.files.lens_rig import CarriedLenses, read_carried
from devices.insta360.files.offsets import OffsetError
from devices.messages import EncodedFrame, Event
from devices.streams import Slot, StreamClosedError, StreamFullError
from scenes.workers.task import Task

HELD_AFTER_NS = 1_000_000_000
"""Age of the last picture, nanoseconds, from which it is called held: 30 missed at 30 Hz."""

FIRST_WAIT_S, MAX_WAIT_S = 0.25, 0.5
"""Seconds between attempts, doubling from one to the other: what is back is found within 5 s."""

CLOSE_S = 5.0
"""Seconds that `close` waits for the thread; sources answer within 0.2 s."""

MAX_EVENTS = 256
"""Events kept until they are taken; the oldest go first."""

OVER = frozenset({CameraState.FAILED, CameraState.ENDED})
"""States in which the receiver has stopped by itself."""

MakeSource = Callable[[CameraAddress, Clock], Source]


def open_source(address: CameraAddress, clock: Clock) -> Source:
    """The source of an address.

    Raises:
        SourceError: a file or a port cannot be opened.
    """
    if address.kind is AddressKind.RTMP_LISTEN:
        return RtmpListener(address, clock)
    if address.kind is AddressKind.FILE:
        return FileSource(address, clock)
    if address.kind is AddressKind.INSTA360:
        return Insta360Source(address, clock)
    return PullSource(address, clock)


class CameraReceiver:
    """Receives one camera until it is closed; starts at once.

    One thread reads and records what arrives, another decodes it.

    Args:
        address: where the pictures come from.
        clock: session time, by which arrivals are stamped.
        packets: takes every encoded picture in order, before it is decoded; it must not block. What
            it has no room for is counted and said.
        stream_id: written into packets and events.
        make_source: opens the address; given for sources that are built elsewhere.

    Attributes:
        latest: the newest picture, for one consumer; `last` is for everybody else.
    """

    def __init__(
        self,
        address: CameraAddress,
        clock: Clock,
        *,
        packets: Sink[EncodedFrame] | None = None,
        stream_id: str = "camera-360",
        make_source: MakeSource = open_source,
    ) -> None:
        self.latest: Slot[Received] = Slot()
        self._address = address
        self._clock = clock
        self._packets = packets
        self._stream_id = stream_id
        self._make_source = make_source
        self._lock = threading.Lock()
        self._status = CameraStatus(CameraState.CONNECTING, f"connecting to {address.shown}")
        self._last: Received | None = None
        self._source: Source | None = None
        self._events: deque[Event] = deque(maxlen=MAX_EVENTS)
        self._seq = 0
        self._formats: dict[int, StreamFormat] = {}
        self._decoding: Decoding | None = None
        self._is_held = False
        self._task = Task(f"receive {stream_id}", self._run)
        self._task.start()

    @property
    def address(self) -> CameraAddress:
        """Address that the pictures come from."""
        return self._address

    @property
    def listening_at(self) -> str:
        """For cameras that push: where to, with the real port; empty if the studio connects."""
        source = self._source
        return source.shown if isinstance(source, RtmpListener) else ""

    @property
    def last(self) -> Received | None:
        """The newest picture, kept while nothing arrives; None before the first."""
        return self._last

    def carried_lenses(self) -> CarriedLenses | None:
        """Return the calibration that the camera or the file carries; None where it has none.

        Raises:
            OSError: the file cannot be read.
        """
        source = self._source
        if isinstance(source, Insta360Source) and source.info is not None:
            info = source.info
            words = info.offset_v3 or info.offset_v2 or info.offset
            return CarriedLenses(words, info.camera_type) if words else None
        if self._address.kind is AddressKind.FILE:
            try:
                return read_carried(Path(self._address.path))
            except OffsetError as error:
                self._event("lens-calibration", str(error))
        return None

    def status(self) -> CameraStatus:
        """How it is doing now."""
        with self._lock:
            status, last, decoding = self._status, self._last, self._decoding
        if decoding is not None:
            dropped = self.latest.dropped + decoding.skipped
            status = replace(status, dropped=dropped, damaged=decoding.damaged)
        if last is None:
            return status
        age_ns = max(0, self._clock.now_ns() - last.t_ns)
        state = status.state
        if state not in OVER:
            state = CameraState.HELD if age_ns > HELD_AFTER_NS else CameraState.LIVE
        return replace(status, state=state, last_age_ns=age_ns)

    def take_events(self) -> list[Event]:
        """Take the events since the last call, oldest first: gaps, sizes, connections, failures."""
        taken: list[Event] = []
        while self._events:
            taken.append(self._events.popleft())
        return taken

    def close(self) -> None:
        """Stop receiving and give everything back; waits for the thread.

        Raises:
            RuntimeError: the thread did not end within `CLOSE_S`.
        """
        self._task.cancel()
        if not self._task.join(CLOSE_S):
            raise RuntimeError(
                f"{self._address.shown}: receiving did not stop within {CLOSE_S:g} s"
            )

    def _run(self, task: Task[None]) -> None:
        try:
            self._receive(task)
        finally:
            if self._source is not None:
                self._source.close()
            if self._decoding is not None:
                self._decoding.close()
            self.latest.close()

    def _receive(self, task: Task[None]) -> None:
        wait_s = FIRST_WAIT_S
        while not task.is_cancelled:
            before = self._status.pictures
            try:
                if self._source is None:
                    self._source = self._make_source(self._address, self._clock)
                    self._decoding = self._start_decoding(self._source.tracks)
                for unit in self._source.units(task.cancelled):
                    self._take(unit)
                text, is_final = f"{self._address.shown}: the stream ended", False
            except StreamEndedError as error:
                failure = None if self._decoding is None else self._decoding.finish(task.cancelled)
                state = CameraState.ENDED if failure is None else CameraState.FAILED
                self._end(state, str(failure or error))
                return
            except SourceError as error:
                text, is_final = str(error), error.is_final
            if task.is_cancelled:
                return
            if is_final:
                self._end(CameraState.FAILED, text)
                return
            wait_s = FIRST_WAIT_S if self._status.pictures > before else wait_s
            self._say(CameraState.WAITING, f"{text}; trying again")
            self._notice_hold()
            # Whoever listens has nothing to try again, and must not keep a camera waiting.
            task.pause(0.0 if self.listening_at else wait_s)
            wait_s = min(2 * wait_s, MAX_WAIT_S)

    def _start_decoding(self, tracks: int) -> Decoding:
        return Decoding(
            tracks,
            clock=self._clock,
            name=f"decode {self._stream_id}",
            hand_out=self._hand_out,
        )

    def _take(self, unit: Unit | Idle) -> None:
        decoding = self._decoding
        if decoding is None:
            return
        if isinstance(unit, Idle):
            decoding.check()
            if self._last is None or self._is_held:
                state = CameraState.CONNECTING if unit.connected else CameraState.WAITING
                self._say(state, unit.text)
            self._notice_hold()
            return
        now_ns = self._clock.now_ns()
        # Another connection has another format object, even where it says the same.
        begins = self._formats.get(unit.track) is not unit.format
        self._formats[unit.track] = unit.format
        self._save(unit, now_ns, begins=begins)
        if begins:
            self._begin(unit)
        with self._lock:
            received_bytes = self._status.received_bytes + len(unit.data)
            self._status = replace(self._status, received_bytes=received_bytes)
        decoding.put(Arrived(unit, self._seq, now_ns))
        self._seq += 1

    def _hand_out(self, received: Received) -> None:
        """A picture; called on the thread that decodes."""
        self._notice_return(received)
        picture = received.pictures[0]
        size_px = (picture.width_px, picture.height_px)
        if size_px != self._status.size_px:
            self._event("camera-size", f"pictures of {size_px[0]}×{size_px[1]} px")
        with self._lock:
            self._last = received
            self._status = replace(
                self._status,
                state=CameraState.LIVE,
                reason=f"receiving from {self.listening_at or self._address.shown}",
                size_px=size_px,
                pictures=self._status.pictures + 1,
            )
        self.latest.put(received)

    def _begin(self, unit: Unit) -> None:
        if unit.track == 0:
            count = self._status.connections + 1
            with self._lock:
                self._status = replace(self._status, connections=count, codec=unit.format.codec)
            self._event("camera-connected", f"stream {count} began, {unit.format.codec}")

    def _save(self, unit: Unit, now_ns: int, *, begins: bool) -> None:
        """Hand the unit to the packet sink; full is counted, and said once in a row."""
        if self._packets is None:
            return
        name = self._stream_id if unit.track == 0 else f"{self._stream_id}/{unit.track}"
        try:
            self._packets.put(
                EncodedFrame(
                    name,
                    self._seq,
                    now_ns,
                    unit.data,
                    unit.keyframe,
                    codec=unit.format.codec,
                    begins=begins,
                )
            )
        except (StreamFullError, StreamClosedError) as error:
            if not self._status.unsaved:
                self._event("camera-unsaved", f"encoded pictures are not saved: {error}")
            with self._lock:
                self._status = replace(self._status, unsaved=self._status.unsaved + 1)

    def _notice_hold(self) -> None:
        last = self._last
        if last is None or self._is_held:
            return
        if self._clock.now_ns() - last.t_ns > HELD_AFTER_NS:
            self._is_held = True
            self._event("camera-held", "no new picture; the last one is shown")

    def _notice_return(self, received: Received) -> None:
        last = self._last
        gap_ns = 0 if last is None else received.t_ns - last.t_ns
        if gap_ns > HELD_AFTER_NS:
            self._event("camera-gap", f"pictures are back after {gap_ns / 1e9:.1f} s without any")
        self._is_held = False

    def _end(self, state: CameraState, text: str) -> None:
        self._say(state, text)
        self._event(f"camera-{state}", text)

    def _say(self, state: CameraState, reason: str) -> None:
        with self._lock:
            self._status = replace(self._status, state=state, reason=reason)

    def _event(self, kind: str, text: str) -> None:
        self._events.append(Event(self._clock.now_ns(), self._stream_id, kind, text))
