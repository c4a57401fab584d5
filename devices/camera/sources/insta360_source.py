"""An Insta360 camera in its own Wi-Fi as a source of units: its preview on TCP port 6666."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator

from devices.camera.address import CameraAddress
from devices.camera.units import IDLE_S, Idle, SourceError, StreamFormat, Unit
from devices.clock import Clock
from devices.insta360.camera_time import CameraTime
from devices.insta360.commands import CameraInfo
from devices.insta360.errors import CameraError
from devices.insta360.preview import PreviewClient
from devices.insta360.preview_data import PreviewLimits
from scenes.workers.task import Task

LIMITS = PreviewLimits(connect_s=2.0, reply_s=2.0, packet_s=2.0, picture_s=3.0)
"""How long it waits, seconds: shorter than the defaults, for it is tried again at once."""


class Insta360Source:
    """A `Source`: each call of `units` is a connection of its own.

    Args:
        address: of the camera.
        clock: session time.
        unix_s: seconds since 1970, to set the camera's clock; None leaves that as it is.

    Attributes:
        info: what the camera says of itself, its lenses' calibration included; None before the
            first connection.
    """

    tracks = 1

    def __init__(
        self, address: CameraAddress, clock: Clock, unix_s: Callable[[], int] | None = None
    ) -> None:
        self._address = address
        self._clock = clock
        self._unix_s = unix_s
        self.info: CameraInfo | None = None

    def units(self, stop: threading.Event) -> Iterator[Unit | Idle]:
        """See `Source.units`.

        Raises:
            SourceError: the camera, or the way to it, failed.
        """
        host, port = self._address.host, self._address.port
        client = PreviewClient(host, port, clock=self._clock, limits=LIMITS)
        try:
            yield from self._opened(client, stop)
            yield from self._received(client, stop)
        except CameraError as error:
            raise SourceError(f"{self._address.shown}: {error}") from None
        finally:
            client.close()

    def close(self) -> None:
        """Nothing is open between calls of `units`."""

    def _opened(self, client: PreviewClient, stop: threading.Event) -> Iterator[Idle]:
        """Connect and start the preview on a thread, so that a close is seen meanwhile."""
        opening = Task("open insta360", lambda _: self._open(client), expected=CameraError)
        opening.start()
        while opening.is_running and not stop.is_set():
            opening.join(IDLE_S)
            yield Idle(f"connecting to {self._address.shown}", connected=False)
        if isinstance(opening.error, CameraError):
            raise opening.error

    def _open(self, client: PreviewClient) -> None:
        client.connect()
        if self._unix_s is not None:
            client.set_time(self._unix_s())
        self.info = client.info()
        client.start()

    def _received(self, client: PreviewClient, stop: threading.Event) -> Iterator[Unit | Idle]:
        form: StreamFormat | None = None
        time = CameraTime()
        while not stop.is_set():
            taken = client.take(IDLE_S)
            if taken is None:
                yield Idle(f"{self._address.shown}: no picture", connected=True)
                continue
            if form is None:
                form = StreamFormat(taken.unit.codec)
            t_ns = time.session_ns(taken.unit.stamp, taken.received_ns)
            yield Unit(form, taken.unit.data, taken.unit.keyframe, t_ns)
