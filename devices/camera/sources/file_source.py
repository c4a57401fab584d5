"""A recorded file as a camera: its pictures come at the pace at which they were filmed."""

from __future__ import annotations

import threading
from collections.abc import Iterator

from devices.camera.address import CameraAddress
from devices.camera.container_units import ContainerUnits
from devices.camera.units import IDLE_S, Idle, StreamEndedError, Unit
from devices.clock import Clock

MAX_BEHIND_NS = 500_000_000
"""Nanoseconds that playing may be late before it goes on more slowly instead of catching up."""


class FileSource:
    """A `Source`: plays a file once.

    Args:
        address: a file.
        clock: session time, which sets the pace.

    Raises:
        SourceError: it cannot be opened.
    """

    def __init__(self, address: CameraAddress, clock: Clock) -> None:
        self._address = address
        self._clock = clock
        units = ContainerUnits(address)
        self.tracks = units.tracks
        units.close()

    def units(self, stop: threading.Event) -> Iterator[Unit | Idle]:
        """Every unit at its time after the first.

        Raises:
            StreamEndedError: after the last.
            SourceError: the file is damaged.
        """
        opened = ContainerUnits(self._address)
        start_ns: int | None = None
        try:
            for unit in opened:
                if unit.pts_ns is None:
                    continue
                now_ns = self._clock.now_ns()
                if start_ns is None or now_ns > start_ns + unit.pts_ns + MAX_BEHIND_NS:
                    start_ns = now_ns - unit.pts_ns
                yield from self._until(start_ns + unit.pts_ns, stop)
                if stop.is_set():
                    return
                yield unit
        finally:
            opened.close()
        raise StreamEndedError(f"{self._address.shown}: the file has ended", is_final=True)

    def _until(self, t_ns: int, stop: threading.Event) -> Iterator[Idle]:
        while (now_ns := self._clock.now_ns()) < t_ns and not stop.is_set():
            self._clock.sleep_until(min(t_ns, now_ns + round(IDLE_S * 1e9)))
            if self._clock.now_ns() < t_ns:
                yield Idle(f"playing {self._address.shown}", connected=True)

    def close(self) -> None:
        """Nothing is open between calls of `units`."""
