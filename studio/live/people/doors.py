"""Doors of a live session: a hub that is opened, opened wider and closed while the session runs."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace

from devices.clock import Clock
from devices.hub.contract import Arrived
from devices.hub.entry.tokens import Tokens
from devices.hub.server import Hub
from scenes.package import ScenePackage
from scenes.state import SceneState
from studio.live.people.hosting import Hosting, hosted


class Doors:
    """People in a session that lets nobody in at first. Methods may be called from any thread.

    Opened again, it listens at the same port, and lets people back in with the tokens that they
    have.

    Args:
        scene: shown to those who join.
        clock: session time.
        say: takes a line for the log.
    """

    def __init__(self, scene: ScenePackage, *, clock: Clock, say: Callable[[str], None]) -> None:
        self._scene, self._clock, self._say = scene, clock, say
        self._tokens = Tokens()
        self._hub: Hub | None = None
        self._hosting: Hosting | None = None
        self._opened = ExitStack()
        self._changing = threading.Lock()
        self._port = 0
        self._is_over = False

    @property
    def hub(self) -> Hub | None:
        """The hub; None while the doors are closed."""
        return self._hub

    @property
    def hosting(self) -> Hosting | None:
        """How people join; None while they cannot."""
        return None if self._hub is None else self._hosting

    def open(self, hosting: Hosting) -> Hub:
        """Let people in; a hub that is open otherwise is closed first.

        Raises:
            OSError: the port is taken, or the certificate cannot be made.
            ValueError: the session is over.
        """
        with self._changing:
            if self._is_over:
                raise ValueError("people: the session is over, nobody can join it any more")
            if self._hub is not None and hosting == self._hosting:
                return self._hub
            self._shut()
            try:
                self._hub = self._enter(replace(hosting, port=hosting.port or self._port))
            except OSError:
                if hosting.port or not self._port:
                    raise
                self._say(f"people: port {self._port} is taken, another one is opened")
                self._hub = self._enter(hosting)
            self._hosting, self._port = hosting, self._hub.port
            return self._hub

    def _enter(self, hosting: Hosting) -> Hub:
        entering = hosted(
            hosting, self._scene, clock=self._clock, say=self._say, tokens=self._tokens
        )
        return self._opened.enter_context(entering)

    def close(self) -> None:
        """Say goodbye to everybody; the doors can be opened again."""
        with self._changing:
            self._shut()

    def end(self) -> None:
        """Close the doors for good: the session is over."""
        with self._changing:
            self._is_over = True
            self._shut()

    def now_ns(self) -> int:
        """Return session time, by which codes expire."""
        return self._clock.now_ns()

    def take(self) -> Arrived:
        """Return what people have sent since the last call."""
        hub = self._hub
        return Arrived() if hub is None else hub.take()

    def publish(self, state: SceneState) -> None:
        """Send what has changed to everybody; returns at once."""
        hub = self._hub
        if hub is not None:
            hub.publish(state)

    def show(self, surface_id: str, jpeg: bytes) -> None:
        """Send what a live surface shows to everybody; returns at once."""
        hub = self._hub
        if hub is not None:
            hub.show(surface_id, jpeg)

    def _shut(self) -> None:
        self._hub = None
        self._opened.close()
