"""The way from a camera's address to a camera that can be tracked with, a person asked or not."""

from __future__ import annotations

import threading
from collections.abc import Callable

from devices.camera.lenses.layout import LensLayout
from devices.camera.lenses.search import FoundLayout
from devices.camera.received import Received
from devices.camera.receiver import CameraReceiver
from devices.footage import FootageError
from studio.live.placing import PICTURES, SURE, PlacedCamera, PlacingError, layout_of
from studio.live.setup import LiveSetup
from studio.live.status import Journal, LiveState

POLL_S = 0.1
"""Seconds between looks at the camera while there is nothing else to do."""

PICTURES_APART_S = 0.4
"""Seconds between the pictures that lenses are fitted to: who walks is elsewhere by then."""

Place = Callable[[list[Received], LensLayout], PlacedCamera]
"""Finds lenses and pose from pictures under a layout; raises `PlacingError` where it cannot."""


class Approach:
    """Runs on one thread; answers come from others.

    Args:
        receiver: of the camera.
        setup: the devices.
        place: finds lenses and pose.
        journal: takes how it goes.
        asks: whether a person confirms a doubtful layout, and says when to try again.
    """

    def __init__(
        self,
        receiver: CameraReceiver,
        setup: LiveSetup,
        *,
        place: Place,
        journal: Journal,
        asks: bool,
    ) -> None:
        self._receiver = receiver
        self._place = place
        self._journal = journal
        self._asks = asks
        self._chosen = setup.layout
        self._found: FoundLayout | None = None
        self._ended = threading.Event()
        self._wakes = threading.Event()

    @property
    def found_layout(self) -> FoundLayout | None:
        """How the first picture seems to hold the lenses; None before it came."""
        return self._found

    @property
    def layout(self) -> LensLayout | None:
        """The layout that is used: the chosen one, else the likeliest; None before a picture."""
        return self._chosen or (None if self._found is None else self._found.layout)

    def choose_layout(self, layout: LensLayout) -> None:
        """A person says how the picture holds the lenses."""
        self._chosen = layout
        self._wakes.set()

    def try_again(self) -> None:
        """A person says that it can be tried again."""
        self._wakes.set()

    def end(self) -> None:
        """Give up."""
        self._ended.set()
        self._wakes.set()

    def run(self) -> PlacedCamera | None:
        """A camera that is ready; None if it was ended before.

        Raises:
            PlacingError, FootageError, OSError: it cannot be used, and nobody is asked.
        """
        while (pictures := self._still_pictures()) is not None:
            layout = self._agreed_layout(pictures[-1])
            if layout is None:
                return None
            self._journal.say(LiveState.PLACING, "finding lenses and place of the camera")
            try:
                return self._place(pictures, layout)
            except (PlacingError, FootageError, OSError) as error:
                if not self._asks:
                    raise
                self._journal.note("camera-refused", str(error))
                self._journal.say(LiveState.REFUSED, str(error))
            self._wakes.clear()
            while not (self._wakes.wait(POLL_S) or self._ended.is_set()):
                continue
        return None

    def _still_pictures(self) -> list[Received] | None:
        """The camera's next pictures, some time apart; None if it was ended before."""
        pictures: list[Received] = []
        while len(pictures) < PICTURES and not self._ended.is_set():
            over = self._receiver.latest.closed
            received = self._receiver.latest.take(timeout_s=POLL_S)
            status = self._receiver.status()
            self._journal.say(LiveState.CONNECTING, status.reason)
            if received is None and over:
                if pictures:
                    return pictures
                raise PlacingError(f"no picture of the camera: {status.reason}")
            apart_ns = PICTURES_APART_S * 1e9
            if received is None or (pictures and received.t_ns - pictures[-1].t_ns < apart_ns):
                continue
            if pictures and len(pictures[0].pictures) != len(received.pictures):
                pictures.clear()
            pictures.append(received)
        return None if self._ended.is_set() else pictures

    def _agreed_layout(self, received: Received) -> LensLayout | None:
        """How the picture holds the lenses; None if it was ended before that was agreed."""
        found = layout_of(received)
        self._found = found
        if self._chosen is None and self._asks and found.confidence < SURE:
            self._wakes.clear()
            self._journal.say(
                LiveState.CONFIRMING,
                f"the picture looks like {found.layout.shown} ({found.confidence:.0%} sure): "
                "confirm or choose",
            )
            while self._chosen is None and not self._ended.is_set():
                self._wakes.wait(POLL_S)
        if self._ended.is_set():
            return None
        layout = self._chosen or found.layout
        self._journal.note("camera-layout", f"the picture holds the lenses {layout.shown}")
        return layout
