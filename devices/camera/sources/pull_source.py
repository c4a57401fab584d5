"""A camera that the studio connects to, read in a process of its own.

FFmpeg can block in a read for as long as a peer likes, and a hostile stream may crash it. Neither
reaches the studio: the process is killed, and what it did is a `SourceError`.
"""

from __future__ import annotations

import socket
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from devices.camera.address import AddressKind, CameraAddress, address_to_json
from devices.camera.sources.unit_line import Failed, LineError, LineReader, Opened
from devices.camera.units import IDLE_S, Idle, SourceError, Unit
from devices.clock import Clock
from scenes.workers.child_process import ChildProcess

READ_BYTES = 1 << 18
"""Bytes read at a time; the socket between two processes holds 208 kB by default."""

LEAVE_S = 2.0
"""Seconds that a process that said why it ends may take to end."""

_ROOT = Path(__file__).resolve().parents[3]

COMMAND = (
    sys.executable,
    "-c",
    f"import sys; sys.path.insert(0, {str(_ROOT)!r}); "
    "from devices.camera.sources.pull_process import main; main()",
)
"""Command of the process. Only PyAV and four small modules are imported: 0.15 s to connect."""


@dataclass(frozen=True, slots=True)
class Patience:
    """How long a stream may keep the studio waiting, seconds; None for ever.

    Attributes:
        open_s: until it is open.
        read_s: from one picture to the next.
    """

    open_s: float | None
    read_s: float


PATIENCE = {
    AddressKind.RTSP: Patience(3.0, 2.0),
    AddressKind.UDP: Patience(None, 2.0),
    AddressKind.HLS: Patience(15.0, 15.0),
    AddressKind.V4L2: Patience(6.0, 3.0),
}
"""RTSP on loopback opens in 0.4 s; a camera sends at least one picture a second, and one that lost
its power says nothing at all, so this is how soon it is tried again. UDP has nobody to connect to:
the port stays open. HLS comes in segments of up to 10 s. A USB camera starts within a few seconds.
"""


class PullSource:
    """A `Source`: each call of `units` is a process of its own.

    Args:
        address: RTSP, UDP, HLS or V4L2.
        clock: session time.
        command: what is run instead of `COMMAND`.
        patience: how long to wait instead of `PATIENCE`.
    """

    tracks = 1

    def __init__(
        self,
        address: CameraAddress,
        clock: Clock,
        *,
        command: Sequence[str] = COMMAND,
        patience: Patience | None = None,
    ) -> None:
        self._address = address
        self._clock = clock
        self._command = tuple(command)
        self._patience = patience or PATIENCE[address.kind]
        self._failure = ""

    def units(self, stop: threading.Event) -> Iterator[Unit | Idle]:
        """See `Source.units`.

        Raises:
            SourceError: the stream, or the process that reads it, failed.
        """
        line, process = self._started()
        try:
            yield from self._received(line, process, stop)
        except SourceError as error:
            self._failure = f"{error}; trying again"
            raise
        finally:
            line.close()
            process.end()

    def close(self) -> None:
        """Nothing is open between calls of `units`."""

    def _started(self) -> tuple[socket.socket, ChildProcess]:
        ours, theirs = socket.socketpair()
        try:
            with theirs:
                process = ChildProcess(
                    self._command,
                    stdin=theirs.fileno(),
                    stderr=subprocess.DEVNULL,
                    has_group=True,
                )
        except OSError as error:
            ours.close()
            raise SourceError(
                f"{self._address.shown}: no process to read it ({error.strerror}); close other "
                "programs"
            ) from None
        try:
            ours.sendall(address_to_json(self._address).encode() + b"\n")
            ours.settimeout(IDLE_S)
        except OSError:
            pass  # it ended already: seen at the first read
        return ours, process

    def _received(
        self, line: socket.socket, process: ChildProcess, stop: threading.Event
    ) -> Iterator[Unit | Idle]:
        reader = LineReader()
        is_open = False
        since_ns = self._clock.now_ns()
        while not stop.is_set():
            data = _read(line)
            if data == b"":
                raise self._died(process)
            messages = [] if data is None else self._messages(reader, data)
            for message in messages:
                since_ns = self._clock.now_ns()
                if isinstance(message, Failed):
                    raise SourceError(message.text, is_final=message.is_final)
                if isinstance(message, Opened):
                    is_open = True
                else:
                    yield message
            if not messages:
                self._check(is_open=is_open, silent_s=(self._clock.now_ns() - since_ns) / 1e9)
                yield Idle(self._waiting(is_open=is_open), connected=is_open)

    def _messages(self, reader: LineReader, data: bytes) -> list[Opened | Unit | Failed]:
        try:
            return reader.take(data)
        except LineError as error:
            raise SourceError(
                f"{self._address.shown}: the process that reads it: {error}"
            ) from None

    def _check(self, *, is_open: bool, silent_s: float) -> None:
        max_s = self._patience.read_s if is_open else self._patience.open_s
        if max_s is None or silent_s <= max_s:
            return
        what = "no picture" if is_open else "no stream"
        raise SourceError(f"{self._address.shown}: {what} within {max_s:g} s; {self._advice()}")

    def _advice(self) -> str:
        if self._address.kind is AddressKind.V4L2:
            return "unplug the camera and plug it in again"
        return "is the camera on, and in this network?"

    def _waiting(self, *, is_open: bool) -> str:
        shown = self._address.shown
        if is_open:
            return f"{shown}: no picture"
        if self._address.kind is AddressKind.UDP:
            return f"waiting for a camera to send to {shown}"
        return self._failure or f"connecting to {shown}"

    def _died(self, process: ChildProcess) -> SourceError:
        code = process.wait(LEAVE_S)
        if code is None:
            return SourceError(f"{self._address.shown}: the process that reads it fell silent")
        how = f"was ended by signal {-code}" if code < 0 else f"ended with status {code}"
        return SourceError(
            f"{self._address.shown}: the process that reads it {how}; the stream is damaged, or "
            "memory ran out"
        )


def _read(line: socket.socket) -> bytes | None:
    """Read for up to `IDLE_S`; None if nothing came, empty at the end."""
    try:
        return line.recv(READ_BYTES)
    except TimeoutError:
        return None
    except OSError:
        return b""
