"""The headset's camera on and off, each over a connection of its own."""

from __future__ import annotations

import threading
from contextlib import suppress

from devices.clock import Clock
from devices.hololens.configuration import Configuration
from devices.hololens.links.connection import Connection, HeadsetError
from devices.hololens.wire.personal_video import StartVideo, StopVideo, encode_opening
from devices.hololens.wire.remote_configuration import Request, Setting

READY_S, POLL_S = 10.0, 0.1
"""Longest wait for the camera to start, and how often it is asked, seconds; it takes 1 to 2 s."""

ASK_S = 1.0
"""Longest wait for one answer."""


class CameraSwitch:
    """Starts and stops the camera.

    Args:
        address: of the camera's port.
        clock: session time.
        configuration: of the same headset.
    """

    def __init__(
        self, address: tuple[str, int], clock: Clock, *, configuration: Configuration
    ) -> None:
        self._address, self._clock = address, clock
        self._configuration = configuration

    def start(self, stop: threading.Event) -> None:
        """Start the camera, if it does not run already; ends once `stop` is set.

        Raises:
            HeadsetError: it did not start.
        """
        if self._is_running() is True:
            return
        self._say(StartVideo(), stop)
        until_ns = self._clock.now_ns() + round(1e9 * READY_S)
        while not stop.wait(POLL_S):
            # Where nobody answers, the stream itself says whether there is a camera.
            if self._is_running() is not False:
                return
            if self._clock.now_ns() > until_ns:
                raise HeadsetError(
                    f"{self._address[0]}: the camera did not start within {READY_S:g} s; another "
                    "app on the headset may have it: close that"
                )

    def stop(self) -> None:
        """Stop the camera, if the headset is there."""
        with suppress(HeadsetError):
            self._say(StopVideo(), threading.Event())

    def _is_running(self) -> bool | None:
        """Whether the camera runs; None where nobody says."""
        try:
            return self._configuration.ask(Request(Setting.VIDEO_STATUS), ASK_S) == (1,)
        except HeadsetError:
            return None

    def _say(self, opening: StartVideo | StopVideo, stop: threading.Event) -> None:
        """Say one thing, and wait until it was taken."""
        connection = Connection(self._address, self._clock, stop=stop, silent_s=ASK_S)
        try:
            connection.send(encode_opening(opening))
            connection.is_over(POLL_S)
        finally:
            connection.close()
