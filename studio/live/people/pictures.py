"""Pictures of live surfaces for people elsewhere: made small and encoded beside the session."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.workers.latest import Latest
from studio.view.surface_drawing import LivePicture

EVERY_NS = 100_000_000
"""Session time between two pictures of a surface, chosen: a hand that writes moves evenly, and
sixteen people without WebRTC get twenty Mbit/s of one surface together."""

MAX_SIDE_PX = 1024
"""Longer side of a picture that is sent: what a surface fills of a headset's picture."""

QUALITY = 80
"""Of JPEG, chosen: thin letters on a whiteboard stay readable."""


class Screens(Protocol):
    """People's screens, as far as pictures of live surfaces go."""

    def show(self, surface_id: str, jpeg: bytes) -> None:
        """Send what a surface shows to everybody; returns at once."""
        ...


class SurfacePictures:
    """Encodes what live surfaces show, the newest that there is, and sends it to people.

    A picture that is the same to the byte as the one before is not sent again.

    Args:
        screens: the hub, or what stands for it.
    """

    def __init__(self, screens: Screens) -> None:
        self._screens = screens
        self._sent: dict[str, bytes] = {}
        self._next_ns = 0
        self._worker: Latest[Sequence[LivePicture]] = Latest("surface pictures", self._send)

    @property
    def is_busy(self) -> bool:
        """Whether a picture is encoded or waits."""
        return self._worker.is_busy

    def show(self, pictures: Sequence[LivePicture], now_ns: int) -> None:
        """Take what is shown at a session time; returns at once."""
        if pictures and now_ns >= self._next_ns:
            self._next_ns = now_ns + EVERY_NS
            self._worker.ask(pictures)

    def close(self) -> None:
        """End the thread."""
        self._worker.close()

    def _send(self, pictures: Sequence[LivePicture], stale: threading.Event) -> None:
        made: dict[str, bytes] = {}
        for live in pictures:
            if stale.is_set():
                return
            key = live.surface.surface_id
            made[key] = jpeg_of(live.picture)
            if made[key] != self._sent.get(key):
                self._screens.show(key, made[key])
        self._sent = made


def jpeg_of(picture: NDArray[np.uint8]) -> bytes:
    """Return an (H, W, 3) RGB picture as a JPEG, made smaller where it is too large to be sent."""
    height, width = picture.shape[:2]
    scale = MAX_SIDE_PX / max(height, width)
    if scale < 1.0:
        size = (max(1, round(width * scale)), max(1, round(height * scale)))
        picture = cv2.resize(picture, size, interpolation=cv2.INTER_AREA).astype(np.uint8)
    bgr = cv2.cvtColor(picture, cv2.COLOR_RGB2BGR)
    is_done, data = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
    assert is_done  # an array of bytes in memory always is
    return data.tobytes()
